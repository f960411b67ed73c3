"""The air gap by Fourier series: no mesh, and rotation is a factor exp(-j n alpha).

On the strip of width l = ln(r_s/r_r) between rotor and stator, with

    A_r = Re sum_n a_n exp(j n theta),    A_s = Re sum_n b_n exp(j n theta),

the field energy per length of the machine over one sector of angle s is

    E = s/(4 mu_0) sum_n n [(|a_n|^2 + |b_n|^2) coth(n l) - 2 Re(a_n b_n*)/sinh(n l)]

a_n exp(-j n alpha) in place of a_n turns the rotor by alpha. A sector whose potential changes its
sign from one to the next has odd multiples of pi/s only.

Reference: A. Abdel-Razek et al., "Conception of an air-gap element for the dynamic analysis of the
electromagnetic field in electric machines", IEEE Trans. Magn. 18(2), 1982.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.constants import mu_0

from reluctance.machine.geometry.mesh import Mesh
from reluctance.machine.geometry.steel import Array

Complex = NDArray[np.complex128]

SMALL = 0.1  # x^2 below which a series of five terms has j_1/x to 1e-13


@dataclass(frozen=True)
class AirGap:
    """Matrices of the gap between the unknowns on both its sides."""

    orders: Array  # (n_orders)
    from_rotor: Complex  # (n_orders, n_ring_r): a_n of the unknowns
    from_stator: Complex  # (n_orders, n_ring_s)
    r_rotor: float  # [m]
    r_stator: float
    sector: float  # [rad]

    @property
    def width(self) -> float:
        """Of the strip, ln(r_s/r_r)."""
        return float(np.log(self.r_stator / self.r_rotor))

    def stiffness(self) -> tuple[Array, Array]:
        """Second derivatives of the energy on the rotor's and on the stator's side."""
        own = self._own
        return (
            _real_product(self.from_rotor, own, self.from_rotor),
            _real_product(self.from_stator, own, self.from_stator),
        )

    def coupling(self, alpha: float) -> Array:
        """Mixed second derivatives (rotor, stator) at a rotor angle [rad]."""
        turned = self.from_rotor * np.exp(-1j * self.orders * alpha)[:, None]
        return -_real_product(turned, self._mutual, self.from_stator)

    def coupling_slope(self, alpha: float) -> Array:
        """The derivative of `coupling` in the angle [per rad]."""
        turned = self.from_rotor * np.exp(-1j * self.orders * alpha)[:, None]
        return -_real_product(-1j * turned, self.orders * self._mutual, self.from_stator)

    def field(self, rotor: Array, stator: Array, alpha: float, r: float) -> tuple[Complex, Complex]:
        """Orders of B_r and B_theta at a radius in the gap [T]: B = Re sum_n B_n exp(j n theta).

        `rotor` and `stator` are the unknowns on the two rings [Wb/m].
        """
        a = self.from_rotor @ rotor * np.exp(-1j * self.orders * alpha)
        b = self.from_stator @ stator
        n = np.where(self.orders == 0, 1e-9, self.orders)
        below, above = np.log(r / self.r_rotor), np.log(self.r_stator / r)
        whole = np.sinh(n * self.width)
        potential = (a * np.sinh(n * above) + b * np.sinh(n * below)) / whole
        slope = n * (b * np.cosh(n * below) - a * np.cosh(n * above)) / whole
        return 1j * self.orders * potential / r, -slope / r

    @property
    def _own(self) -> Array:
        n = self.orders[self.orders > 0]
        return self._scale(n / np.tanh(n * self.width))

    @property
    def _mutual(self) -> Array:
        n = self.orders[self.orders > 0]
        return self._scale(n / np.sinh(n * self.width))

    def _scale(self, of_orders: Array) -> Array:
        """With the constant order where there is one: a_0 is twice the mean, so half of 1/width."""
        if self.orders[0] == 0:
            of_orders = np.append(0.5 / self.width, of_orders)
        return np.asarray(of_orders * self.sector / (2 * mu_0))


def _real_product(left: Complex, weight: Array, right: Complex) -> Array:
    """Real part of left^H diag(weight) right, without its imaginary part."""
    real = (left.real.T * weight) @ right.real
    return np.asarray(real + (left.imag.T * weight) @ right.imag)


def air_gap(rotor: Mesh, stator: Mesh, r_rotor: float, r_stator: float, *, odd: bool) -> AirGap:
    """The gap between two meshes of one sector.

    The highest order has two of the closest nodes of a ring in a period: with fewer orders a part
    of the potential that the nodes can have would have no energy in the gap.
    """
    sector = float(stator.ring_theta[-1] - stator.ring_theta[0])
    closest = min(float(np.diff(mesh.ring_theta).min()) / 2 for mesh in (rotor, stator))
    highest = np.pi / closest
    first = np.pi / sector
    orders = np.arange(first, highest, 2 * first) if odd else np.arange(0.0, highest)
    return AirGap(
        orders=orders,
        from_rotor=fourier(rotor, orders, sector, odd=odd),
        from_stator=fourier(stator, orders, sector, odd=odd),
        r_rotor=r_rotor,
        r_stator=r_stator,
        sector=sector,
    )


def fourier(mesh: Mesh, orders: Array, sector: float, *, odd: bool) -> Complex:
    """a_n = 2/sector int A exp(-j n theta) dtheta of the unknowns on a ring.

    Over an edge of half the angle d, int_-1^1 P_l(x) exp(-j n d x) dx = 2 (-j)^l j_l(n d) with the
    Legendre polynomials P_l of which the shape functions are sums, and spherical Bessel functions.
    Of these j_0 and j_1/x are enough, as j_2 = 3 j_1/x - j_0.
    """
    corners = mesh.ring_theta
    half = np.diff(corners) / 2
    x = orders[:, None] * half
    j0 = np.sinc(x / np.pi)
    square = x * x
    small = square < SMALL
    near_0 = (1 - square / 10 * (1 - square / 28 * (1 - square / 54 * (1 - square / 88)))) / 3
    j1_x = np.where(small, near_0, (j0 - np.cos(x)) / np.where(small, 1.0, square))
    turn = np.exp(-1j * orders[:, None] * (corners[:-1] + half)) * half
    end, odd_part = j0 - 2 * j1_x, 1j * x * j1_x
    values = np.zeros((len(orders), 2 * len(half)), dtype=np.complex128)
    values[:, ::2] = turn * (end + odd_part)
    values[:, 1::2] = turn * (4 * j1_x)
    last = turn * (end - odd_part)
    values[:, 2::2] += last[:, :-1]
    values[:, 0] += (-1 if odd else 1) * last[:, -1]
    return values * 2 / sector
