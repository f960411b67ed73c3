"""Which phases of a machine couple, and what that adds to them."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from reluctance import _core
from reluctance.base.arrays import FloatArray
from reluctance.base.errors import ParameterError
from reluctance.machine.models import Magnetics

if TYPE_CHECKING:
    from reluctance.machine.maps.pairs import PairState, PairTable

LETTERS = "abcdef"


def apart(first: int, second: int, n_phases: int) -> float:
    """From the electrical angle of the second phase to that of the first, the short way [rad]."""
    return float(np.pi - (np.pi - 2 * np.pi * (second - first) / n_phases) % (2 * np.pi))


@dataclass(frozen=True)
class Neighbours:
    """Two phases whose poles stand side by side."""

    first: int  # phases of the drive, each 2 pi/n_phases behind the one before
    second: int
    table: PairTable

    @property
    def letters(self) -> str:
        """As `ab`."""
        return LETTERS[self.first] + LETTERS[self.second]


def behind(first: int, second: int, n_phases: int) -> float:
    """The electrical angle of phase a less that of a pair, in [0, 2 pi) [rad]."""
    delta = apart(first, second, n_phases)
    return float((2 * np.pi * first / n_phases + delta / 2) % (2 * np.pi))


@dataclass(frozen=True)
class Coupling:
    """All pairs of a machine. Phases that are no neighbours do not couple here, and what three
    phases add to their pairs is left out."""

    n_phases: int
    pairs: tuple[Neighbours, ...]
    factor: float = 1.0  # on the co-energy of all pairs

    def times(self, factor: float) -> Coupling:
        """With so much of all that the pairs add."""
        return self if factor == 1 else replace(self, factor=self.factor * factor)

    @property
    def i_last(self) -> float:
        """Up to which all tables reach [A]."""
        return min(float(pair.table.i[-1]) for pair in self.pairs)

    @property
    def is_alike(self) -> bool:
        """Whether every phase sees the same: then all have the same current, one after another."""
        n = self.n_phases
        tables = {(pair.first, pair.second): pair.table for pair in self.pairs}
        return all(
            tables.get(((first + 1) % n, (second + 1) % n)) is table
            for (first, second), table in tables.items()
        )

    @property
    def mean(self) -> Coupling:
        """With the mean of all pairs as far apart in the place of each, so that all phases have the
        same neighbours."""
        from reluctance.machine.maps.pairs import mean_table  # here: SciPy is slow to import

        n, pairs = self.n_phases, []
        for d in sorted({(pair.second - pair.first) % n for pair in self.pairs}):
            kinds = [pair.table for pair in self.pairs if (pair.second - pair.first) % n == d]
            table = kinds[0] if len(set(kinds)) == 1 else mean_table(kinds)
            pairs += [Neighbours(k, (k + d) % n, table) for k in range(n)]
        return replace(self, pairs=tuple(pairs))

    @property
    def mirror(self) -> int | None:
        """The phase m in the place of phase 0 when phases are passed in reverse order: m - k has
        the neighbours of k from the other side. None where the reverse is another winding, as it
        is with three pairs of three kinds."""
        n = self.n_phases
        tables = {(pair.first, pair.second): pair.table for pair in self.pairs}
        for s in range(n):
            if all(tables.get(((s - b) % n, (s - a) % n)) is t for (a, b), t in tables.items()):
                return s
        return None

    @property
    def reversed(self) -> Coupling:
        """Its phases in reverse order: -k in the place of k."""
        n = self.n_phases
        pairs = (Neighbours(-p.second % n, -p.first % n, p.table) for p in self.pairs)
        return replace(self, pairs=tuple(pairs))

    @property
    def content(self) -> list[Any]:
        """All that results depend on, for a cache key."""
        found: list[Any] = ["pairs", self.factor]
        for pair in self.pairs:
            table = pair.table
            numbers = (table.i, table.f, table.phi, table.C)
            digest = hashlib.sha256(b"".join(part.tobytes() for part in numbers)).hexdigest()
            found += [pair.first, pair.second, digest]
        return found

    def tau(self, i: ArrayLike, theta_e: ArrayLike) -> FloatArray:
        """Torque that the pairs add [N m].

        Parameters
        ----------
        i : array_like, shape (..., n_phases)
            Phase currents [A].
        theta_e : array_like, shape (...)
            Electrical angle of phase a [rad].
        """
        i, theta_e = np.asarray(i, dtype=np.float64), np.asarray(theta_e, dtype=np.float64)
        total = np.zeros(np.broadcast_shapes(i.shape[:-1], theta_e.shape))
        for n in range(len(self.pairs)):
            total = total + self._of(n, i, theta_e).tau
        return total

    def psi(self, i: FloatArray, theta_e: FloatArray) -> FloatArray:
        """What the pairs add to the flux linkage of each phase (..., n_phases) [Wb]; i and theta_e
        as in `tau`."""
        added = np.zeros(i.shape)
        for n, pair in enumerate(self.pairs):
            x = self._of(n, i, theta_e)
            added[..., pair.first] += x.psi_first
            added[..., pair.second] += x.psi_second
        return added

    def tau_i(self, i: FloatArray, theta_e: FloatArray) -> FloatArray:
        """What the pairs add to the torque per current of each phase (..., n_phases) [N m/A]."""
        added = np.zeros(i.shape)
        for n, pair in enumerate(self.pairs):
            x = self._of(n, i, theta_e)
            added[..., pair.first] += x.tau_first
            added[..., pair.second] += x.tau_second
        return added

    def inductance(self, magnetics: Magnetics, i: FloatArray, theta_e: FloatArray) -> FloatArray:
        """Incremental inductance matrix of a machine whose phases alone are `magnetics`
        (..., n_phases, n_phases) [H]. i, theta_e: as in `tau`."""
        theta_e = np.broadcast_to(theta_e, i.shape[:-1])
        L = np.zeros((*i.shape, self.n_phases))
        for k in range(self.n_phases):
            turned = theta_e - 2 * np.pi * k / self.n_phases
            L[..., k, k] = _L_inc(magnetics, i[..., k], turned)
        for n, pair in enumerate(self.pairs):
            a, b, x = pair.first, pair.second, self._of(n, i, theta_e)
            L[..., a, a] += x.L_first
            L[..., b, b] += x.L_second
            L[..., a, b] += x.L_mutual
            L[..., b, a] += x.L_mutual
        return L

    def _of(self, n: int, i: FloatArray, theta_e: FloatArray) -> PairState:
        """What pair n adds, with the factor."""
        from reluctance.machine.maps.pairs import PairState

        pair = self.pairs[n]
        given = np.broadcast_arrays(i[..., pair.first], i[..., pair.second], theta_e)
        columns = self.core.at(n, *(np.ascontiguousarray(x).ravel() for x in given))
        return PairState(*columns.T.reshape(-1, *given[0].shape))

    @property
    def core(self) -> _core.Coupling:
        """The pairs as simulation and control have them."""
        return _core_of(self)

    def _made(self) -> _core.Coupling:
        tables = list(dict.fromkeys(pair.table for pair in self.pairs))
        rank = max(table.rank for table in tables)
        cells = {len(table.phi) for table in tables}
        if len(cells) > 1 or len({float(table.i[-1]) for table in tables}) > 1:
            raise ParameterError(
                "the tables of the pairs differ in their angles or in their last current; need "
                "the same for all"
            )
        knots = np.unique(np.concatenate([table.knots for table in tables]))

        def padded(x: FloatArray, *axes: int) -> FloatArray:
            more = [(0, rank - n if axis in axes else 0) for axis, n in enumerate(x.shape)]
            return np.pad(x, more)

        return _core.Coupling(
            N_r=tables[0].N_r,
            factor=self.factor,
            pairs=[(pair.first, pair.second, tables.index(pair.table)) for pair in self.pairs],
            behind=[behind(p.first, p.second, self.n_phases) for p in self.pairs],
            knots=knots,
            functions=np.stack([padded(t.current_coefficients(knots), 1) for t in tables]),
            tables=np.stack([padded(t.angle_coefficients, 1, 2) for t in tables]),
        )


@lru_cache(maxsize=32)  # thousands of drives of a sweep have the same machine
def _core_of(coupling: Coupling) -> _core.Coupling:
    return coupling._made()


def check_pairs(coupling: Coupling, magnetics: Magnetics, i_max: float) -> None:
    """Refuses tables with which two currents up to i_max [A] would have no inductance: of a machine
    that is none. magnetics: of one phase alone.

    Raises
    ------
    ParameterError
        Where a table ends below i_max [A], or the incremental inductance matrix with two phases
        on is not positive definite up to it.
    """
    for pair in coupling.pairs:
        if pair.table.i[-1] < i_max * (1 - 1e-9):
            raise ParameterError(
                f"pair of phases {pair.letters}: the table ends at {pair.table.i[-1]:.4g} A, below "
                f"i_max_A = {i_max:.4g}; extend it or lower i_max_A"
            )
    theta_e, a, b = np.meshgrid(
        np.linspace(0, 2 * np.pi, 61), *(np.linspace(0, i_max, 13),) * 2, indexing="ij"
    )
    for pair in coupling.pairs:
        i = np.zeros((*a.shape, coupling.n_phases))
        i[..., pair.first], i[..., pair.second] = a, b
        least = np.linalg.eigvalsh(coupling.inductance(magnetics, i, theta_e))[..., 0]
        n = np.unravel_index(np.argmin(least), least.shape)
        if least[n] <= 0:
            begin = behind(pair.first, pair.second, coupling.n_phases)
            phi = np.mod(theta_e[n] - begin + np.pi, 2 * np.pi) - np.pi
            raise ParameterError(
                f"pair of phases {pair.letters}: the least eigenvalue of the incremental "
                f"inductance matrix is {1e3 * least[n]:.3g} mH at {a[n]:.3g} A and {b[n]:.3g} A, "
                f"{np.degrees(phi):.3g} deg, need > 0; take flux map and pair table from the same "
                "source, or lower the greatest current"
            )


def _L_inc(magnetics: Magnetics, i: FloatArray, theta_e: FloatArray) -> FloatArray:
    """Incremental inductance of one phase [H]."""
    return _column(magnetics, 3, i, theta_e)


def _column(magnetics: Magnetics, column: int, i: FloatArray, theta_e: FloatArray) -> FloatArray:
    turned = np.mod(theta_e, 2 * np.pi)
    flat = _core.magnetics(magnetics, i.ravel().copy(), turned.ravel().copy())
    return np.asarray(flat[:, column]).reshape(i.shape)
