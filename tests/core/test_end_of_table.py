"""A current that passes the end of a flux map: the kink of the inductance there is located, so that
energy closes as it does within the table."""

import numpy as np
import pytest

import reluctance as rl
from reluctance.base.resources import resources

PULSE = ["control.regulate=none", "reference.kind=none", "reference.tau_Nm="]


def beyond(law):
    """A drive on an imported map whose current passes the table's end."""
    drive = rl.load(resources("examples") / "map_mpc.toml")
    last = drive.machine.i_known_A
    if law == "ditc":
        control = {"control.law": "ditc", "control.T_s_us": 20.0}
        return drive.with_values({"machine": "npf_vector_6_4", **control}), last
    single = rl.load(resources("examples") / "single_pulse.toml")
    omega = 0.35 * np.pi * drive.converter.u_dc_V / (4 * 0.5)
    return single.with_values(
        {
            "machine": "npf_vector_6_4",
            "converter.u_dc_V": drive.converter.u_dc_V,
            "load.speed_rpm": float(omega),
            "control.theta_on_deg": 0.0,
            "control.theta_off_deg": 150.0,
        }
    ), last


def test_energy_closes_where_the_current_leaves_the_table_and_comes_back():
    drive, last = beyond("single pulse")
    periods = 6 * 2 * np.pi / (drive.machine.N_r * drive.omega_nominal)
    k = rl.simulate(drive, until=periods, record=None).kpis
    assert k.i_peak > 1.05 * last, "the current stays within the table: take another point"
    assert k.energy_residual < 1e-6


def test_a_row_stands_where_the_current_passes_the_end():
    drive, last = beyond("single pulse")
    periods = 2 * 2 * np.pi / (drive.machine.N_r * drive.omega_nominal)
    result = rl.simulate(drive, until=periods)
    i = result.i[0]
    passes = np.flatnonzero((i[:-1] < last) & (i[1:] > last * (1 + 1e-6)))
    assert passes.size == 0, "a step went over the end of the table"
    assert np.min(np.abs(i - last)) == pytest.approx(0, abs=1e-6 * last)
