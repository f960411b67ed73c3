"""Flat-top current pulses at one speed: the mean torque and the copper of fixed angles, offline.

One phase is integrated over an electrical period from turn-on: +u_dc until the current meets its
reference, held there as far as +-u_dc can, -u_dc from turn-off on. Neither ripple of the current
band nor sampling is in it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from reluctance import _core
from reluctance.drive.operating_point import OperatingPoint

FloatArray = NDArray[np.float64]

STEPS = 360  # of an electrical period; halving them moves the mean torque by less than 0.5 %
TURNS = 12  # at most, until a current that does not return to zero repeats itself ...
SETTLED = 1e-3  # ... to this part of i_max
WIDE = 180.0  # dwell up to which every current returns to zero [deg]
WIDEST = 255.0  # dwell that is tried where none of those gives the torque [deg]
CURRENTS = 16  # that a window is tried with
ROOM = 1.1  # over the torque: what a window has to reach, for what the flat top leaves out


@dataclass(frozen=True)
class FlatTop:
    """Means over an electrical period, of the shape that the arguments broadcast to."""

    tau: FloatArray  # of all phases [N m]
    i_rms: FloatArray  # of one phase [A]


def flat_top(
    point: OperatingPoint,
    theta_on: ArrayLike,
    theta_off: ArrayLike,
    i_ref: ArrayLike,
    *,
    steps: int = STEPS,
) -> FlatTop:
    """Mean torque and rms current of pulses from theta_on to theta_off (electrical) [rad, A].

    Motion is forward: pulses before alignment, at pi, motor, pulses after it brake.
    """
    theta_on, theta_off, i_ref = np.broadcast_arrays(
        *(np.asarray(v, float) for v in (theta_on, theta_off, i_ref))
    )
    shape = i_ref.shape
    on, dwell, top = theta_on.ravel(), (theta_off - theta_on).ravel(), i_ref.ravel()
    turn = 2 * np.pi / steps
    dt = turn / (point.N_r * point.omega_m)
    i = np.zeros_like(on)
    for _ in range(TURNS):
        start = i
        tau, squared = np.zeros_like(on), np.zeros_like(on)
        for step in range(steps):
            magnetized = np.clip(dwell / turn - step, 0, 1)  # part of the step
            u = point.u_dc * (2 * magnetized - 1)
            here = _core.magnetics(point.magnetics, i, on + step * turn)
            tau += here[:, 2]
            squared += i**2
            falling = slope(point, here, i, -point.u_dc)
            most = np.maximum(top, i + dt * falling)  # the EMF may raise it
            i, _ = heun(point, here, i, u, on + (step + 1) * turn, dt, most=most)
        if np.all(np.abs(i - start) <= SETTLED * point.i_max):
            break
    return FlatTop(
        tau=(point.n_phases * tau / steps).reshape(shape),
        i_rms=np.sqrt(squared / steps).reshape(shape),
    )


def heun(
    point: OperatingPoint,
    here: FloatArray,
    i: FloatArray,
    u: FloatArray | float,
    theta_end: FloatArray,
    dt: FloatArray | float,
    *,
    most: FloatArray | float = np.inf,
    omega_m: FloatArray | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Phase currents a step later, by Heun's rule, and the magnetics at their prediction.

    Parameters
    ----------
    here : ndarray, shape (n, 5)
        Magnetics at the start, as of `_core.magnetics`.
    i, u : ndarray, shape (n,)
        Currents [A] and winding voltages [V] there.
    theta_end : ndarray, shape (n,)
        Electrical angles at the end [rad].
    dt : float or ndarray
        Length of the step [s].
    most : float or ndarray
        No current is above it [A].
    omega_m : ndarray, optional
        Speeds; by default the point's [rad/s].
    """
    rate = slope(point, here, i, u, omega_m)
    ahead = np.minimum(np.maximum(i + dt * rate, 0), most)  # np.clip takes three times as long
    there = _core.magnetics(point.magnetics, ahead, theta_end)
    after = i + dt * (rate + slope(point, there, ahead, u, omega_m)) / 2
    return np.minimum(np.maximum(after, 0), most), there


def slope(
    point: OperatingPoint,
    at: FloatArray,
    i: FloatArray,
    u: FloatArray | float,
    omega_m: FloatArray | None = None,
) -> FloatArray:
    """di/dt = (u - R i - omega dpsi/dtheta)/(dpsi/di) [A/s], by default at the point's speed."""
    omega = point.omega_m if omega_m is None else omega_m
    return np.asarray((u - point.R * i - omega * at[:, 4]) / at[:, 3])


def least_copper_angles(
    point: OperatingPoint, tau: float, room: float = ROOM
) -> tuple[float, float]:
    """The turn-on and turn-off angle that give a mean torque for the least rms current.

    Searched in steps of 15 deg among windows of at least a stroke, so that every rotor angle is
    covered, and in steps of 5 deg around the best of them. Where the best of half a period leaves
    no room above the torque, wider ones are tried, whose current need not return to zero. Where
    none reaches the torque, those of the greatest torque. A negative torque brakes in forward
    motion.

    Returns
    -------
    theta_on, theta_off : float
        Electrical [rad].
    """
    aside = 180 if tau < 0 else 0
    coarse = np.arange(-60.0, 181.0, 15.0) + aside
    near = np.arange(-10.0, 11.0, 5.0)
    widest, (on, off, found) = WIDE, _best_window(point, tau, room, coarse, coarse, WIDE)
    if not found:
        early, late = np.arange(-120.0, 91.0, 15.0) + aside, np.arange(90.0, 241.0, 15.0) + aside
        widest, (on, off, _) = WIDEST, _best_window(point, tau, room, early, late, WIDEST)
    on, off, _ = _best_window(point, tau, room, on + near, off + near, widest, steps=STEPS)
    return float(np.radians(on)), float(np.radians(off))


def _best_window(
    point: OperatingPoint,
    tau: float,
    room: float,
    on: FloatArray,
    off: FloatArray,
    widest: float,
    *,
    steps: int = STEPS // 3,
) -> tuple[float, float, bool]:
    """The best pair of some angles [deg], and whether it has room above the torque."""
    sign = -1 if tau < 0 else 1
    tried = _windows(point, tuple(on.tolist()), tuple(off.tolist()), widest, tau < 0, steps)
    most = (sign * tried.pulses.tau).max(axis=1)
    enough = most >= room * abs(tau)
    i_rms = [
        np.interp(abs(tau), np.maximum.accumulate(sign * t), rms, left=rms[0])
        for t, rms in zip(tried.pulses.tau, tried.pulses.i_rms, strict=True)
    ]
    best = np.argmin(np.where(enough, i_rms, np.inf)) if enough.any() else np.argmax(most)
    return float(tried.on[best]), float(tried.off[best]), bool(enough[best])


@dataclass(frozen=True)
class _Windows:
    """Windows that were tried [deg], and the pulses of each with CURRENTS currents."""

    on: FloatArray
    off: FloatArray
    pulses: FlatTop


@lru_cache(maxsize=16)  # the same ones serve for any torque and room
def _windows(
    point: OperatingPoint,
    on_deg: tuple[float, ...],
    off_deg: tuple[float, ...],
    widest: float,
    brakes: bool,
    steps: int,
) -> _Windows:
    """The valid windows among these angles, with their pulses."""
    on, off = (pair.ravel() for pair in np.meshgrid(on_deg, off_deg))
    middle = 270 if brakes else 90
    fits = (on <= middle) & (off >= middle)
    fits &= (off - on >= 360 / point.n_phases) & (off - on <= widest)
    on, off = on[fits], off[fits]
    i = point.i_max * np.linspace(0, 1, CURRENTS + 1)[1:] ** 1.5
    ends = np.radians(on)[:, None], np.radians(off)[:, None]
    return _Windows(on, off, flat_top(point, *ends, i[None, :], steps=steps))
