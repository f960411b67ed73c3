"""The fastest torque step of any controller, at every rotor angle, of phases that do not couple.

On a stiff dc link such phases do not act on one another. The current of a phase obeys a scalar
differential equation, in which more voltage never means less current later; so full voltage, held
at i_max where it gets there, leads to the greatest current that can be reached at each instant, and
the opposite voltage to the least. At an angle torque rises or falls with the current throughout. So
the torque of a phase lies between those of its least and greatest current, the sum of the better
ones bounds the torque at an instant, and the first instant at which it suffices bounds every
controller. It is reached where one choice of voltages serves until then.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reluctance import _core
from reluctance.base.arrays import FloatArray
from reluctance.base.errors import ParameterError, need
from reluctance.machine.operating_point import OperatingPoint
from reluctance.machine.optimum.profile import Profile

TAU, L_INC, PSI_THETA = 2, 3, 4  # columns of `_core.magnetics`
N_ANGLES = 60  # of an electrical period
LONGEST = 0.02  # time looked at, where none is given [s]
DT = 2e-6  # of the integration [s]: 1 us moves the times of the tests by less than 0.2 us


@dataclass(frozen=True)
class TorqueStep:
    """Least time from a change of the reference to most of the change of the torque."""

    theta_e: FloatArray  # (n_angles,) of phase 0 at the change [rad]
    time: FloatArray  # (n_angles,) infinite where it is longer than asked for [s]
    share: float  # of the change [1]

    @property
    def mean(self) -> float:
        """Over the angles [s]."""
        return float(self.time.mean())

    @property
    def longest(self) -> float:
        """At the worst angle [s]."""
        return float(self.time.max())


def fastest_torque_step(
    point: OperatingPoint,
    tau_ref: float,
    *,
    start: Profile | None = None,
    share: float = 0.95,
    n_angles: int = N_ANGLES,
    t_end: float = LONGEST,
) -> TorqueStep:
    """The least time to a torque of tau_ref at held speed.

    Parameters
    ----------
    point : machine, voltage, current limit and speed; 0 is standstill.
    tau_ref : torque after the change [N m]; of either sign, not that of `start`.
    start : currents before the change; by default none.
    share : of the change that counts as done [1].
    n_angles : rotor angles at which the reference changes, over one electrical period.
    t_end : longest time looked at [s].

    Raises
    ------
    ParameterError : a parameter out of range, or phases that couple.
    """
    if point.coupling is not None:
        raise ParameterError(
            "no least time of a torque step is known where phases couple; leave the coupling of "
            "the operating point out for that of phases alone"
        )
    tau_from = 0.0 if start is None else start.tau_ref
    need(tau_ref != tau_from, "tau_ref", tau_ref, "another torque than that of `start`")
    need(0 < share <= 1, "share", share, "a share in (0, 1]")
    need(n_angles >= 1, "n_angles", n_angles, "at least 1 angle")

    theta_0 = 2 * np.pi * np.arange(n_angles) / n_angles
    n_phases, R, i_max, u_dc = point.n_phases, point.R, point.i_max, point.u_dc
    omega_m = point.omega_m
    lag = 2 * np.pi * np.arange(n_phases) / n_phases
    phase_0 = theta_0[:, None] - lag  # (n_angles, n_phases)
    omega_e = point.N_r * omega_m
    rising = tau_ref > tau_from
    goal = tau_from + share * (tau_ref - tau_from)

    def at(i: FloatArray, t: float) -> FloatArray:
        angle = np.mod(phase_0 + omega_e * t, 2 * np.pi)
        found = _core.magnetics(point.magnetics, i.ravel(), angle.ravel())
        return np.asarray(found).reshape(*i.shape, -1)

    def moved(i: FloatArray, t: float, u: float) -> FloatArray:
        """Heun's step at full voltage; the diodes block at zero, the limit holds at i_max."""

        def slope(i: FloatArray, t: float) -> FloatArray:
            m = at(i, t)
            return np.asarray((u - R * i - omega_m * m[..., PSI_THETA]) / m[..., L_INC])

        first = slope(i, t)
        second = slope(np.clip(i + DT * first, 0, i_max), t + DT)
        ahead = np.clip(i + DT * (first + second) / 2, 0, i_max)
        return ahead if u > 0 else np.where(i > 0, ahead, 0.0)

    most = np.zeros((n_angles, n_phases))
    if start is not None:
        turn = np.append(start.theta_e, 2 * np.pi)
        wrapped = np.mod(phase_0, 2 * np.pi)
        most = np.interp(wrapped, turn, np.append(start.i, start.i[0]))
    least = most
    time = np.full(n_angles, np.inf)
    before: FloatArray | None = None
    for n in range(int(np.ceil(t_end / DT)) + 1):
        t = n * DT
        both = np.stack([at(most, t)[..., TAU], at(least, t)[..., TAU]])
        tau = (both.max(axis=0) if rising else both.min(axis=0)).sum(axis=1)
        missing = (goal - tau) if rising else (tau - goal)
        met = (missing <= 0) & np.isinf(time)
        time[met] = t  # and between two instants by a straight line
        if before is not None:
            time[met] += DT * missing[met] / (before - missing)[met]
        if np.isfinite(time).all():
            break
        before = missing
        most, least = moved(most, t, u_dc), moved(least, t, -u_dc)
    return TorqueStep(theta_e=theta_0, time=time, share=share)
