"""Machines whose field others have computed or measured, from their published dimensions.

Figures are cited, not copied from data files: EMDLAB (torque of a commercial 2-D solver at 3.6 A,
examples/switched-reluctance-machine at commit 0e0a752), the 12/8 drive of A. Tanala (commit
e7919ad: its own 2-D field), TEAM workshop problem 24 (measured).

    python tests/machine/test_geometry_published.py        # writes docs/geometry_published.csv
"""

import csv
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.constants import mu_0

from reluctance.machine.geometry.by_products import by_products
from reluctance.machine.geometry.cross_section import CrossSection
from reluctance.machine.geometry.force import stress
from reluctance.machine.geometry.mesh import Grid
from reluctance.machine.geometry.solve import at_angle, solve
from reluctance.machine.geometry.steel import Steel
from reluctance.machine.geometry.system import assemble
from reluctance.machine.geometry.winding import Coil, Winding

MM = 1e-3
TABLE = Path(__file__).parents[2] / "docs" / "geometry_published.csv"

# H [A/m] and B [T] of M530-50A in EMDLAB's library, every eighth point or so.
EMDLAB_BH = [
    (0, 0),
    (6.407, 0.005965),
    (16.63, 0.01756),
    (26.81, 0.03269),
    (48.21, 0.08646),
    (64.98, 0.176),
    (75.7, 0.2764),
    (83.8, 0.3745),
    (91.25, 0.4753),
    (100.3, 0.5908),
    (109.4, 0.6966),
    (119.2, 0.7943),
    (130.3, 0.8862),
    (146, 0.9883),
    (166.6, 1.084),
    (200.3, 1.186),
    (264.1, 1.288),
    (369.1, 1.366),
    (606.9, 1.436),
    (1211, 1.504),
    (2135, 1.562),
    (3809, 1.638),
    (5523, 1.697),
    (8674, 1.77),
    (15170, 1.849),
    (25770, 1.908),
    (47910, 1.968),
    (92220, 2.042),
    (128100, 2.093),
    (261700, 2.268),
]
# At 0 (unaligned) to 30 deg in equal steps, 3.6 A [N m].
# fmt: off
EMDLAB_TAU = [
    0.0006, 0.0931, 0.1886, 0.2920, 0.4080, 0.5496, 0.7256, 0.9651,
    1.3035, 1.8675, 2.8423, 4.2402, 4.9754, 5.1522, 5.2360, 5.3053,
    5.2940, 5.2276, 5.2168, 5.2058, 5.0334, 4.7788, 4.5359, 4.1158,
    3.5088, 2.9798, 2.4959, 1.7555, 0.5478, 0.0050,
]
# fmt: on


@cache
def emdlab():
    """8/6: 74 mm bore, 0.5 mm gap, 70 mm stack, 278 turns a coil."""
    section = CrossSection(
        N_s=8,
        N_r=6,
        r_shaft=10 * MM,
        r_rotor=36.5 * MM,
        r_bore=37 * MM,
        r_out=62.5 * MM,
        beta_s=np.radians(17.1),
        beta_r=np.radians(19.8),
        h_s=(62.5 - 37 - 7.7) * MM,
        h_r=(36.5 - 10 - 7.53) * MM,
        flat_face=False,
    )
    coils = Winding(4, (1, 1, 1, 1, -1, -1, -1, -1), turns=278, parallel_paths=1)
    H, B = np.array(EMDLAB_BH).T
    return assemble(section, Steel(H, B), coils, stack=70 * MM, grid=Grid())


@cache
def emdlab_torque():
    """At the angles of EMDLAB_TAU [N m]."""
    i = np.array([3.6, 0, 0, 0])
    positions = (at_angle(emdlab(), np.radians(x)) for x in np.linspace(-30, 0, 30))
    return np.array([solve(position, i, tolerance=1e-5).tau for position in positions])


@pytest.mark.long
def test_emdlab_8_6_has_the_torque_of_the_commercial_solver():
    """Rms of the difference at most 2 % of the peak, mean within 2.5 %.

    The mean is 2.0 % above; the mesh is converged to 0.1 %, and so is the offset: see the page.
    """
    tau, own = np.array(EMDLAB_TAU), emdlab_torque()
    assert np.sqrt(np.mean((own - tau) ** 2)) < 0.02 * tau.max()
    assert abs(own.sum() / tau.sum() - 1) < 0.025  # torque is 0 at both ends


# The source's 14 points of M270-35A [A/m, T].
TANALA_BH = [
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
def tanala(gap=0.3):
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
    H, B = np.array(TANALA_BH, dtype=float).T
    coils = Winding(3, (1, 1, 1, -1, -1, -1) * 2, turns=41, parallel_paths=1)
    return assemble(section, Steel(H, B, J_sat=2.03), coils, stack=35.9 * MM, grid=Grid())


@cache
def tanala_at(angle_deg, current):
    """The field at an angle from unaligned."""
    return solve(at_angle(tanala(), np.radians(angle_deg - 22.5)), np.array([current, 0, 0]))


@pytest.mark.parametrize(("angle", "psi_mWb"), [(22.5, 94.53), (11, 53.39), (0, 20.57)])
def test_tanala_12_8_has_the_flux_linkage_of_its_source(angle, psi_mWb):
    assert 1e3 * tanala_at(angle, 15.0).psi[0] == pytest.approx(psi_mWb, rel=5e-3)


def test_tanala_12_8_has_the_torque_of_its_source():
    """At 11 deg from unaligned, and the mean over half a period."""
    assert tanala_at(11, 15.0).tau == pytest.approx(3.168, rel=0.015)
    assert tanala_mean_torque() == pytest.approx(1.803, rel=0.01)


def tanala_mean_torque():
    """Over half a period at 15 A [N m]."""
    gain = tanala_at(22.5, 15.0).coenergy - tanala_at(0, 15.0).coenergy
    return gain / np.radians(22.5)


def tanala_by_products():
    return by_products(
        tanala(),
        stack=35.9 * MM,
        stacking_factor=1.0,
        slot_fill=0.45,
        temperature_degC=100,
        L_end_H=None,
    )


@pytest.mark.parametrize(("angle", "force"), [(0, 2.4), (11, 124), (22.5, 306)])
def test_tanala_12_8_has_the_radial_force_of_another_solver(angle, force):
    """On a tooth at 15 A, of a prototype of our own with another mesh and other elements [N]."""
    assert stress(tanala_at(angle, 15.0)).pole_force(0, 12) == pytest.approx(
        force, rel=0.02, abs=0.2
    )


def test_tanala_12_8_has_the_resistance_inertia_and_masses_of_its_source():
    found = tanala_by_products()
    assert found.R_ohm == pytest.approx(0.198, rel=0.03)
    assert found.L_end_H == pytest.approx(0.146e-3, rel=0.03)
    assert found.copper_kg == pytest.approx(1.09, rel=0.03)
    assert found.stator_iron_kg + found.rotor_iron_kg == pytest.approx(2.31, rel=0.03)
    assert found.J_kgm2 == pytest.approx(4.1e-4, rel=0.03)
    assert 2e3 * np.sqrt(found.wire_area_m2 / np.pi) == pytest.approx(1.66, rel=0.03)


# EN9 steel of TEAM problem 24 above its knee [A/m, T].
TEAM_BH = [
    (4000, 1.413),
    (8010, 1.594),
    (16010, 1.751),
    (24020, 1.839),
    (32030, 1.896),
    (40030, 1.936),
    (48040, 1.967),
    (64050, 2.008),
    (80070, 2.042),
    (96080, 2.073),
    (112100, 2.101),
    (128110, 2.127),
    (144120, 2.150),
    (176150, 2.197),
]
# Below: H/(a + b H) + mu_0 H through 0 and the first three points, scaled to meet the first.
TEAM_A, TEAM_B, TEAM_SCALE = 708.7766, 0.5365555, 1.004923


@cache
def team_torque():
    """Locked at 22 deg, 7.41 A, 350 turns a pole [N m]."""
    section = CrossSection(
        N_s=2,
        N_r=2,
        r_shaft=25.4 * MM,
        r_rotor=51.05 * MM,
        r_bore=53.75 * MM,
        r_out=104.5 * MM,
        beta_s=2 * np.arcsin(13.9 / 53.75),
        beta_r=2 * np.arcsin(12.7 / 51.05),
        h_s=(83.1 - 53.75) * MM,
        h_r=(51.05 - 38.1) * MM,
        flat_face=False,
    )
    low = np.linspace(0, 4000, 8)[:-1]
    B_low = TEAM_SCALE * (low / (TEAM_A + TEAM_B * low) + mu_0 * low)
    H, B = np.array(TEAM_BH).T
    steel = Steel(np.append(low, H), np.append(B_low, B))
    coil = Coil(from_middle=17 * MM, width=24 * MM, r_inner=54.5 * MM, height=17 * MM)
    winding = Winding(1, (1, -1), turns=350, parallel_paths=1, coil=coil)
    # Two poles a machine: slots are wide, and have more cells.
    system = assemble(section, steel, winding, stack=25.4 * MM, grid=Grid(pole=16, slot=48))
    return solve(at_angle(system, np.radians(-22)), np.array([7.41])).tau


def test_team_24_planar_torque_is_below_the_measured_one():
    """3.22 N m measured, 3.088 N m planar. The field at the ends of a stack of 25.4 mm, half the
    rotor's radius, adds the rest; nothing is tuned."""
    print(f"TEAM 24 at 22 deg, 7.41 A: planar {team_torque():.3f} N m, measured 3.22 N m")
    assert team_torque() == pytest.approx(3.088, rel=5e-3)


def figures():
    """Figure, published and ours; in the order of the table."""
    tau, own = np.array(EMDLAB_TAU), emdlab_torque()
    masses = tanala_by_products()
    iron = masses.stator_iron_kg + masses.rotor_iron_kg
    psi = {x: 1e3 * tanala_at(x, 15.0).psi[0] for x in (22.5, 11, 0)}
    return [
        ("EMDLAB 8/6: mean torque (N m)", tau.mean(), own.mean()),
        ("EMDLAB 8/6: peak torque (N m)", tau.max(), own.max()),
        ("EMDLAB 8/6: rms difference (% of peak)", 0, 100 * rms(own - tau) / tau.max()),
        ("Tanala 12/8: aligned flux linkage (mWb)", 94.53, psi[22.5]),
        ("Tanala 12/8: flux linkage at 11 deg (mWb)", 53.39, psi[11]),
        ("Tanala 12/8: unaligned flux linkage (mWb)", 20.57, psi[0]),
        ("Tanala 12/8: torque at 11 deg (N m)", 3.168, tanala_at(11, 15.0).tau),
        ("Tanala 12/8: mean torque (N m)", 1.803, tanala_mean_torque()),
        ("Tanala 12/8: resistance at 100 degC (ohm)", 0.198, masses.R_ohm),
        ("Tanala 12/8: end windings (mH)", 0.146, 1e3 * masses.L_end_H),
        ("Tanala 12/8: copper (kg)", 1.09, masses.copper_kg),
        ("Tanala 12/8: iron (kg)", 2.31, iron),
        ("Tanala 12/8: inertia (g m2)", 0.41, 1e3 * masses.J_kgm2),
        ("TEAM 24: torque at 22 deg, measured (N m)", 3.22, team_torque()),
    ]


def rms(x):
    return float(np.sqrt(np.mean(x**2)))


def rows():
    """As the table has them; the difference in per cent where there is a published figure."""
    found = []
    for name, published, ours in figures():
        difference = f"{100 * (ours / published - 1):.2f}" if published else ""
        found.append([name, f"{published:.4g}", f"{ours:.4g}", difference])
    return found


@pytest.mark.long
def test_the_table_of_published_machines_is_what_this_file_writes():
    with TABLE.open() as file:
        stored = list(csv.reader(file))[1:]
    for row, now in zip(stored, rows(), strict=True):
        assert row[:2] == now[:2]
        assert float(row[2]) == pytest.approx(float(now[2]), rel=2e-3)


def main():
    with TABLE.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["figure", "published", "ours", "difference_pct"])
        writer.writerows(rows())


if __name__ == "__main__":
    main()
