"""Maxwell stress in the air gap: radial force on a stator pole, its spatial orders, and torque.

    sigma_r = (B_r^2 - B_theta^2)/(2 mu_0),    sigma_theta = B_r B_theta/mu_0

The torque of sigma_theta is the same at every radius of the gap, and that of the energy.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.constants import mu_0

from reluctance.machine.geometry.air_gap import Complex
from reluctance.machine.geometry.solve import Field
from reluctance.machine.geometry.steel import Array

N_POINTS = 2048  # along the gap of one sector: six a wave of the highest order of a gap of r/120


@dataclass(frozen=True)
class Stress:
    """On a circle in the gap, over one sector; it repeats from sector to sector."""

    theta: Array  # (N_POINTS) [rad]
    radial: Array  # [Pa]
    tangential: Array  # [Pa]
    r: float  # [m]
    length: float  # stack length [m]
    n_sectors: int  # that the machine has

    @property
    def torque(self) -> float:
        """Of the whole machine [N m]."""
        return float(2 * np.pi * self.r**2 * self.length * self.tangential.mean())

    def pole_force(self, k: int, n_poles: int) -> float:
        """Radial force on stator pole k of n_poles, out of the gap [N]: of the stress on its pole
        pitch, along the middle of the pole."""
        sector = 2 * np.pi / self.n_sectors
        away = np.angle(np.exp(1j * (self.theta - 2 * np.pi * k / n_poles) * self.n_sectors))
        angle = away / self.n_sectors
        on = np.abs(angle) < np.pi / n_poles
        along = self.radial * np.cos(angle) - self.tangential * np.sin(angle)
        return float(along[on].sum() * sector / N_POINTS * self.r * self.length)

    def orders(self, n: int) -> tuple[Array, Array]:
        """The first n spatial orders of the radial stress, and their amplitudes [Pa]."""
        amplitudes = np.abs(np.fft.rfft(self.radial)[:n]) / N_POINTS
        amplitudes[1:] *= 2
        return np.arange(n, dtype=np.float64) * self.n_sectors, amplitudes


def _along(theta: Array, orders: Array, B: Complex) -> Array:
    """Re sum_n B_n exp(j n theta) at the middles of equal intervals, by FFT: the orders are equally
    spaced, and their spacing has one period over the sector."""
    shifted = B * np.exp(1j * np.pi * np.arange(len(orders)) / N_POINTS)
    wave = N_POINTS * np.fft.ifft(shifted, N_POINTS)
    return np.asarray((wave * np.exp(1j * orders[0] * theta)).real)


def stress(field: Field, *, at: float = 0.5) -> Stress:
    """The stress at a share `at` of the way from rotor to stator."""
    system = field.position.system
    gap = field.position.gap
    r = gap.r_rotor + at * (gap.r_stator - gap.r_rotor)
    B_r, B_theta = gap.field(*field.rings, field.position.alpha, r)
    theta = (np.arange(N_POINTS) + 0.5) * gap.sector / N_POINTS
    radial, tangential = (_along(theta, gap.orders, B) for B in (B_r, B_theta))
    n_sectors = round(2 * np.pi / gap.sector)
    return Stress(
        theta=theta,
        radial=(radial**2 - tangential**2) / (2 * mu_0),
        tangential=radial * tangential / mu_0,
        r=r,
        length=system.length / n_sectors,
        n_sectors=n_sectors,
    )
