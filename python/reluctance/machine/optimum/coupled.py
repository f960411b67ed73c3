"""What neighbouring phases add to each other, as functions that CasADi can differentiate."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from reluctance.base.arrays import FloatArray
from reluctance.machine.coupling import Coupling
from reluctance.machine.maps.pairs import PairTable
from reluctance.machine.piecewise import parts, risen, widths


@dataclass(frozen=True)
class Added:
    """Over the points of a pair; CasADi vectors (n,)."""

    psi_first: Any  # [Wb]
    psi_second: Any
    tau: Any  # [N m]


def added(table: PairTable, phi: FloatArray, first: Any, second: Any) -> Added:
    """Without the factor, of a pair at angles phi (n,) [rad], numbers; currents (n,) [A] are CasADi
    vectors."""
    C, rate = table.matrices(phi)
    f, g = (_functions(table, i) for i in (first, second))
    ranks = range(table.rank)

    def joined(left: list[Any], matrix: FloatArray, right: list[Any]) -> Any:
        return sum(left[p] * sum(matrix[:, p, q] * right[q] for q in ranks) for p in ranks)

    return Added(
        psi_first=joined(f[1], C, g[0]),
        psi_second=joined(f[0], C, g[1]),
        tau=table.N_r * joined(f[0], rate, g[0]),
    )


def _functions(table: PairTable, i: Any) -> tuple[list[Any], list[Any]]:
    """Every f of a table at currents (n,) [A], and its derivative."""
    x, width, f, slope = parts(i, table.i), widths(table.i), [], []
    powers = table.current_coefficients(table.i)  # knot, function, power
    for _, first, square, cubic in powers.transpose(1, 2, 0):
        f.append(risen(x, np.stack([first * width, square * width**2, cubic * width**3], axis=1)))
        rises = np.stack([2 * square * width, 3 * cubic * width**2], axis=1)
        slope.append(first[0] + risen(x, rises))
    return f, slope


def alike(coupling: Coupling) -> bool:
    """Whether every phase sees the same: then all have the same current, one after another."""
    n = coupling.n_phases
    tables = {(pair.first, pair.second): pair.table for pair in coupling.pairs}
    return all(
        tables.get(((first + 1) % n, (second + 1) % n)) is table
        for (first, second), table in tables.items()
    )
