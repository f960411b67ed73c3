"""Question: has a 12/8 machine with flat pole faces the flux linkage and torque of its source?

    python studies/published/tanala_12_8.py

The e-bike drive of A. Tanala (commit e7919ad, no licence: figures only), one phase with 15 A. Its
figures are of its own 2-D field, its estimates and its parts. The stacking factor is not stated.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from figure import Figure, rows, show

from reluctance.machine.geometry.by_products import ByProducts, by_products
from reluctance.machine.geometry.cross_section import CrossSection
from reluctance.machine.geometry.mesh import Grid
from reluctance.machine.geometry.position import at_angle
from reluctance.machine.geometry.solve import Field, solve
from reluctance.machine.geometry.steel import Steel
from reluctance.machine.geometry.system import System, assemble
from reluctance.machine.geometry.winding import Winding

MM = 1e-3
CURRENT = 15.0  # [A]

# The source's 14 points of M270-35A [A/m, T].
BH = [
    (0, 0),
    (60, 0.5),
    (90, 0.8),
    (120, 1.0),
    (140, 1.1),
    (170, 1.2),
    (230, 1.3),
    (370, 1.4),
    (800, 1.5),
    (2400, 1.6),
    (5500, 1.7),
    (11000, 1.8),
    (20000, 1.9),
    (36000, 2.0),
]


@cache
def system(gap: float = 0.3) -> System:
    """12/8 with flat stator pole faces: 71.7 mm bore, 35.9 mm stack, 41 turns a coil."""
    section = CrossSection(
        N_s=12,
        N_r=8,
        r_shaft=7.45 * MM,
        r_rotor=(35.85 - gap) * MM,
        r_bore=35.85 * MM,
        r_out=67.65 * MM,
        beta_s=np.radians(15),
        beta_r=np.radians(17),
        h_s=24.8 * MM,
        h_r=9.0 * MM,
        flat_face=True,
    )
    H, B = np.array(BH, dtype=float).T
    coils = Winding(3, (1, 1, 1, -1, -1, -1) * 2, turns=41, parallel_paths=1)
    return assemble(section, Steel(H, B, J_sat=2.03), coils, stack=35.9 * MM, grid=Grid())


@cache
def at(angle_deg: float, current: float = CURRENT) -> Field:
    """The field at an angle from unaligned."""
    return solve(at_angle(system(), np.radians(angle_deg - 22.5)), np.array([current, 0, 0]))


def mean_torque() -> float:
    """Over half a period at 15 A [N m]."""
    gain = at(22.5, 15.0).coenergy - at(0, 15.0).coenergy
    return float(gain / np.radians(22.5))


def estimates() -> ByProducts:
    return by_products(
        system(),
        stack=35.9 * MM,
        stacking_factor=1.0,
        slot_fill=0.45,
        temperature_degC=100,
        L_end_H=None,
    )


def figures() -> list[Figure]:
    """Field at three angles; resistance at 100 degC, masses and inertia."""
    found = estimates()
    iron = found.stator_iron_kg + found.rotor_iron_kg
    psi = {x: 1e3 * at(x).psi[0] for x in (22.5, 11, 0)}
    lines = [
        ("aligned flux linkage", "mWb", 94.53, psi[22.5]),
        ("flux linkage at 11 deg", "mWb", 53.39, psi[11]),
        ("unaligned flux linkage", "mWb", 20.57, psi[0]),
        ("torque at 11 deg", "N m", 3.168, at(11).tau),
        ("mean torque", "N m", 1.803, mean_torque()),
        ("resistance at 100 degC", "ohm", 0.198, found.R_ohm),
        ("end windings", "mH", 0.146, 1e3 * found.L_end_H),
        ("copper", "kg", 1.09, found.copper_kg),
        ("iron", "kg", 2.31, iron),
        ("inertia", "g m2", 0.41, 1e3 * found.J_kgm2),
    ]
    return [Figure(f"Tanala 12/8: {name}", unit, "computed", a, b) for name, unit, a, b in lines]


if __name__ == "__main__":
    show(rows("tanala_12_8", figures()))
