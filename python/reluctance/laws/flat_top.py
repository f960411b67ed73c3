"""Flat-top current pulses at one speed: the mean torque and the copper of fixed angles, offline.

One phase is integrated over an electrical period from turn-on: +u_dc until the current meets its
reference, held there as far as +-u_dc can or chopped in a band about it, -u_dc from turn-off on.
Sampling is not in it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from reluctance import _core
from reluctance.drive.operating_point import OperatingPoint
from reluctance.errors import ParameterError
from reluctance.units import from_si

FloatArray = NDArray[np.float64]

STEPS = 360  # of an electrical period; halving them moves the mean torque by less than 0.5 %
CHOPPED = 4  # times as many where the current is chopped: its saw teeth are to be met to 0.5 %
TABLE_POINTS = 17  # of srm::MeanTorque
TURNS = 12  # at most, until a current that does not return to zero repeats itself ...
SETTLED = 1e-3  # ... to this part of i_max
WIDE = 180.0  # dwell up to which every current returns to zero [deg]
WIDEST = 255.0  # dwell that is tried where none of those gives the torque [deg]
ROOM = 1.1  # over the torque: what a window has to reach, for losses that the pulse leaves out


@dataclass(frozen=True)
class FlatTop:
    """Means over an electrical period, of the shape that the arguments broadcast to."""

    tau: FloatArray  # of all phases [N m]
    i_rms: FloatArray  # of one phase [A]


@dataclass(frozen=True)
class Band:
    """A comparator (include/srm/control/frame/comparator.hpp)."""

    half: float  # width [A]
    hard: NDArray[np.bool_]  # above the band: demagnetize instead of freewheel; for each pulse

    def thresholds(self, i_ref: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Lower and upper one [A]."""
        half = np.minimum(self.half, i_ref / 2)
        return i_ref - half, i_ref + half

    def crossed(
        self, i: FloatArray, leg: FloatArray, i_ref: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """The threshold that was crossed before a current i [A], NaN where none was, and the leg
        from there on: 1 magnetize, 0 freewheel, -1 demagnetize."""
        low, high = self.thresholds(i_ref)
        away = 2 * high - i_ref
        which = [
            (leg == 1) & (i > high),
            (leg < 1) & (i < low),
            (leg == 0) & (i > away),
            (leg == -1) & (i <= i_ref) & ~self.hard,
        ]
        chosen = np.select(which, [np.where(self.hard, -1.0, 0.0), 1.0, -1.0, 0.0], leg)
        return np.select(which, [high, low, away, i_ref], np.nan), chosen


def flat_top(
    point: OperatingPoint,
    theta_on: ArrayLike,
    theta_off: ArrayLike,
    i_ref: ArrayLike,
    *,
    steps: int = STEPS,
    band: Band | None = None,
) -> FlatTop:
    """Mean torque and rms current of pulses from theta_on to theta_off (electrical) [rad, A].

    Motion is forward: pulses before alignment, at pi, motor, pulses after it brake. Without a band
    the current is held at its reference.
    """
    theta_on, theta_off, i_ref = np.broadcast_arrays(
        *(np.asarray(v, float) for v in (theta_on, theta_off, i_ref))
    )
    shape = i_ref.shape
    on, dwell, top = theta_on.ravel(), (theta_off - theta_on).ravel(), i_ref.ravel()
    turn = 2 * np.pi / steps
    dt = turn / (point.N_r * point.omega_m)
    i, leg = np.zeros_like(on), np.ones_like(on)
    for _ in range(TURNS):
        start = i
        tau, squared = np.zeros_like(on), np.zeros_like(on)
        leg[:] = 1
        for step in range(steps):
            magnetized = np.clip(dwell / turn - step, 0, 1)  # part of the step
            u = point.u_dc * (magnetized * (leg + 1) - 1)
            here = _core.magnetics(point.magnetics, i, on + step * turn)
            tau += here[:, 2]
            squared += i**2
            slope = _slope(point, here, i, u)
            least = i + dt * _slope(
                point, here, i, np.full_like(i, -point.u_dc)
            )  # the EMF may raise it
            most = np.maximum(top, least) if band is None else np.inf
            before = i
            ahead = np.clip(i + dt * slope, 0, most)
            there = _core.magnetics(point.magnetics, ahead, on + (step + 1) * turn)
            mean = i + dt * (slope + _slope(point, there, ahead, u)) / 2
            i = np.clip(mean, 0, most)
            if band is not None:
                at, chosen = band.crossed(i, leg, top)
                turned = (magnetized == 1) & np.isfinite(at)
                rest = np.clip((i - at) / np.where(i == before, 1, i - before), 0, 1)  # of the step
                after = at + rest * dt * _slope(point, there, at, point.u_dc * chosen)
                low, high = band.thresholds(top)  # at low speed it turns more than once
                i = np.where(turned, np.clip(after, low, np.maximum(high, at)), i)
                leg = np.where(turned, chosen, leg)
        if np.all(np.abs(i - start) <= SETTLED * point.i_max):
            break
    return FlatTop(
        tau=(point.n_phases * tau / steps).reshape(shape),
        i_rms=np.sqrt(squared / steps).reshape(shape),
    )


def _slope(point: OperatingPoint, at: FloatArray, i: FloatArray, u: FloatArray) -> FloatArray:
    """di/dt = (u - R i - omega dpsi/dtheta)/(dpsi/di) [A/s]."""
    return np.asarray((u - point.R * i - point.omega_m * at[:, 4]) / at[:, 3])


def least_copper_angles(point: OperatingPoint, tau: float) -> tuple[float, float]:
    """The turn-on and turn-off angle that give a mean torque for the least rms current.

    Searched in steps of 15 deg among windows of at least a stroke, so that every rotor angle is
    covered, and in steps of 5 deg around the best of them. Where none reaches the torque, those of
    the greatest torque. A negative torque brakes in forward motion.

    Returns
    -------
    theta_on, theta_off : float
        Electrical [rad].
    """
    coarse = np.arange(-60.0, 181.0, 15.0) + (180 if tau < 0 else 0)
    near = np.arange(-10.0, 11.0, 5.0)
    on, off, reaches = _best_window(point, ROOM * tau, coarse, coarse, WIDE, steps=STEPS // 3)
    widest = WIDE if reaches else WIDEST
    if not reaches:
        early, late = np.arange(-120.0, 91.0, 15.0), np.arange(90.0, 241.0, 15.0)
        aside = 180 if tau < 0 else 0
        on, off, _ = _best_window(
            point, ROOM * tau, early + aside, late + aside, widest, steps=STEPS // 3
        )
    on, off, _ = _best_window(point, ROOM * tau, on + near, off + near, widest, steps=STEPS)
    return float(np.radians(on)), float(np.radians(off))


def _best_window(
    point: OperatingPoint, tau: float, on: FloatArray, off: FloatArray, widest: float, *, steps: int
) -> tuple[float, float, bool]:
    """The best pair of some angles [deg], and whether it reaches the torque."""
    on, off = (pair.ravel() for pair in np.meshgrid(on, off))
    sign, middle = (-1, 270) if tau < 0 else (1, 90)
    fits = (on <= middle) & (off >= middle)
    fits &= (off - on >= 360 / point.n_phases) & (off - on <= widest)
    on, off = on[fits], off[fits]
    i = point.i_max * np.linspace(0, 1, TABLE_POINTS)[1:] ** 1.5
    ends = np.radians(on)[:, None], np.radians(off)[:, None]
    pulses = flat_top(point, *ends, i[None, :], steps=steps)
    i_rms = [
        np.interp(abs(tau), np.maximum.accumulate(sign * t), rms, left=rms[0], right=np.inf)
        for t, rms in zip(pulses.tau, pulses.i_rms, strict=True)
    ]
    most = (sign * pulses.tau).max(axis=1)
    best = np.argmin(i_rms) if np.isfinite(i_rms).any() else np.argmax(most)
    return float(on[best]), float(off[best]), bool(np.isfinite(i_rms).any())


def current_tables(
    point: OperatingPoint,
    window: tuple[float, float],
    brake: tuple[float, float],
    tau_max: float,
    *,
    tau_end: float,
    own: bool = False,
    band: float = 0.0,
    hard: bool = False,
) -> tuple[list[float], list[float]]:
    """The current references [A] for the mean torques 0..tau_end in equal steps, motoring and
    braking; past the greatest torque of the angles that of i_max. In a band of that half
    width [A] the current is chopped, hard when braking; without, it is held.

    Raises
    ------
    ParameterError
        If neither pair of angles reaches tau_max at i_max, or those of motoring are the user's own
        and do not.
    """
    i = point.i_max * np.linspace(0, 1, 8 * TABLE_POINTS) ** 1.5
    on, off = np.transpose([window, brake])[:, :, None]
    steps = CHOPPED * STEPS
    dt = 2 * np.pi / steps / (point.N_r * point.omega_m)
    middle = _core.magnetics(point.magnetics, np.array([point.i_max]), np.array([np.pi / 2]))
    crossing = 2 * band * float(middle[0, 0]) / point.i_max / point.u_dc  # of the band [s]
    chops: Band | None = Band(band, np.repeat([hard, True], len(i)))
    if dt > crossing:  # slow enough that the mean of the saw teeth is the reference; or no band
        chops, steps = None, STEPS
    tau, braking = flat_top(point, on, off, i, steps=steps, band=chops).tau
    braking = -braking
    most = tau.max() if own else max(tau.max(), braking.max())
    if most < tau_max:
        raise ParameterError(
            f"[control] angles {np.degrees(window[0]):g} to {np.degrees(window[1]):g} deg give a "
            f"mean torque of at most {most:.4g} N m at i_max_A = {point.i_max:g} and "
            f"{from_si(point.omega_m, 'rpm'):.5g} rpm, need {tau_max:g}; change the angles, the "
            "speed or the torque"
        )
    return _inverse(tau, i, tau_end), _inverse(braking, i, tau_end)


def _inverse(tau: FloatArray, i: FloatArray, tau_max: float) -> list[float]:
    """The currents over the mean torques 0..tau_max in equal steps."""
    tau = np.maximum.accumulate(tau)
    rising = np.flatnonzero(np.diff(tau, prepend=-1.0) > 0)
    wanted = np.linspace(0, tau_max, TABLE_POINTS)
    return [float(v) for v in np.interp(wanted, tau[rising], i[rising])]
