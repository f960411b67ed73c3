"""Torque of machines with short gaps is that of a closed form, and no saw tooth over the angle."""

import csv
import sys
from pathlib import Path

import numpy as np
import pytest
from command import command

from reluctance.machine.geometry.spacing import Spacing
from reluctance.machine.maps import check_map, read_map

BENCH = Path(__file__).parents[2] / "bench"
sys.path.insert(0, str(BENCH))
import geometry as bench  # noqa: E402

with (BENCH / "geometry.csv").open() as file:
    ROWS = list(csv.DictReader(file))


def test_a_mesh_has_its_cells_where_the_corners_are():
    spacing = Spacing(np.array([-1.0, 0.0, 0.2, 2.0]), least=0.01, growth=0.5)
    edges = spacing.split(np.array([-0.5, 0.2]), np.array([0.2, 1.0]), 40)
    assert np.all(np.diff(edges) > 0)
    assert spacing.places(spacing.cells(edges)) == pytest.approx(edges, abs=1e-12)
    for row in edges:
        length, middle = np.diff(row), (row[1:] + row[:-1]) / 2
        away = np.abs(middle[:, None] - spacing.corners).min(axis=1)
        share = length / (0.01 + 0.5 * away)  # one and the same, but where two corners are as near
        assert share == pytest.approx(np.full(40, np.median(share)), rel=0.2)


@pytest.mark.parametrize(
    "N_s, N_r, ratio",
    [(6, 4, 200), *(pytest.param(*x, 460, marks=pytest.mark.long) for x in ((12, 8), (8, 6)))],
)
def test_torque_of_a_short_gap_is_that_of_the_closed_form(N_s, N_r, ratio):
    """Within 1 %; one row of bench/geometry.csv is what the command writes."""
    found = bench.row(N_s, N_r, ratio, 8e4)
    assert abs(found["worst_pct"]) < 1.0
    assert abs(found["rough_pct"]) < 1.0
    stored = next(
        row
        for row in ROWS
        if (row["machine"], float(row["bore_over_gap"])) == (f"{N_s}/{N_r}", ratio)
        and float(row["permeability"]) == 8e4
    )
    for key, value in found.items():
        if isinstance(value, float):
            assert value == pytest.approx(float(stored[key]), rel=1e-3, abs=2e-3)


def test_the_table_of_short_gaps_is_within_a_per_cent_of_the_closed_form():
    """From 1:200; at wider gaps the closed form lacks slots and other poles, and a finer mesh
    agrees with ours."""
    assert len({row["bore_over_gap"] for row in ROWS}) == 6
    assert len({row["machine"] for row in ROWS}) == 3
    assert len({row["permeability"] for row in ROWS}) == 2
    for row in ROWS:
        assert abs(float(row["doubled_pct"])) < 0.2
        assert abs(float(row["rough_pct"])) < 1.0
        if float(row["bore_over_gap"]) >= 200:
            assert abs(float(row["difference_pct"])) < 1.0


IRON = ["0,0", "3,0.3", "6,0.6", "9,0.9", "12,1.2", "15,1.5", "100,1.85", "1000,1.95"]
FILE = """
[machine]
stator_poles = 6
rotor_poles = 4
phases = 3
[lamination]
stack_length_mm = 80
stacking_factor = 1.0
steel = "iron.csv"
[stator]
outer_diameter_mm = 180
bore_diameter_mm = 92
pole_arc_deg = 30
pole_height_mm = 26
[rotor]
pole_arc_deg = 30
pole_height_mm = 18
shaft_diameter_mm = 25
[air_gap]
length_mm = 0.2
[winding]
turns_per_pole = 60
end_winding = 0
[map]
current_max_A = 1.0
angles = 31
currents = 6
"""


@pytest.mark.long
def test_the_command_makes_a_machine_of_a_short_gap_with_31_angles(tmp_path):
    """Its map was refused, for rows of another run, where the poles begin to overlap."""
    rows = ["H_Apm,B_T", *IRON, "5000,2.02", "20000,2.06"]
    (tmp_path / "iron.csv").write_text("\n".join(rows))
    (tmp_path / "g.toml").write_text(FILE)
    out = tmp_path / "m.toml"
    done = command("machine", "from-geometry", tmp_path / "g.toml", "--out", out, "--convergence")
    assert done.code == 0, done.error
    assert "the mesh is fine enough" in done.out
    table = read_map(tmp_path / "m.csv", N_r=4)
    assert check_map(table).verdict == "good"
    flat = (table.theta_e > np.radians(80)) & (table.theta_e < np.radians(140))
    angle, tau = table.theta_e[flat], table.tau[-1, flat]
    falling = np.polyval(np.polyfit(angle, tau, 1), angle)  # less of the poles stands out
    assert np.abs(tau - falling).max() < 0.003 * tau.mean()
    assert tau.mean() == pytest.approx(0.0831, rel=0.03)  # ideal iron and nothing standing out
