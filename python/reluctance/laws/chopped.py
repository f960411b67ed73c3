"""Pulses whose current a comparator chops: their mean torque at one speed, offline.

Where a pulse has one or two choppings, as at high speed, its mean is not that of the flat top: the
current overshoots or never comes back. The comparator is the one of
include/srm/control/frame/comparator.hpp; a threshold is met within the step that crosses it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from reluctance import _core
from reluctance.drive.operating_point import OperatingPoint
from reluctance.laws.current_table import Windows
from reluctance.laws.flat_top import SETTLED, STEPS, TURNS, heun, slope

FloatArray = NDArray[np.float64]

FINER = 4  # steps to one of the flat top: its saw teeth are to be met to 0.5 %


@dataclass(frozen=True)
class Band:
    """Comparators about references [A]."""

    i_ref: FloatArray
    half: float  # width [A]
    hard: NDArray[np.bool_]  # above the band: demagnetize instead of freewheel

    @property
    def low(self) -> FloatArray:
        """Below it the leg magnetizes [A]."""
        return self.i_ref - np.minimum(self.half, self.i_ref / 2)

    @property
    def high(self) -> FloatArray:
        """Above it the leg chops [A]."""
        return self.i_ref + np.minimum(self.half, self.i_ref / 2)

    def crossed(self, i: FloatArray, leg: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The threshold that was crossed before a current i [A], NaN where none was, and the leg
        from there on: 1 magnetize, 0 freewheel, -1 demagnetize."""
        away = 2 * self.high - self.i_ref
        which = [
            (leg == 1) & (i > self.high),
            (leg < 1) & (i < self.low),
            (leg == 0) & (i > away),
            (leg == -1) & (i <= self.i_ref) & ~self.hard,
        ]
        chosen = np.select(which, [np.where(self.hard, -1.0, 0.0), 1.0, -1.0, 0.0], leg)
        return np.select(which, [self.high, self.low, away, self.i_ref], np.nan), chosen


@lru_cache(maxsize=32)
def chopped(windows: Windows, half: float, hard: bool) -> FloatArray | None:
    """Mean torque of all phases [N m] for the pulses of two windows; braking chops hard. See
    `chopped_pulses`."""
    on, off, i_ref = windows.pulses
    return chopped_pulses(windows.point, on, off, i_ref, half, np.array([[hard], [True]]))


def chopped_pulses(
    point: OperatingPoint,
    theta_on: FloatArray,
    theta_off: FloatArray,
    i_ref: FloatArray,
    half: float,
    hard: NDArray[np.bool_],
) -> FloatArray | None:
    """Mean torque of all phases [N m] for pulses of one shape of arrays [rad, A], in a band of some
    half width [A]. None where a step crosses the band, at low speed: there the mean of the saw
    teeth is the reference. A current that does not return to zero can have one chopping fewer every
    second period: the mean is that of two."""
    shape = i_ref.shape
    theta_on, theta_off, i_ref = theta_on.ravel(), theta_off.ravel(), i_ref.ravel()
    band = Band(i_ref, half, np.broadcast_to(hard, shape).ravel())
    middle = _core.magnetics(point.magnetics, np.array([point.i_max]), np.array([np.pi / 2]))
    crossing = 2 * half * float(middle[0, 0]) / point.i_max / point.u_dc  # of the band [s]
    steps = FINER * STEPS
    turn = 2 * np.pi / steps
    dt = turn / (point.N_r * point.omega_m)
    if crossing < dt:
        return None
    i, means = np.zeros_like(i_ref), []
    for _ in range(TURNS):
        start, tau, leg = i, np.zeros_like(i), np.ones_like(i)
        for step in range(steps):
            theta = theta_on + step * turn
            magnetized = np.clip((theta_off - theta_on) / turn - step, 0, 1)  # part of the step
            u = point.u_dc * (magnetized * (leg + 1) - 1)
            here = _core.magnetics(point.magnetics, i, theta)
            tau += here[:, 2]
            before = i
            i, there = heun(point, here, i, u, theta + turn, dt)
            edge, chosen = band.crossed(i, leg)
            turned = np.isfinite(edge) & (magnetized == 1)
            if not turned.any():
                continue
            rest = np.clip((i - edge) / np.where(i == before, 1, i - before), 0, 1)  # of the step
            after = edge + rest * dt * slope(point, there, edge, point.u_dc * chosen)
            after = np.clip(after, band.low, np.maximum(band.high, edge))  # it may turn again
            i, leg = np.where(turned, after, i), np.where(turned, chosen, leg)
        means.append(point.n_phases * tau / steps)
        if np.all(np.abs(i - start) <= SETTLED * point.i_max):
            break
    mean = means[-1] if len(means) < TURNS else (means[-2] + means[-1]) / 2
    return np.asarray(mean.reshape(shape))
