"""What the numerics do not find when a law is set up is one line; a sweep records it."""

import json
from pathlib import Path
from typing import Any

import pytest
from command import command, refused

import reluctance as rl
from reluctance.base.errors import Unsolved
from reluctance.machine import optimum
from reluctance.machine.optimum.programme import Programme

EXAMPLES = Path(__file__).parents[2] / "examples"
DEADBEAT = EXAMPLES / "deadbeat.toml"  # 0.72 ohm, 240 V
SHORT = ("--until", "0.01")


def unsolved(*_: object, **__: object) -> None:
    raise Unsolved("no optimum found at 7 N m")


@pytest.mark.parametrize("law", ["deadbeat", "finite_set_mpc", "edge_mpc", "paper_mpc"])
def test_a_resistance_above_the_voltage_of_the_profile_is_one_line_whose_remedy_works(
    law: str,
) -> None:
    own = ("--set", "control.T_s_us=20", "--set", f"control.law={law}")
    line = ("run", DEADBEAT, *SHORT, *own)
    told = refused(*line, "--set", "mismatch.R_factor=200")
    assert "144 ohm, drops" in told and "need less than u_dc_V = 240" in told
    assert "lower [mismatch] R_factor" in told and "[machine] R_ohm" in told
    assert command(*line, "--set", "mismatch.R_factor=20").code == 0


def test_a_sweep_records_the_point_whose_law_cannot_be_set_up(tmp_path: Path) -> None:
    line = ("sweep", DEADBEAT, *SHORT, "--vary", "mismatch.R_factor=1,200", "--json")
    done = command(*line, "--out", tmp_path / "s.db", "--jobs", "1")
    assert done.code == 0, done.error
    good, bad = json.loads(done.out)["points"]
    assert good["why"] is None and good["tau_mean_Nm"] > 30
    assert bad["tau_mean_Nm"] is None and "144 ohm, drops" in bad["why"]


def test_a_profile_that_is_not_found_is_one_line_with_the_law_and_its_point(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(optimum, "profile_table", unsolved)
    drive = EXAMPLES / "finite_set_mpc.toml"
    told = refused("run", drive, *SHORT)
    assert "[control] law = 'finite_set_mpc' cannot be set up for 41.339 N m at 1500 rpm" in told
    assert "240 V: no optimum found at 7 N m" in told
    with pytest.raises(rl.ParameterError, match="cannot be set up"):
        rl.simulate(rl.load(drive), until=0.01)


def test_a_search_that_finds_nothing_ends_a_command_on_one_line(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from reluctance.explore import limits

    monkeypatch.setattr(limits, "limit", unsolved)
    assert "no optimum found at 7 N m" in refused("limit", DEADBEAT)


def test_levels_whose_least_error_is_not_found_are_weighed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A drive follows a profile with ripple then; the limit has none that it could show."""
    point = rl.load(DEADBEAT).at(157.0)
    best = Programme.best

    def unless_zero(self: Programme, tau_ref: float, *more: Any, **named: Any) -> Any:
        return unsolved() if tau_ref else best(self, tau_ref, *more, **named)

    monkeypatch.setattr(Programme, "best", unless_zero)
    monkeypatch.setenv("RELUCTANCE_CACHE", str(tmp_path))
    table = optimum.profile_table(point, 20.0, n_points=36, n_levels=3, ripple_weight=100.0)
    assert [0 if i.max() == 0 else 1 for i in table.i] == [0, 1, 1]
    assert (table.tau_error_rms[1:] < 0.05 * table.tau_ref[1:]).all()
    with pytest.raises(Unsolved):
        optimum.profile_table(point, 20.0, n_points=36, n_levels=3)
