"""The pattern of the stiffness matrix: built once, filled at every step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from reluctance.machine.geometry.mesh import Integers
from reluctance.machine.geometry.steel import Array


@dataclass(frozen=True)
class Sparsity:
    """Places of the non-zeros, compressed by columns. Index n stands for a potential of zero, whose
    rows and columns are left out."""

    n: int
    columns: Integers  # (n + 1)
    rows: Integers  # (n_nonzero)

    @property
    def n_nonzero(self) -> int:
        return len(self.rows)

    def place(self, row: Integers, column: Integers) -> Integers:
        """Place of each entry among the non-zeros; n_nonzero where it is left out."""
        keys = np.repeat(np.arange(self.n), np.diff(self.columns)) * self.n + self.rows
        kept = (row < self.n) & (column < self.n)
        wanted = np.where(kept, column * self.n + row, 0)
        return np.where(kept, np.searchsorted(keys, wanted), self.n_nonzero)

    def sum(self, place: Integers, values: Array) -> Array:
        """Values added up at their places."""
        total = np.bincount(place, weights=values.ravel(), minlength=self.n_nonzero + 1)
        return np.asarray(total[: self.n_nonzero], dtype=np.float64)

    def matrix(self, data: Array) -> sp.csc_matrix:
        """The matrix with these non-zeros."""
        return sp.csc_matrix((data, self.rows, self.columns), shape=(self.n, self.n))


def pairs(left: Integers, right: Integers) -> tuple[Integers, Integers]:
    """Rows and columns of the dense blocks left x right: (..., a), (..., b) to (... a b)."""
    block = (*left.shape, right.shape[-1])
    row = np.broadcast_to(left[..., :, None], block)
    column = np.broadcast_to(right[..., None, :], block)
    return row.ravel(), column.ravel()


def sparsity(n: int, blocks: list[Integers]) -> Sparsity:
    """The pattern of symmetric dense blocks on groups of unknowns, each (..., size)."""
    entries = [pairs(block, block) for block in blocks]
    row, column = (np.concatenate([pair[k] for pair in entries]) for k in (0, 1))
    kept = (row < n) & (column < n)
    key = np.unique(column[kept] * n + row[kept])
    columns = np.searchsorted(key // n, np.arange(n + 1))
    return Sparsity(n=n, columns=columns.astype(np.int32), rows=(key % n).astype(np.int32))


def elimination_order(pattern: Sparsity) -> Integers:
    """Place of each unknown in the order of elimination with little fill (minimum degree)."""
    data = np.ones(pattern.n_nonzero)
    dominant = pattern.matrix(data) + sp.diags(np.full(pattern.n, float(pattern.n)))
    factors = splu(
        dominant.tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    return np.asarray(factors.perm_c, dtype=np.int64)
