"""The profile of each phase where their neighbours differ.

With the mean of all pairs (`Coupling.mean`) all phases carry the same current. With the pairs as
they are, these currents make another torque. So each phase has the current next to it with which
all of them make the torque of the mean again, on the grid of `programme.py`,

    minimise    mean((i - i_mean)^2)/i_unit^2 + WEIGHT mean((tau - tau_mean)^2)/tau_ref^2
    subject to  |u| <= u_dc,  0 <= i <= i_max.

No current is always possible, so there always is an optimum.
"""

import hashlib
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from reluctance.base.arrays import FloatArray
from reluctance.base.cache import cached
from reluctance.base.errors import Unsolved
from reluctance.machine.operating_point import OperatingPoint
from reluctance.machine.optimum.programme import ALGORITHM, IPOPT, Programme, checked_inputs
from reluctance.machine.optimum.table import Table

# Of the torque against the distance: 1e-5 of the torque lack where 1e-2 of the current would make
# it [1].
WEIGHT = 1e6


@dataclass(frozen=True)
class EachPhase:
    """Currents over torque and angle."""

    i: FloatArray  # (n_levels, n_phases, n_points), over the angle of the phase [A]


def each_phase(point: OperatingPoint, table: Table) -> EachPhase:
    """Currents of each phase, next to those of a table for the mean of the pairs.

    Parameters
    ----------
    point : OperatingPoint
        With the pairs as they are, unlike; speed and voltage are those of the table.
    table : Table

    Raises
    ------
    Unsolved : IPOPT found no optimum.
    """
    assert point.coupling is not None
    point = replace(point, u_dc=table.u_dc, omega_m=table.omega_m)
    n = len(table.theta_e)

    def compute() -> EachPhase:
        search = _Search(point, n)
        return EachPhase(np.array([search.near(i) for i in table.i]))

    digest = hashlib.sha256(table.i.tobytes()).hexdigest()
    inputs = [*checked_inputs(point, n, 0.0), table.omega_m, WEIGHT, digest]
    return cached(EachPhase, inputs, compute, algorithm=ALGORITHM)


class _Search:
    """The programme of one operating point and grid."""

    def __init__(self, point: OperatingPoint, n: int) -> None:
        import casadi as ca  # here: it is slow to import, and a cached result does without

        assert point.coupling is not None
        self.n_phases, self.i_max = point.n_phases, point.i_max
        self._mean = Programme(replace(point, coupling=point.coupling.mean), n_points=n)
        size = n * point.n_phases
        x, near, wanted = ca.MX.sym("x", size), ca.MX.sym("near", size), ca.MX.sym("wanted", n)
        lacks, i_unit = ca.MX.sym("lacks", n), ca.MX.sym("i_unit")  # lacks: relative
        _, u, tau = Programme(point, n_points=n).effects(i_unit * x, 1.0, 1.0)
        tau_ref = ca.sum1(wanted) / n
        problem = {
            "x": ca.vertcat(x, lacks),
            "p": ca.vertcat(near, wanted, i_unit),
            "f": ca.sumsqr(x - near) + WEIGHT * ca.sumsqr(lacks),
            "g": ca.vertcat(u / point.u_dc, (tau - wanted) / tau_ref + lacks),
        }
        options: dict[str, Any] = {**IPOPT, "ipopt.mu_strategy": "adaptive"}
        self._solver = ca.nlpsol("each_phase", "ipopt", problem, options)

    def near(self, i: FloatArray) -> FloatArray:
        """Currents (n_phases, n) next to one of all phases (n,) [A]."""
        start = np.tile(i, self.n_phases)
        i_unit = float(i.max())
        if i_unit == 0:
            return start.reshape(self.n_phases, -1)
        wanted = np.tile(self._mean.waveforms(i)[2], self.n_phases)
        n, size = len(i), start.size
        found = self._solver(
            x0=np.append(start / i_unit, np.zeros(n)),
            p=np.concatenate([start / i_unit, wanted, [i_unit]]),
            lbx=np.append(np.zeros(size), np.full(n, -np.inf)),
            ubx=np.append(np.full(size, self.i_max / i_unit), np.full(n, np.inf)),
            lbg=np.append(np.full(size, -1.0), np.zeros(n)),
            ubg=np.append(np.ones(size), np.zeros(n)),
        )
        if not self._solver.stats()["success"]:
            raise Unsolved(f"no currents of each phase found at {wanted.mean():.4g} N m")
        return i_unit * np.asarray(found["x"].full())[:size].reshape(self.n_phases, -1)
