"""Dead time in the closed loop: what it costs, what compensates it, what it leaves as it is."""

from pathlib import Path

import numpy as np
import pytest

import reluctance as rl
from reluctance.explore.comparison.conditions import conditions, in_words, operating_point
from reluctance.targets.export import firmware

EXAMPLES = Path(__file__).parents[2] / "examples"
CARRIER = ["deadbeat", "pwm_current"]
GATES = ["deadbeat", "sharing_cubic", "hysteresis_200A"]  # timer, comparator, window


def drive(name: str, dead_time_us: float, *overrides: str) -> rl.Drive:
    return rl.load(
        EXAMPLES / f"{name}.toml", [f"converter.dead_time_us={dead_time_us}", *overrides]
    )


@pytest.mark.parametrize("name", CARRIER)
def test_laws_with_a_carrier_keep_their_mean_torque(name: str) -> None:
    """Uncompensated, 1 us of a period of 20 us costs both about 0.8 %."""
    ideal, late = (rl.simulate(drive(name, d), until=0.1, record=None).kpis for d in (0, 1))
    assert late.tau_mean == pytest.approx(ideal.tau_mean, rel=5e-4)
    assert late.torque_error_rms == pytest.approx(ideal.torque_error_rms, rel=0.01)


@pytest.mark.parametrize(("dead_time_us", "factor"), [(1, 1.1), (2, 1.3)])
def test_edges_inside_the_sample_hardly_feel_it(dead_time_us: float, factor: float) -> None:
    """Not compensated, 2 us nearly double the error. Turn-ons at sample borders, and sooner after
    them than the dead time, stay late: 0.52 % rms become 0.54 % with 1 us and 0.65 % with 2 us."""
    ideal, late = (
        rl.simulate(drive("edge_mpc_mcu", d), until=0.1, record=None).kpis
        for d in (0, dead_time_us)
    )
    assert late.tau_mean == pytest.approx(ideal.tau_mean, rel=1e-3)
    assert late.torque_error_rms < factor * ideal.torque_error_rms


def test_a_comparator_passes_its_lower_bound_only() -> None:
    """By the slope of the freewheeling current times the dead time: here about 1 A/us."""
    found = []
    for dead_time_us in (0, 20):
        result = rl.simulate(drive("hysteresis_200A", dead_time_us), until=0.06)
        k, theta_e = 0, np.mod(4 * result.theta_m, 2 * np.pi)
        flat = (result.t > 0.03) & (theta_e > np.radians(60)) & (theta_e < np.radians(119.9))
        found.append((result.i[k][flat].min(), result.i[k][flat].max()))
    (ideal_low, ideal_high), (low, high) = found
    assert high == pytest.approx(ideal_high, abs=1e-3)
    assert 15 < ideal_low - low < 25


def test_late_turn_ons_make_fewer_of_them() -> None:
    ideal, late = (
        rl.simulate(drive("sharing_cubic", d), until=0.06, record=None).kpis for d in (0, 2)
    )
    assert late.f_switch < 0.9 * ideal.f_switch
    assert late.torque_error_rms > 1.1 * ideal.torque_error_rms


@pytest.mark.parametrize("name", GATES)
def test_the_laws_of_the_loop_hold(name: str) -> None:
    """Energy, steps, and the sign of currents."""
    a, b = (
        rl.simulate(drive(name, 1.3, f"simulation.dt_max_us={dt}"), until=0.05) for dt in (10, 3.7)
    )
    assert a.i.min() == 0
    for figure in ("tau_mean", "torque_ripple_pp", "torque_ripple_rms", "i_rms"):
        assert getattr(a.kpis, figure) == pytest.approx(getattr(b.kpis, figure), rel=1e-4)
    assert a.kpis.f_switch == pytest.approx(b.kpis.f_switch, rel=1e-9)
    assert abs(a.kpis.energy_residual) < 1e-6


@pytest.mark.parametrize("name", GATES)
def test_waveforms_show_the_legs_of_the_winding(name: str) -> None:
    """The recorded voltages are those that drove the flux, and every recorded rise was counted."""
    result = rl.simulate(drive(name, 2.5), until=0.02)
    u_mean = (result.u[:, :-1] * np.diff(result.t)).sum(axis=1)
    copper = result.drive.machine.R * (result.i[:, :-1] + result.i[:, 1:]) / 2 * np.diff(result.t)
    np.testing.assert_allclose(u_mean - copper.sum(axis=1), result.psi[:, -1], atol=2e-4)
    rises = np.maximum(np.diff(result.leg, axis=1, prepend=-1), 0).sum()
    assert rises == result.periods["turn_ons"][-1]


def test_firmware_is_not_made_for_a_dead_time_that_its_protection_cannot_take(tmp_path) -> None:
    firmware(drive("deadbeat", 4), tmp_path / "long")
    assert "4 us late at turn-on" in (tmp_path / "long" / "README.md").read_text()
    with pytest.raises(rl.ParameterError, match=r"dead_time_us = 4.1, need at most 0.2 of"):
        firmware(drive("deadbeat", 4.1), tmp_path / "longer")


def test_a_comparison_says_under_which_dead_time() -> None:
    point = operating_point(drive("paper_rated", 1.5))
    assert conditions(point)["dead_time_us"] == 1.5
    assert "dead time 1.5 us" in in_words(point, 10e3)[0]
    assert "dead time" not in "".join(in_words(operating_point(drive("paper_rated", 0)), 10e3))
