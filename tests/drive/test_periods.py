"""Whole electrical periods of a rotor that begins at rest, or turns back."""

from pathlib import Path

import numpy as np
import pytest

import reluctance as rl
from reluctance.cli.run import unmet

EXAMPLES = Path(__file__).parents[2] / "examples"


def fan(speed_rpm, start_rpm=0.0):
    """A fan that is driven to a speed from another one."""
    drive = rl.load(EXAMPLES / "sharing_cubic.toml")
    return drive.with_values(
        {
            **{"reference.kind": "speed", "reference.speed_rpm": speed_rpm},
            **{"reference.tau_Nm": None, "control.tau_max_Nm": 30.0, "load.speed_rpm": start_rpm},
            **{"load.kind": "fan", "load.k_fan_Nms2": 5e-4, "load.J_kgm2": 0.005},
        }
    )


@pytest.mark.parametrize("start", [0.0, 300.0])
def test_backwards_has_the_key_figures_of_forwards(start):
    """The mirror of a run: as many periods, the torque with the other sign."""
    ahead = rl.simulate(fan(1000.0), until=0.4, record=None).kpis
    back = rl.simulate(fan(-1000.0, start), until=0.4, record=None).kpis
    assert ahead.periods > 10
    assert abs(back.periods - ahead.periods) <= 1
    assert back.tau_mean == pytest.approx(-ahead.tau_mean, rel=1e-3)
    assert back.p_cu == pytest.approx(ahead.p_cu, rel=2e-3)
    assert back.efficiency == pytest.approx(ahead.efficiency, rel=1e-3)
    assert back.speed_mean == pytest.approx(-ahead.speed_mean, rel=1e-4)


def test_a_period_ends_at_each_whole_pitch_that_is_passed():
    """Forward, back past the start, and forward again: every end is a whole pitch, none is
    missing."""
    drive = fan(400.0).with_values(
        {
            **{"reference.speed_rpm": None, "reference.t_s": [0.0, 0.15, 0.15, 0.5, 0.5, 0.8]},
            "reference.values": [400.0, 400.0, -400.0, -400.0, 300.0, 300.0],
        }
    )
    result = rl.simulate(drive, until=0.8, record=drive.control.T_s)
    pitch = 2 * np.pi / drive.machine.N_r
    passed = np.flatnonzero(np.diff(np.floor(result.theta_m / pitch)))
    ends = result.periods["t"][1:-1]
    at = np.interp(ends, result.t, result.theta_m) / pitch
    np.testing.assert_allclose(at, np.round(at), atol=1e-3)
    assert len(ends) == len(passed) > 10
    assert result.theta_m.min() < -2 * pitch < 2 * pitch < result.theta_m.max()


def test_a_speed_that_is_missed_by_half_is_told_without_whole_periods():
    drive = fan(1000.0).with_values({"load.k_fan_Nms2": 5.0, "control.tau_max_Nm": 5.0})
    kpis = rl.simulate(drive, until=0.05, record=None).kpis
    assert kpis.periods < 2
    assert any("speed reference is not held" in remark for remark in unmet(drive, kpis))
    held = fan(1000.0, 1000.0)
    soon = rl.simulate(held, until=0.02, record=None).kpis
    assert soon.periods < 2
    assert not any("not held" in remark for remark in unmet(held, soon) if "speed" in remark)


@pytest.mark.parametrize("zero", [0.0, -0.0])
def test_a_rotor_that_is_held_at_standstill_never_reaches_an_angle(zero):
    drive = rl.load(EXAMPLES / "sharing_cubic.toml").with_values({"load.speed_rpm": zero})
    result = rl.simulate(drive, until=0.002, record=1e-4)
    assert result.t[-1] == 0.002 and (result.theta_m == result.theta_m[0]).all()
    assert result.kpis.periods == 0


@pytest.mark.parametrize("name", ["sharing_cubic", "edge_mpc_mcu"])
@pytest.mark.parametrize("until", [1e-4, 2.37e-4])
def test_the_end_of_a_run_is_within_its_extremes(name, until):
    """While the currents rise, the last instant has the greatest."""
    result = rl.simulate(rl.load(EXAMPLES / f"{name}.toml"), until=until, record=1e-6)
    last = result.periods.between(len(result.periods["t"]) - 1, len(result.periods["t"]))
    greatest = pytest.approx(result.i[:, -1].max(), rel=1e-12)
    assert result.i.max() == greatest == result.kpis.i_peak_run
    assert last["tau_max"][0] >= result.tau[-1] >= last["tau_min"][0]
    assert last["omega_min"][0] <= result.omega_m[-1] <= last["omega_max"][0]
    assert last["u_min"][0] <= result.u_dc[-1] <= last["u_max"][0]


@pytest.mark.parametrize("machine", ["paper_6_4", "emdlab_8_6", "design_10_8"])
@pytest.mark.parametrize("seed", [710331, 710332])
def test_each_period_has_one_pulse_of_each_phase_where_edges_fall_on_its_ends(machine, seed):
    """Unregulated: edges of one phase or another are where periods end, but for a rounding."""
    rng = np.random.default_rng(seed)
    machine_of = rl.load(EXAMPLES / "single_pulse.toml", [f'machine="{machine}"']).machine
    shift = 360.0 / machine_of.n_phases
    for n in range(4):
        rpm = float(rng.choice([-1.0, 1.0]) * rng.choice([250.0, 600.0, rng.uniform(200.0, 900.0)]))
        edge = float(shift * rng.integers(0, 180 // shift))
        on, off = (edge, edge + rng.uniform(20.0, 60.0)) if n % 2 else (shift / 3, shift)
        keys = [f"control.theta_on_deg={on}", f"control.theta_off_deg={off}"]
        keys += [f'machine="{machine}"', f"load.speed_rpm={rpm}", "simulation.dt_max_us=20"]
        f_e = abs(rpm) / 60 * machine_of.N_r
        drive = rl.load(EXAMPLES / "single_pulse.toml", keys)
        result = rl.simulate(drive, until=8 / f_e, record=None)
        assert result.kpis.f_switch == pytest.approx(f_e, rel=1e-9), (machine, rpm, on, off)
        counts = np.diff(result.periods["turn_ons"])[:-1]
        assert (counts[1:] == 2 * machine_of.n_phases).all(), (machine, rpm, on, off)
