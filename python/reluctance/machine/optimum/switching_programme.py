"""The linear programme behind the bounds of ripple: which leg levels, for how much of the time.

With the notation of ripple.py, at the angles j of a stroke,

    minimise    sum_j b_j + what else is priced
    subject to  w_E E_j + w_O O_j <= b_j     for every pair of weights
                sum_v p_jv = 1
                sum_v p_jv v_k u_dc = u*_k   for a phase that the profile drives at full voltage

and what else is required: rows over the time shares and over further unknowns.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reluctance.base.arrays import FloatArray
from reluctance.base.errors import Unsolved

FULL = 0.98  # of the dc link: a phase with more is driven as the profile drives it [1]
ROUNDING = 1e-6  # of the dc link: what the profile's solver leaves of it is no voltage of a leg [1]
WEIGHTS = 9  # pairs of weights per angle; fewer lower the bound, never raise it


@dataclass(frozen=True)
class Angle:
    """One angle of the stroke: the phases with current, and what their legs may do."""

    on: NDArray[np.intp]  # which phases carry current
    mean: FloatArray  # of their voltages on the profile [u_dc]
    vectors: FloatArray  # (n_vectors, n_on) levels -1, 0, 1
    slope: FloatArray  # (n_vectors,) of the torque against the profile's [N m/s]
    shares: range  # columns of the time shares


class SwitchingProgramme:
    """Columns are b of every angle, the time shares, then further unknowns."""

    def __init__(
        self,
        u: FloatArray,
        gain: FloatArray,
        flows: NDArray[np.bool_],
        *,
        n_phases: int,
        u_dc: float,
    ) -> None:
        """u, gain, flows (n,) over the period of a phase: mean voltage [V], torque per flux linkage
        [N m/Wb], and where current flows."""
        strokes = u.reshape(n_phases, -1).T, gain.reshape(n_phases, -1).T
        carry = flows.reshape(n_phases, -1).T
        self._upper: list[tuple[int, int, float]] = []  # row, column, value
        self._equal: list[tuple[int, int, float]] = []
        self._values: list[float] = []
        self._cost = [1.0] * len(carry)
        self._least = [0.0] * len(carry)
        self._rows = 0
        self.angles = [
            self._angle(j, np.flatnonzero(on), *strokes, u_dc) for j, on in enumerate(carry)
        ]

    def _angle(
        self, j: int, on: NDArray[np.intp], u: FloatArray, gain: FloatArray, u_dc: float
    ) -> Angle:
        mean = u[j, on] / u_dc
        mean = np.where(np.abs(mean) > 1 - ROUNDING, np.sign(mean), mean)
        vectors = np.array(list(product((-1.0, 0.0, 1.0), repeat=len(on))))
        slope = (vectors - mean) @ gain[j, on] * u_dc
        shares = self.unknowns(np.zeros(len(vectors)), 0.0)
        cost = np.abs(slope) ** (2 / 3)
        even = (vectors == 0).sum(axis=1) % 2 == 0
        pairs = weights()
        for w_E, w_O in zip(pairs, pairs[::-1], strict=True):
            priced = np.where(even, w_E, w_O) * cost
            self._upper += zip([self._rows] * len(vectors), shares, priced, strict=True)
            self._upper.append((self._rows, j, -1.0))
            self._rows += 1
        self.require(zip(shares, np.ones(len(vectors)), strict=True), 1.0)
        for k in np.flatnonzero(np.abs(mean) > FULL):
            self.require(zip(shares, vectors[:, k], strict=True), mean[k])
        return Angle(on, mean, vectors, slope, shares)

    def unknowns(self, cost: FloatArray, least: float) -> range:
        """Columns of further unknowns, each with its cost; `least` is their lower bound."""
        first = len(self._cost)
        self._cost += cost.tolist()
        self._least += [least] * len(cost)
        return range(first, len(self._cost))

    def require(self, terms: Iterable[tuple[int, float]], value: float) -> None:
        """The sum of coefficients times columns is the value."""
        row = len(self._values)
        self._equal += [(row, column, coefficient) for column, coefficient in terms]
        self._values.append(float(value))

    def solve(self) -> FloatArray:
        """The unknowns at the optimum.

        Raises
        ------
        Unsolved
            If there is none.
        """
        from scipy.optimize import linprog  # here, because it is slow to import

        columns = len(self._cost)
        solution = linprog(
            self._cost,
            A_ub=_sparse(self._upper, self._rows, columns),
            b_ub=np.zeros(self._rows),
            A_eq=_sparse(self._equal, len(self._values), columns),
            b_eq=self._values,
            bounds=[(least, None) for least in self._least],
        )
        if not solution.success:
            raise Unsolved(f"no least ripple found: {solution.message}")
        return np.asarray(solution.x)


def weights() -> FloatArray:
    """Of E, of 3/2-norm 1 with those of O, which are the same in reverse."""
    return np.asarray(np.linspace(0.0, 1.0, WEIGHTS) ** (2 / 3))


def _sparse(entries: list[tuple[int, int, float]], rows: int, columns: int) -> Any:
    from scipy.sparse import coo_array

    row, column, value = zip(*entries, strict=True)
    return coo_array((value, (row, column)), shape=(rows, columns))
