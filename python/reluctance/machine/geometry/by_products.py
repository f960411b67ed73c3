"""What the cross-section gives without a field: resistance, end winding, inertia and masses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.constants import mu_0

from reluctance.base.errors import ParameterError
from reluctance.machine.copper import COPPER_RESISTIVITY, resistance_ratio
from reluctance.machine.geometry.elements import Elements
from reluctance.machine.geometry.mesh import STEEL, Mesh
from reluctance.machine.geometry.position import at_angle
from reluctance.machine.geometry.system import System

COPPER_DENSITY = 8960.0  # [kg/m^3]
SHEET_DENSITY = 7650.0  # of sheet with 2 to 3 % silicon, EN 10106 [kg/m^3]
SHAFT_DENSITY = 7850.0  # carbon steel [kg/m^3]
# Inductance of an end turn is mu_0 N^2 length times this. It gives the published 0.146 mH of the
# 12/8 machine of the tests, which is an estimate too: 2-D fields do not contain it.
END_PERMEANCE = 0.4
MOST_END = 20.0  # of that estimate, of an inductance that is given: a thousand is H for mH


@dataclass(frozen=True)
class ByProducts:
    """Of the whole machine; the resistance at the winding's temperature."""

    R_ohm: float  # of a phase
    L_end_H: float  # of a phase: end windings
    wire_area_m2: float  # copper of one conductor
    turn_m: float  # mean length of a turn
    copper_kg: float
    stator_iron_kg: float
    rotor_iron_kg: float
    J_kgm2: float  # rotor sheets, and the shaft within the stack


def by_products(
    system: System,
    *,
    stack: float,
    stacking_factor: float,
    slot_fill: float,
    temperature_degC: float,
    L_end_H: float | None,
) -> ByProducts:
    """The estimates for a stack length [m]; `slot_fill` is copper over the area of the coil sides.

    A turn has two conductors in the slots, and at each end the width of the pole and two quarter
    circles with half the thickness of the coil around its corners.
    """
    section, winding = system.section, system.winding
    aligned = at_angle(system, 0.0)
    n_coils = len(winding.polarity) // winding.n_phases  # of a phase
    coil = winding.coil
    height = section.h_s if coil is None else coil.height
    thickness = aligned.coil_area / height
    end = 2 * section.half_width_s + np.pi / 2 * thickness
    turn = 2 * (stack + end)
    area = slot_fill * aligned.coil_area / winding.turns
    rho = COPPER_RESISTIVITY * resistance_ratio(temperature_degC)
    R_coil = rho * winding.turns * turn / area
    per_path = n_coils / winding.parallel_paths
    L_coil = END_PERMEANCE * mu_0 * winding.turns**2 * 2 * end
    L_auto = L_coil * per_path / winding.parallel_paths
    if L_end_H is not None and not 0 <= L_end_H <= MOST_END * L_auto:
        raise ParameterError(
            f"[winding] end_winding = {1e3 * L_end_H:g} mH, need 0 to "
            f"{1e3 * MOST_END * L_auto:.3g}, {MOST_END:g} times the estimate of 'auto'; check its "
            "unit (mH, of a phase)"
        )
    sheet = SHEET_DENSITY * stacking_factor * system.length
    inertia = SHAFT_DENSITY * stack * np.pi / 2 * section.r_shaft**4
    rotor, stator = aligned.rotor, aligned.stator
    return ByProducts(
        R_ohm=R_coil * per_path / winding.parallel_paths,
        L_end_H=L_auto if L_end_H is None else L_end_H,
        wire_area_m2=area,
        turn_m=turn,
        copper_kg=COPPER_DENSITY * len(winding.polarity) * winding.turns * area * turn,
        stator_iron_kg=sheet * _moment(stator.mesh, stator.elements, 0),
        rotor_iron_kg=sheet * _moment(rotor.mesh, rotor.elements, 0),
        J_kgm2=sheet * _moment(rotor.mesh, rotor.elements, 2) + inertia,
    )


def _moment(mesh: Mesh, of: Elements, power: int) -> float:
    """Integral of r^power over the steel [m^(2 + power)]."""
    here = mesh.region == STEEL
    return float((of.weight[here] * of.r[here] ** power).sum())
