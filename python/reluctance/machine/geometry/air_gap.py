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

# Highest order, of r/g. Order n decays over the gap as exp(-n g/r): exp(-3) is 5 % of a component
# that a pole corner excites at 1/n of the first one.
ORDERS_PER_GAP = 3.0


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
        """Second derivatives of the energy on the rotor's and on the stator's side; of no angle."""
        own = self._own
        rotor = (self.from_rotor.conj().T * own) @ self.from_rotor
        stator = (self.from_stator.conj().T * own) @ self.from_stator
        return rotor.real, stator.real

    def coupling(self, alpha: float) -> tuple[Array, Array]:
        """Mixed second derivatives (rotor, stator) at a rotor angle [rad], and their slope."""
        turned = (self.from_rotor * np.exp(-1j * self.orders * alpha)[:, None]).conj().T
        value = -(turned * self._mutual) @ self.from_stator
        slope = -(turned * (1j * self.orders * self._mutual)) @ self.from_stator
        return value.real, slope.real

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


def air_gap(rotor: Mesh, stator: Mesh, r_rotor: float, r_stator: float, *, odd: bool) -> AirGap:
    """The gap between two meshes of one sector."""
    sector = float(stator.ring_theta[-1] - stator.ring_theta[0])
    highest = ORDERS_PER_GAP * r_rotor / (r_stator - r_rotor)
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
    """a_n = 2/sector int A exp(-j n theta) dtheta of the unknowns on a ring, by Gauss points."""
    corners = mesh.ring_theta
    h = np.diff(corners)
    x, weight = np.polynomial.legendre.leggauss(12 + int(0.6 * orders[-1] * h.max()))
    x, weight = (x + 1) / 2, weight / 2
    shape = np.stack([(1 - x) * (1 - 2 * x), 4 * x * (1 - x), x * (2 * x - 1)])  # (3, n_gauss)
    theta = corners[:-1, None] + h[:, None] * x
    wave = np.exp(-1j * orders[:, None, None] * theta) * (weight * h[:, None])
    per_edge = wave @ shape.T  # (n_orders, n_edges, 3)
    values = np.zeros((len(orders), 2 * len(h)), dtype=np.complex128)
    values[:, ::2] = per_edge[:, :, 0]
    values[:, 1::2] = per_edge[:, :, 1]
    values[:, 2::2] += per_edge[:, :-1, 2]
    values[:, 0] += (-1 if odd else 1) * per_edge[:, -1, 2]
    return values * 2 / sector
