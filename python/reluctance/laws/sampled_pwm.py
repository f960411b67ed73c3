"""Pulses under sampled PI control and PWM: their mean torque at one speed, offline.

A current loop follows its reference late, and a window opens and closes at samples: at high speed,
where a pulse has few samples, its mean torque is not that of the flat top. The law is the one of
include/srm/control/law/pwm_current.hpp with the mean voltage of a sample for its pulses, over so
many samples that they fall on all angles.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from reluctance import _core
from reluctance.drive.operating_point import OperatingPoint
from reluctance.laws.current_table import Windows
from reluctance.laws.flat_top import heun

FloatArray = NDArray[np.float64]

SAMPLES = 600  # at least, that an average is taken over
SETTLES = 12  # periods before it, where the current does not return to zero; else one
MOST = 1500  # samples of a period: at lower speeds the loop is as good as its reference
FINEST = np.radians(1.0)  # step of the integration, electrical


@dataclass(frozen=True)
class PiLoop:
    """The current loop of a phase."""

    bandwidth: float  # [rad/s]
    T_s: float  # [s]
    delay: int  # samples from the measurement to the order


@lru_cache(maxsize=32)
def sampled(windows: Windows, loop: PiLoop) -> FloatArray | None:
    """Mean torque of all phases [N m] for the pulses of two windows; None where a period has so
    many samples that the current is as good as its reference."""
    point = windows.point
    turn = point.N_r * point.omega_m * loop.T_s
    period = 2 * np.pi / turn  # in samples
    if period > MOST:
        return None
    on, off, i_ref = windows.pulses
    pulse = _Pulse(loop, point, turn, on.ravel(), (off - on).ravel(), i_ref.ravel())
    pulse.sample(int(period))
    if pulse.i.any():
        pulse.sample(int(SETTLES * period))
    whole = period * (np.ceil(SAMPLES / period) + np.arange(10))
    nearest = whole[np.argmin(np.abs(whole - np.round(whole)))]  # to a number of samples
    torques = pulse.sample(round(float(nearest)))
    return np.asarray(point.n_phases * torques.reshape(i_ref.shape))


class _Pulse:
    """Phases of different windows and references, sample by sample from zero current."""

    def __init__(
        self,
        loop: PiLoop,
        point: OperatingPoint,
        turn: float,
        theta_on: FloatArray,
        dwell: FloatArray,
        i_ref: FloatArray,
    ) -> None:
        self.loop, self.point, self.turn = loop, point, turn  # turn: a sample's, electrical [rad]
        self.theta_on, self.dwell, self.i_ref = theta_on, dwell, i_ref
        self.i, self.u_integral, self.n = np.zeros_like(i_ref), np.zeros_like(i_ref), 0
        self.orders = [np.full_like(i_ref, -point.u_dc)] * (loop.delay + 1)  # [V]

    def sample(self, times: int) -> FloatArray:
        """The mean torque of some samples [N m]."""
        point, steps = self.point, int(np.ceil(self.turn / FINEST))
        dt, step = self.loop.T_s / steps, self.turn / steps
        tau = np.zeros_like(self.i)
        for _ in range(times):
            theta = self.theta_on + self.n * self.turn
            self.orders = [*self.orders[1:], self._order(theta)]
            u = self.orders[0]
            for part in range(steps):
                here = _core.magnetics(point.magnetics, self.i, theta + part * step)
                tau += here[:, 2]
                self.i, _ = heun(point, here, self.i, u, theta + (part + 1) * step, dt)
            self.n += 1
        return np.asarray(tau / (times * steps))

    def _order(self, theta: FloatArray) -> FloatArray:
        """The mean voltage that the law orders [V]."""
        loop, point, u_dc = self.loop, self.point, self.point.u_dc
        here = _core.magnetics(point.magnetics, self.i, theta)
        error = self.i_ref - self.i
        u = loop.bandwidth * here[:, 3] * error + point.R * self.i_ref
        u = u + point.omega_m * here[:, 4] + self.u_integral
        integrated = np.where(np.abs(u) < u_dc, loop.bandwidth * point.R * loop.T_s * error, 0)
        conducts = (self.n * self.turn) % (2 * np.pi) < self.dwell
        self.u_integral = np.where(conducts, self.u_integral + integrated, 0)
        return np.where(conducts, np.clip(u, -u_dc, u_dc), -u_dc)
