"""Energy of every electrical period: what the windings take is loss, work and stored energy."""

import numpy as np
import pytest

import reluctance as rl
from reluctance.drive.drive import drive_from

pytestmark = pytest.mark.filterwarnings("ignore:.*the line that the aligned curve ends in")

# A period of this drive ends 1e-15 s after the end of a step of one phase, while the others are
# within theirs.
BESIDE_A_STEP = {
    "machine": {
        **{"name": "10/8", "source": "drawn", "licence": "Apache-2.0"},
        **{"N_s": 10, "N_r": 8, "n_phases": 5, "i_max_A": 213, "model": "lehuy"},
        **{"R_ohm": 0.02953, "L_u_H": 0.08522e-3, "L_a_H": 1.215e-3, "L_sat_H": 0.02064e-3},
        **{"i_m_A": 213, "psi_m_Wb": 0.1028, "J_kgm2": 0.01},
    },
    "converter": {"u_dc_V": 298},
    "load": {"kind": "locked", "speed_rpm": 6178.53},
    "reference": {"kind": "torque", "tau_Nm": 43.195},
    "control": {
        **{"law": "torque_sharing", "T_s_us": 20, "i_band_A": 2.0, "tau_max_Nm": 57.593},
    },
    "simulation": {"until_s": 0.06},
}


def left_open(drive: rl.Drive) -> float:
    """The greatest part of a period's energy that no figure accounts for."""
    rows = rl.simulate(drive, record=None).periods
    copper = drive.machine.R * np.diff(rows.phases("i_squared").sum(axis=0))
    E_winding, E_mech, W_f = (np.diff(rows[name]) for name in ("E_winding", "E_mech", "W_f"))
    return float(np.abs(E_winding - copper - E_mech - W_f).max() / np.abs(E_winding).max())


def test_a_period_that_ends_beside_a_step_has_all_phases() -> None:
    assert left_open(drive_from(BESIDE_A_STEP, name="10/8")) < 1e-6


@pytest.mark.parametrize("seed", range(4))
def test_every_period_is_balanced_at_any_speed(seed: int) -> None:
    draw = np.random.default_rng(seed)
    values = {
        "load.speed_rpm": float(draw.uniform(2000, 8000)),
        "control.i_band_A": float(draw.uniform(1, 4)),
        "simulation.until_s": 0.03,
    }
    assert left_open(drive_from(BESIDE_A_STEP, name="10/8").with_values(values)) < 1e-6
