"""The system at one angle of the rotor: meshes, air gap, coils and the linear part of its matrix.

The columns of both meshes stand close at the corners of both sides, so that they move with the
angle. Their number and the neighbours of each node do not.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from scipy.constants import mu_0

from reluctance.machine.geometry.air_gap import AirGap, air_gap
from reluctance.machine.geometry.elements import Elements, elements
from reluctance.machine.geometry.mesh import COIL, Mesh
from reluctance.machine.geometry.steel import Array
from reluctance.machine.geometry.system import System


@dataclass(frozen=True)
class Side:
    """Mesh of stator or rotor."""

    mesh: Mesh
    elements: Elements


@dataclass(frozen=True)
class Position:
    """The system at one rotor angle."""

    system: System
    alpha: float  # rotor angle from aligned poles 0 [rad]
    rotor: Side
    stator: Side
    gap: AirGap
    gradient: Array  # (n_iron, 6, 6) of the elements of steel: rows are Gauss point and direction
    weight: Array  # (n_iron, 3) [m^2]
    linear: Array  # non-zeros of K(alpha): slots and air gap
    slope: Array  # (n_ring_r, n_ring_s) of the coupling over the gap [per rad]
    coils: Array  # (n, n_phases): C [1]
    coil_area: float  # of one coil side [m^2]

    @cached_property
    def matrix(self) -> sp.csc_matrix:
        """K(alpha)."""
        return self.system.sparsity.matrix(self.linear)


def at_angle(system: System, alpha: float) -> Position:
    """The system with the rotor turned by alpha from where poles 0 are aligned [rad]."""
    section, place, total = system.section, system.place, system.sparsity.sum
    rotor, stator = (Side(mesh, elements(mesh)) for mesh in system.meshes(alpha))
    gap = air_gap(rotor.mesh, stator.mesh, section.r_rotor, section.r_ring_s, odd=system.odd)
    gradient = np.concatenate([rotor.elements.gradient, stator.elements.gradient])
    weight = np.concatenate([rotor.elements.weight, stator.elements.weight])
    iron = system.is_steel
    air = gradient[~iron] * np.sqrt(weight[~iron] / mu_0)[:, :, None, None]
    air = air.reshape(-1, 6, 6)
    linear = total(place.air, air.transpose(0, 2, 1) @ air)
    coupling = gap.coupling(alpha)
    for where, block in (
        *zip(place.rings, gap.stiffness(), strict=True),
        *((where, coupling) for where in place.gap),
    ):
        linear += total(where, block)
    coils, coil_area = _coils(system, stator)
    return Position(
        system=system,
        alpha=alpha,
        rotor=rotor,
        stator=stator,
        gap=gap,
        gradient=gradient[iron].reshape(-1, 6, 6),
        weight=weight[iron],
        linear=linear,
        slope=gap.coupling_slope(alpha),
        coils=coils,
        coil_area=coil_area,
    )


def _coils(system: System, stator: Side) -> tuple[Array, float]:
    """C with psi = C' A per length of one sector, and the area of a coil side.

    A uniform current density in each coil side: +1 after the pole, -1 before it. Of pole 0 the side
    before it lies at the end of the sector, where the potential has the other sign if odd.
    """
    section, winding, odd = system.section, system.winding, system.odd
    mesh, of = stator.mesh, stator.elements
    n_poles = section.N_s // (section.n_sectors if odd else 1)
    pitch = 2 * np.pi / section.N_s
    coils = np.zeros((system.n + 1, winding.n_phases))
    areas = []
    for k in range(n_poles):
        for before in (0, 1):
            here = mesh.region == COIL + 2 * k + before
            inside = np.ones_like(of.weight[here])
            if winding.coil is not None:
                middle = (n_poles if before and k == 0 else k) * pitch
                along = of.r[here] * np.cos(of.theta[here] - middle)
                across = np.abs(of.r[here] * np.sin(of.theta[here] - middle))
                inside = winding.coil.covers(along, across)
            weight = of.weight[here] * inside
            areas.append(float(weight.sum()))
            wrapped = odd and before and k == 0
            sign = winding.polarity[k] * (-1 if before else 1) * (-1 if wrapped else 1)
            density = sign * winding.turns_of_flux / areas[-1]
            load = density * np.einsum("eqi,eq->ei", of.shape[here], weight)
            phase = coils[:, k % winding.n_phases]
            np.add.at(phase, system.stator.of_elements[here], load)
    coil = winding.coil
    # The edges of a stated coil cut through elements: the sum over their points is only for the
    # density, which then has all ampere-turns.
    return coils[:-1], float(np.mean(areas)) if coil is None else coil.width * coil.height
