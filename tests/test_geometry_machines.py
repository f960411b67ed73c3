"""The machines that were made from geometries run with every control law."""

import pytest

import reluctance as rl
from reluctance.drive.load import drive_from
from reluctance.laws import LAWS
from reluctance.machine.library import machine_table
from reluctance.resources import resources

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
