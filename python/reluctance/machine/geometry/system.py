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
from numpy.typing import NDArray

from reluctance.machine.geometry.cross_section import CrossSection, rotor_mesh, stator_mesh
from reluctance.machine.geometry.mesh import STEEL, Grid, Integers, Mesh
from reluctance.machine.geometry.sparsity import Sparsity, elimination_order, pairs, sparsity
from reluctance.machine.geometry.steel import Steel
from reluctance.machine.geometry.winding import Winding


@dataclass(frozen=True)
class Numbers:
    """The unknowns of one side, numbered in the order in which they are eliminated (n where A = 0),
    and the places of its elements and of its ring among the non-zeros."""

    unknown: Integers  # (n_rows, n_columns)
    of_elements: Integers  # (n_e, 6)
    ring: Integers  # on the gap


@dataclass(frozen=True)
class Places:
    """Of matrices among the non-zeros of the whole one."""

    air: Integers  # of the elements without steel
    steel: Integers
    rings: tuple[Integers, Integers]  # rotor, stator
    gap: tuple[Integers, Integers]  # of the coupling over the gap, and of its transpose


@dataclass(frozen=True)
class System:
    """The machine and the numbering, the same at every angle."""

    section: CrossSection
    steel: Steel
    winding: Winding
    grid: Grid
    odd: bool  # one sector, the next has the opposite sign; else the whole machine
    rotor: Numbers
    stator: Numbers
    is_steel: NDArray[np.bool_]  # (n_e) of both sides
    iron: Integers  # (n_iron, 6) unknowns of the elements of steel
    sparsity: Sparsity
    place: Places
    length: float  # stack length times number of sectors [m]

    @property
    def n(self) -> int:
        """Number of unknowns."""
        return self.sparsity.n

    def meshes(self, alpha: float) -> tuple[Mesh, Mesh]:
        """Rotor and stator, with the rotor turned by alpha [rad]."""
        return _meshes(self.section, self.grid, alpha, odd=self.odd)


def _meshes(section: CrossSection, grid: Grid, alpha: float, *, odd: bool) -> tuple[Mesh, Mesh]:
    rotor = rotor_mesh(section, grid, alpha, odd=odd)
    return rotor, stator_mesh(section, grid, alpha, odd=odd)


def assemble(
    section: CrossSection, steel: Steel, winding: Winding, *, stack: float, grid: Grid
) -> System:
    """The field problem on one sector where the polarity of the coils reverses from each to the
    next, else on the whole machine. `stack` is the stack length [m]."""
    odd = winding.reverses(section.n_sectors)
    rotor, stator = _meshes(section, grid, 0.0, odd=odd)
    (r, s), pattern = _numbered(rotor, stator)
    of_elements = np.concatenate([r.of_elements, s.of_elements])
    is_steel = np.concatenate([rotor.region, stator.region]) == STEEL
    air, iron = of_elements[~is_steel], of_elements[is_steel]
    return System(
        section=section,
        steel=steel,
        winding=winding,
        grid=grid,
        odd=odd,
        rotor=r,
        stator=s,
        is_steel=is_steel,
        iron=iron,
        sparsity=pattern,
        place=Places(
            air=pattern.place(*pairs(air, air)),
            steel=pattern.place(*pairs(iron, iron)),
            rings=(
                pattern.place(*pairs(r.ring, r.ring)),
                pattern.place(*pairs(s.ring, s.ring)),
            ),
            gap=(
                pattern.place(*pairs(r.ring, s.ring)),
                pattern.place(*pairs(r.ring, s.ring)[::-1]),
            ),
        ),
        length=stack * (section.n_sectors if odd else 1),
    )


def _numbered(rotor: Mesh, stator: Mesh) -> tuple[tuple[Numbers, Numbers], Sparsity]:
    """Both sides numbered together in an order of elimination with little fill."""
    n = rotor.n_unknowns + stator.n_unknowns
    numbers = (
        np.where(rotor.unknown < 0, n, rotor.unknown),
        np.where(stator.unknown < 0, n, stator.unknown + rotor.n_unknowns),
    )

    def numbered(order: Integers) -> tuple[tuple[Numbers, Numbers], Sparsity]:
        r, s = (
            Numbers(
                unknown=order[number],
                of_elements=order[number].ravel()[mesh.elements],
                ring=order[number][mesh.gap_row, :-1],
            )
            for mesh, number in zip((rotor, stator), numbers, strict=True)
        )
        around = np.concatenate([r.ring, s.ring])
        return (r, s), sparsity(n, [r.of_elements, s.of_elements, around])

    _, pattern = numbered(np.arange(n + 1))
    return numbered(np.append(elimination_order(pattern), n))
