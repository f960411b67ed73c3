"""The discrete field problem of a machine: everything that no current and no angle changes.

The unknowns A are values of the vector potential [Wb/m]. One energy holds all physics,

    E(A, alpha) = 1/2 A' K(alpha) A + sum over steel of w(|B|) dS,

K with slots and air gap, and the co-energy of a stack of length l with p sectors is

    W_c(alpha, i) = p l max_A [i' C' A - E(A, alpha)].

psi = p l C' A and tau = -p l dE/dalpha at constant A are then exact derivatives of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.constants import mu_0

from reluctance.machine.geometry.air_gap import AirGap, air_gap
from reluctance.machine.geometry.cross_section import CrossSection, rotor_mesh, stator_mesh
from reluctance.machine.geometry.elements import Elements, elements
from reluctance.machine.geometry.mesh import COIL, STEEL, Grid, Integers, Mesh
from reluctance.machine.geometry.sparsity import Sparsity, elimination_order, pairs, sparsity
from reluctance.machine.geometry.steel import Array, Steel
from reluctance.machine.geometry.winding import Winding


@dataclass(frozen=True)
class Side:
    """Stator or rotor: its mesh, and the unknown of each node (n where A = 0)."""

    mesh: Mesh
    elements: Elements
    unknown: Integers  # (n_rows, n_columns)

    @property
    def ring(self) -> Integers:
        """Unknowns on the gap."""
        return self.unknown[self.mesh.gap_row, :-1]

    @property
    def of_elements(self) -> Integers:
        """Unknowns of the elements, (n_e, 6)."""
        return np.asarray(self.unknown.ravel()[self.mesh.elements])


@dataclass(frozen=True)
class Iron:
    """The elements of steel, of both sides."""

    unknown: Integers  # (n_e, 6)
    gradient: Array  # (n_e, 6, 6): rows are Gauss point and direction
    weight: Array  # (n_e, 3) [m^2]
    place: Integers  # (36 n_e) of the elements' matrices in the whole one


@dataclass(frozen=True)
class System:
    """Matrices and numbering. Unknowns are numbered in the order in which they are eliminated."""

    section: CrossSection
    steel: Steel
    winding: Winding
    rotor: Side
    stator: Side
    gap: AirGap
    iron: Iron
    sparsity: Sparsity
    linear: Array  # non-zeros from slots and from both edges of the gap
    place_gap: tuple[Integers, Integers]  # of the coupling over the gap, and of its transpose
    coils: Array  # (n, n_phases): C [1]
    coil_area: float  # of one coil side [m^2]
    length: float  # stack length times number of sectors [m]

    @property
    def n(self) -> int:
        """Number of unknowns."""
        return self.sparsity.n


def assemble(
    section: CrossSection, steel: Steel, winding: Winding, *, stack: float, grid: Grid
) -> System:
    """The field problem on one sector where the polarity of the coils reverses from each to the
    next, else on the whole machine. `stack` is the stack length [m]."""
    odd = winding.reverses(section.n_sectors)
    rotor, stator = rotor_mesh(section, grid, odd=odd), stator_mesh(section, grid, odd=odd)
    gap = air_gap(rotor, stator, section.r_rotor, section.r_ring_s, odd=odd)
    sides, pattern = _numbered(rotor, stator)
    r, s = sides

    of_elements = np.concatenate([side.of_elements for side in sides])
    gradient = np.concatenate([side.elements.gradient for side in sides])
    weight = np.concatenate([side.elements.weight for side in sides])
    steel_here = np.concatenate([side.mesh.region for side in sides]) == STEEL
    air = of_elements[~steel_here]
    scaled = gradient[~steel_here] * np.sqrt(weight[~steel_here] / mu_0)[:, :, None, None]
    flat = scaled.reshape(-1, 6, 6)
    own_r, own_s = gap.stiffness()
    linear = (
        pattern.sum(pattern.place(*pairs(air, air)), flat.transpose(0, 2, 1) @ flat)
        + pattern.sum(pattern.place(*pairs(r.ring, r.ring)), own_r)
        + pattern.sum(pattern.place(*pairs(s.ring, s.ring)), own_s)
    )
    of_iron = of_elements[steel_here]
    coils, coil_area = _coils(section, winding, s, pattern.n, odd=odd)
    return System(
        section=section,
        steel=steel,
        winding=winding,
        rotor=r,
        stator=s,
        gap=gap,
        iron=Iron(
            unknown=of_iron,
            gradient=gradient[steel_here].reshape(-1, 6, 6),
            weight=weight[steel_here],
            place=pattern.place(*pairs(of_iron, of_iron)),
        ),
        sparsity=pattern,
        linear=linear,
        place_gap=(
            pattern.place(*pairs(r.ring, s.ring)),
            pattern.place(*pairs(r.ring, s.ring)[::-1]),
        ),
        coils=coils,
        coil_area=coil_area,
        length=stack * (section.n_sectors if odd else 1),
    )


def _numbered(rotor: Mesh, stator: Mesh) -> tuple[tuple[Side, Side], Sparsity]:
    """Both sides numbered together in an order of elimination with little fill."""
    n = rotor.n_unknowns + stator.n_unknowns
    numbers = (
        np.where(rotor.unknown < 0, n, rotor.unknown),
        np.where(stator.unknown < 0, n, stator.unknown + rotor.n_unknowns),
    )
    of_elements = elements(rotor), elements(stator)

    def numbered(order: Integers) -> tuple[tuple[Side, Side], Sparsity]:
        r = Side(rotor, of_elements[0], order[numbers[0]])
        s = Side(stator, of_elements[1], order[numbers[1]])
        around = np.concatenate([r.ring, s.ring])
        return (r, s), sparsity(n, [r.of_elements, s.of_elements, around])

    _, pattern = numbered(np.arange(n + 1))
    return numbered(np.append(elimination_order(pattern), n))


def _coils(
    section: CrossSection, winding: Winding, stator: Side, n: int, *, odd: bool
) -> tuple[Array, float]:
    """C with psi = C' A per length of one sector, and the area of a coil side.

    A uniform current density in each coil side: +1 after the pole, -1 before it. Of pole 0 the side
    before it lies at the end of the sector, where the potential has the other sign if odd.
    """
    mesh, of = stator.mesh, stator.elements
    n_poles = section.N_s // (section.n_sectors if odd else 1)
    pitch = 2 * np.pi / section.N_s
    coils = np.zeros((n + 1, winding.n_phases))
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
            np.add.at(phase, stator.of_elements[here], load)
    coil = winding.coil
    # The edges of a stated coil cut through elements: the sum over their points is only for the
    # density, which then has all ampere-turns.
    return coils[:n], float(np.mean(areas)) if coil is None else coil.width * coil.height
