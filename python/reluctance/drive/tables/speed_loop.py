"""The speed loop by rule: observer of speed and load torque, gain, and ramp of the reference.

What the loop cannot act on sooner adds up to one lag T_sum: half a control period of sample and
hold, the delay of the orders, half the time that the torque takes to build up, and the observer's
lag on a counted angle. The symmetrical optimum gives the proportional gain K_p = J/(2 T_sum) for an
inertia behind it. C. Kessler, "Das symmetrische Optimum", Regelungstechnik 6, 1958, no. 11, 12.

The load torque comes from the observer in place of an integral (angle_tracker.hpp).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reluctance import _core
from reluctance.drive.tables.known import Known

RAMP_PART = 0.95  # of tau_max: the rest holds the speed on the ramp
QUIET = 6.0  # large over small bandwidth of the observer
AT_ONCE = 1.5  # bandwidth times the time of a step; at 2 the loop swings at 10 samples a step time
PV_BANDWIDTH_Hz = 20.0  # of the speed loop on an array: a faster one would fight the voltage loop
TRACKER_BANDWIDTH_Hz = 80.0  # of an observer that is told no torque
UNLIMITED = 1e30  # rate of the reference [rad/s^2]


def torque_time(known: Known) -> float:
    """Time in which the dc-link voltage builds up the flux linkage of the greatest torque [s].

    A phase at constant current gives the work tau_max (2 pi)/(n_phases N_r) in a stroke: the
    difference of its co-energies, aligned and unaligned. What must change then is the difference of
    the flux linkages.
    """
    work = known.tau_max * 2 * np.pi / (known.n_phases * known.N_r)
    i = np.linspace(0.0, known.i_max, 301)
    aligned = np.asarray(_core.magnetics(known.magnetics, i, np.full_like(i, np.pi)))
    unaligned = np.asarray(_core.magnetics(known.magnetics, i, np.zeros_like(i)))
    psi, W_c = (aligned - unaligned)[:, :2].T
    return float(np.interp(work, W_c, psi)) / known.u_dc


def torque_lag(known: Known) -> float:
    """Mean time from a sample to the torque that it leads to [s]."""
    return known.T_s * (0.5 + known.delay) + torque_time(known) / 2


def step_time(known: Known) -> float:
    """Time in which tau_max turns the rotor by a step of the angle: sooner no torque shows [s]."""
    return float(np.sqrt(2 * known.angle_step * known.J / known.tau_max))


@dataclass(frozen=True)
class Observer:
    """Bandwidths of the observer: of what half a step of the angle explains, and of the rest."""

    within: float  # [rad/s]
    beyond: float  # [rad/s]
    with_load: bool = True  # False: of angle and speed alone

    def core(self, known: Known) -> _core.AngleTracker:
        """The core's part."""
        return _core.AngleTracker(
            T_s=known.T_s,
            half_step=known.N_r * known.angle_step / 2,
            acceleration=known.N_r / known.J if self.with_load else 0.0,
            within=self._gains(self.within, known),
            beyond=self._gains(self.beyond, known),
            N_r=known.N_r,
        )

    def _gains(self, bandwidth: float, known: Known) -> _core.TrackerGains:
        """All poles at one place, r: a wrong estimate is forgotten without swinging."""
        r, T_s = float(np.exp(-bandwidth * known.T_s)), known.T_s
        if not self.with_load:
            return _core.TrackerGains(angle=1 - r**2, speed=(1 - r) ** 2 / T_s, load=0.0)
        return _core.TrackerGains(
            angle=1 - r**3,
            speed=1.5 * (1 - r) ** 2 * (1 + r) / T_s,
            load=known.J / known.N_r * (1 - r) ** 3 / T_s**2,
        )


def observer(known: Known) -> Observer:
    """The observer of a speed loop, or of a counted angle.

    Its bandwidth is the inverse of the time that the torque takes to follow, or a counted angle
    to show a torque, whichever is longer.
    """
    given = known.tracker_bandwidth
    if known.reference != "speed":
        bandwidth = 2 * np.pi * TRACKER_BANDWIDTH_Hz if given is None else given
        return Observer(bandwidth, bandwidth, with_load=False)
    if given is not None:
        return Observer(given, given)
    bandwidth = 1 / max(torque_lag(known), step_time(known) / AT_ONCE)
    return Observer(bandwidth / QUIET if known.angle_step > 0 else bandwidth, bandwidth)


def proportional_gain(known: Known) -> float:
    """By the symmetrical optimum [N m s/rad]."""
    given = known.tracker_bandwidth
    seen = step_time(known) if given is None or known.angle_step == 0 else 1 / given
    return known.J / (2 * (torque_lag(known) + seen))


def ramp(known: Known, *, rate: float | None, torque_limited: bool) -> _core.SpeedRamp:
    """The core's part that moves the speed reference.

    Parameters
    ----------
    rate : float or None
        Greatest rate that the drive file gives [rad/s^2].
    torque_limited : bool
        False: without a rate the reference is used as it is.
    """
    moves = torque_limited or rate is not None
    return _core.SpeedRamp(
        J=known.J,
        tau=RAMP_PART * known.tau_max if moves else 0.0,
        rate=UNLIMITED if rate is None else rate,
        T_s=known.T_s,
    )
