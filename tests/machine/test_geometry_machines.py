"""The machines that were made from geometries run with every control law."""

import csv
import json
import sys
from pathlib import Path

import pytest
from command import command

import reluctance as rl
from reluctance.base.resources import resources
from reluctance.drive.laws import LAWS
from reluctance.drive.load import drive_from
from reluctance.machine.library import machine_table

sys.path.insert(0, str(Path(__file__).parents[2] / "studies"))
import geometry_tune

ROOT = Path(__file__).parents[2]
MACHINES = sorted(path.stem for path in (resources("machines") / "geometry").glob("*.toml"))
WITH_BAND = ("angles", "paper_mpc")


def drive(name, law):
    """A quarter of the greatest mean torque at a speed of 50 electrical periods a second."""
    table = machine_table(name, resources("machines"))
    data = {
        "machine": table,
        "converter": {"u_dc_V": 300},
        "load": {"kind": "locked", "speed_rpm": 60 * 50 / table["N_r"]},
        "reference": {"kind": "torque", "tau_Nm": 1.0},
        "control": {"law": law, "T_s_us": 25},
        "simulation": {"until_s": 0.08, "dt_max_us": 10},
    }
    if law in WITH_BAND:
        data["control"]["i_band_A"] = table["i_max_A"] / 50
    machine = drive_from(data, check_torque=False).machine
    data["reference"]["tau_Nm"] = 0.2 * machine.greatest_torque
    return drive_from(data)


@pytest.mark.long
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("name", MACHINES)
def test_a_machine_from_a_geometry_runs_with_every_law(name, law):
    case = drive(name, law)
    kpis = rl.simulate(case, record=None).kpis
    assert kpis.tau_mean == pytest.approx(case.reference.tau_Nm, rel=0.05)
    assert abs(kpis.energy_residual) < 1e-6
    assert kpis.beyond_map < 0.05


@pytest.mark.long
def test_the_tuned_laminations_are_as_good_as_the_table_says():
    """docs/geometry_tune.csv: each row is run again from its values."""
    with (ROOT / "docs" / "geometry_tune.csv").open() as file:
        rows = list(csv.DictReader(file))
    best = min(rows, key=lambda row: float(row["torque_error_rms"]))
    assert best["tuned"] in ("law after poles", "both")
    assert all(float(row["p_cu_W"]) <= float(rows[0]["p_cu_W"]) for row in rows)
    for row in rows:
        columns = {"_".join(key.split(".")[-2:]): key for key in geometry_tune.WAYS["both"]}
        values = {key: float(row[name]) for name, key in columns.items() if row[name]}
        drive = geometry_tune.drive().with_values(values)
        kpis = rl.simulate(drive, until=geometry_tune.UNTIL, record=None).kpis
        # Values of the table have five digits; the angle of a switching moves with them.
        assert kpis.torque_error_rms == pytest.approx(float(row["torque_error_rms"]), rel=0.02)
        assert kpis.p_cu == pytest.approx(float(row["p_cu_W"]), rel=0.005)


@pytest.mark.long
def test_the_command_tunes_a_lamination_together_with_a_law(tmp_path):
    """As the page does, with few trials on a coarse map."""
    settings = [part for text in geometry_tune.SETTINGS for part in ("--set", text)]
    done = command(
        *("tune", ROOT / "examples" / "sharing_cubic.toml", *settings),
        *("--set", "machine.map.angles=13", "--set", "machine.map.currents=8"),
        *("--vary", "machine.rotor.pole_arc_deg=30:36", "--vary", "control.theta_on_deg=5:12"),
        *("--vary", "control.theta_ov_deg=38:44"),
        *("--minimise", "torque_error_rms", "--keep", "p_cu_W<110", "--until", "0.06"),
        *("--budget", "6", "--json", "--out", tmp_path / "tuned.toml"),
    )
    assert done.code == 0, done.error
    best = json.loads(done.out)
    assert 30 <= best["values"]["machine.rotor.pole_arc_deg"] <= 36
    tuned = rl.load(tmp_path / "tuned.toml")
    assert tuned.machine.geometry.rotor.pole_arc_deg == pytest.approx(
        best["values"]["machine.rotor.pole_arc_deg"]
    )
    again = rl.simulate(tuned, until=0.06, record=None).kpis.torque_error_rms
    assert again == pytest.approx(best["figures"]["torque_error_rms"], rel=1e-3)
