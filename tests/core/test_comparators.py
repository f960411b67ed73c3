"""Comparators: analog ones act at any instant, sampled ones at the control's samples."""

from pathlib import Path

import numpy as np
import pytest

import reluctance as rl
from reluctance import _core
from reluctance.targets.export.package import described, firmware

EXAMPLES = Path(__file__).parents[2] / "examples"
SAMPLED = "sensing.comparators=sampled"
FOLLOWERS = ["sharing_cubic", "hysteresis_200A", "paper_rated"]  # laws that ask for comparators
follower = pytest.mark.parametrize("name", FOLLOWERS)


def run(name: str, *overrides: str, until: float = 0.02, record: float | None = 0.0) -> rl.Result:
    return rl.simulate(
        rl.load(EXAMPLES / f"{name}.toml", list(overrides)), until=until, record=record
    )


def switching_instants(result: rl.Result) -> np.ndarray:
    """Instants at which a leg changes [s]."""
    changed = np.any(np.diff(result.leg, axis=1) != 0, axis=0)
    return result.t[1:][changed]


@follower
@pytest.mark.parametrize("delay", [0, 1])
def test_sampled_comparators_switch_at_samples_only(name: str, delay: int) -> None:
    settings = ["control.T_s_us=4", f"sensing.delay_samples={delay}"]
    analog = switching_instants(run(name, *settings)) / 4e-6
    sampled = switching_instants(run(name, *settings, SAMPLED)) / 4e-6
    assert np.abs(analog - np.round(analog)).max() > 0.2
    # a leg without current may fall back to the diodes in between: its current has met zero
    assert np.median(np.abs(sampled - np.round(sampled))) < 1e-6
    assert np.mean(np.abs(sampled - np.round(sampled)) < 1e-6) > 0.97


@follower
def test_fast_samples_come_to_what_analog_comparators_do(name: str) -> None:
    settings = ["control.T_s_us=0.2"]
    analog = run(name, *settings, record=None).kpis
    fast = run(name, *settings, SAMPLED, record=None).kpis
    slow = run(name, "control.T_s_us=4", SAMPLED, record=None).kpis
    assert fast.i_rms == pytest.approx(analog.i_rms, rel=2e-3)
    assert fast.f_switch == pytest.approx(analog.f_switch, rel=0.04)
    assert fast.torque_ripple_pp == pytest.approx(analog.torque_ripple_pp, rel=0.05)
    assert slow.f_switch < 0.95 * analog.f_switch


def test_the_record_shows_the_reference_either_way() -> None:
    analog, sampled = (run("sharing_cubic", *more).i_ref.max() for more in ([], [SAMPLED]))
    assert sampled == pytest.approx(analog, rel=0.01)
    assert sampled > 50


def test_the_leg_is_the_one_of_the_comparators_rule() -> None:
    """Currents below, inside and above the band of a sharing function's reference."""
    drive = rl.load(EXAMPLES / "sharing_cubic.toml", [SAMPLED])
    analog = rl.load(EXAMPLES / "sharing_cubic.toml").controller()

    def orders(controller: _core.Controller, i: float) -> dict[str, float]:
        y = _core.Measurement(i=[i, 0.0, 0.0], theta_e=np.pi / 2, omega_m=157.0, u_dc=240.0)
        return dict(zip(_core.ORDER_COLUMNS, _core.step(controller, y, 41.339), strict=False))

    first = orders(analog, 0.0)
    i_ref, i_band = first["i_ref"], first["i_band"]
    assert i_ref > 10 > i_band > 0
    controller = drive.controller()

    def leg(i: float) -> int:
        order = orders(controller, i)
        assert order["gate"] == _core.Gate.timer.value
        assert len({order[f"leg_{n}"] for n in range(5)}) == 1  # it holds one leg
        return int(order["leg_0"])

    currents = [0.0, i_ref, i_ref + 1.1 * i_band, i_ref, i_ref - 1.1 * i_band, i_ref + 3 * i_band]
    assert [leg(i) for i in currents] == [1, 1, 0, 0, 1, -1]
    assert [leg(i) for i in (i_ref + 0.5 * i_band, i_ref - 0.5 * i_band)] == [-1, 0]


def test_a_board_without_comparators_is_told_that_it_needs_none(tmp_path: Path) -> None:
    drive = rl.load(EXAMPLES / "sharing_cubic.toml", [SAMPLED])
    assert described(drive)["control"]["fields"]["frame"]["fields"]["comparators"]["value"] == 1
    folder = firmware(drive, tmp_path / "sampled").folder
    assert "RELUCTANCE_COMPARATOR`" not in (folder / "README.md").read_text()
    folder = firmware(rl.load(EXAMPLES / "sharing_cubic.toml"), tmp_path / "analog").folder
    assert "RELUCTANCE_COMPARATOR`" in (folder / "README.md").read_text()
