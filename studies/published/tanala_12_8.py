"""Question: has a 12/8 machine with flat pole faces the flux linkage and torque of its source?

    python studies/published/tanala_12_8.py

The e-bike drive of A. Tanala (commit e7919ad, no licence: figures only), one phase with 15 A. Its
figures are of its own 2-D field, its estimates and its parts. The stacking factor is not stated.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
from figure import Figure, rows, show

from reluctance.base.schema import checked
from reluctance.base.toml_file import read_toml
from reluctance.machine.geometry.by_products import ByProducts
from reluctance.machine.geometry.file import Geometry
from reluctance.machine.geometry.position import at_angle
from reluctance.machine.geometry.solve import Field, solve
from reluctance.machine.geometry.solved import by_products_of, system_of
from reluctance.machine.geometry.system import System
from reluctance.machine.library import flattened

OUT = Path(__file__).parents[2] / "out" / "published"
CURRENT = 15.0  # [A]
I_MAX = 29.192  # of the source's converter [A]

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


def machine_file(folder: Path) -> Path:
    """Writes geometry file and B-H curve: 12/8 with flat stator pole faces, neighbouring poles NNN
    SSS, and a resistance at 100 degC."""
    curve = folder / "tanala_bh.csv"
    points = "".join(f"{H},{B}\n" for H, B in BH)
    curve.write_text(f"H_A_per_m,B_T\n{points}", encoding="utf-8")
    path = folder / "tanala_12_8.toml"
    path.write_text(
        f"""[machine]
name = "12/8 of an e-bike"
source = "github.com/subrahmanyamtanala-rgb @ e7919ad"
licence = "none: numbers only"
stator_poles = 12
rotor_poles = 8
phases = 3
i_max_A = {I_MAX}

[lamination]
stack_length_mm = 35.9
stacking_factor = 1.0
steel = "{curve}"
saturation_polarisation_T = 2.03

[stator]
outer_diameter_mm = 135.3
bore_diameter_mm = 71.7
pole_arc_deg = 15
pole_height_mm = 24.8
pole_face = "flat"

[rotor]
pole_arc_deg = 17
pole_height_mm = 9.0
shaft_diameter_mm = 14.9

[air_gap]
length_mm = 0.3

[winding]
turns_per_pole = 41
slot_fill = 0.45
temperature_degC = 100

[map]
current_max_A = 40
""",
        encoding="utf-8",
    )
    return path


@cache
def geometry() -> Geometry:
    OUT.mkdir(parents=True, exist_ok=True)
    table = flattened(read_toml(machine_file(OUT)))
    return checked(Geometry, {key: v for key, v in table.items() if key != "model"}, "tanala_12_8")


@cache
def system(outer_diameter_mm: float | None = None) -> System:
    """The field problem; with another outer diameter, and with it another yoke, if one is given."""
    given = geometry()
    if outer_diameter_mm is not None:
        stator = given.stator.model_copy(update={"outer_diameter_mm": outer_diameter_mm})
        given = given.model_copy(update={"stator": stator})
    return system_of(given)


@cache
def at(angle_deg: float, current: float = CURRENT) -> Field:
    """The field at an angle from unaligned."""
    return solve(at_angle(system(), np.radians(angle_deg - 22.5)), np.array([current, 0, 0]))


def mean_torque() -> float:
    """Over half a period at 15 A [N m]."""
    gain = at(22.5, 15.0).coenergy - at(0, 15.0).coenergy
    return float(gain / np.radians(22.5))


def estimates() -> ByProducts:
    return by_products_of(geometry())


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
