"""The mean torque that is asked for, motoring and braking, up to three times base speed:
studies/quadrants.py and the table that it writes."""

import csv
import sys
from pathlib import Path

import pytest

import reluctance as rl

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "studies"))
import quadrants  # noqa: E402

LAWS = ["angles", "pwm_current", "torque_sharing", "deadbeat", "ditc"]
BY_FEEDBACK = LAWS[1:]
TABLE = ROOT / "docs" / "control" / "quadrants.csv"


def table() -> list[dict[str, str]]:
    with TABLE.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("machine", ["paper_6_4", "generic_1hp_8_6", "random_2026"])
def test_laws_hold_the_mean(machine: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(quadrants, "SPEEDS", (1.0, 2.0))
    rows = quadrants.study(quadrants.bench(machine, tmp_path), LAWS)
    assert len(rows) == 2 * 2 * 3 * len(LAWS)
    missed = [row for row in rows if row.torque_part > 0.2 and not row.holds]
    assert not missed


@pytest.mark.parametrize("law", [*LAWS, "paper_mpc", "edge_mpc"])
@pytest.mark.parametrize("quadrant", [1, -1])
def test_backwards_is_the_mirror_image(law: str, quadrant: int, tmp_path: Path) -> None:
    bench = quadrants.bench("paper_6_4", tmp_path)
    forwards = bench.drive(law, 2000.0, 20.0 * quadrant, 40.0)
    backwards = bench.drive(law, -2000.0, -20.0 * quadrant, 40.0)
    there, back = rl.simulate_all([forwards, backwards], until=0.03)
    assert isinstance(there, rl.Kpis) and isinstance(back, rl.Kpis)
    assert back.tau_mean == pytest.approx(-there.tau_mean, rel=1e-4)
    assert back.i_rms == pytest.approx(there.i_rms, rel=1e-4)
    assert back.p_in == pytest.approx(there.p_in, rel=1e-3)


@pytest.mark.parametrize("law", [*LAWS, "paper_mpc", "finite_set_mpc", "edge_mpc"])
def test_braking_at_the_design_speed(law: str, tmp_path: Path) -> None:
    drive = quadrants.bench("paper_6_4", tmp_path).drive(law, 1500.0, -20.0, 20.0)
    kpis = rl.simulate(drive, until=0.1, record=None).kpis
    assert kpis.tau_mean == pytest.approx(-20, rel=0.01)
    most = {"deadbeat": 0.01, "ditc": 0.02, "edge_mpc": 0.01, "finite_set_mpc": 0.01}
    assert law not in most or kpis.torque_error_rms < most[law]


def test_every_law_holds_the_mean_up_to_base_speed_in_the_table() -> None:
    slow = [row for row in table() if float(row["speed_part"]) <= 1]
    slow = [row for row in slow if float(row["torque_part"]) > 0.2]
    assert len(slow) == 4 * 8 * 2 * 3 * 2
    missed = [row for row in slow if row["holds"] == "0"]
    assert [(r["machine"], r["law"], r["quadrant"], r["torque_part"]) for r in missed] == [
        ("random_2026", "paper_mpc", "braking", "0.8")
    ]


def test_laws_with_feedback_miss_only_where_the_current_never_ends() -> None:
    """Above base speed: points that the limit reaches by a current over the whole period."""
    missed = [row for row in table() if row["holds"] == "0" and float(row["torque_part"]) > 0.2]
    for row in missed:
        if row["law"] in BY_FEEDBACK:
            assert float(row["limit_conducts"]) > 0.94, row


def test_the_table_says_what_holds() -> None:
    rows = table()
    assert len(rows) == 4 * 8 * 2 * 6 * 3
    for row in rows:
        assert (row["holds"] == "1") == (abs(float(row["mean_error"])) <= float(row["bound"]))


def test_a_torque_out_of_reach_leaves_nothing_behind(tmp_path: Path) -> None:
    """The feedback of the mean is bounded: ten periods after the torque is possible again it is
    held."""
    drive = quadrants.bench("paper_6_4", tmp_path).drive("deadbeat", 3000.0, 20.0, 95.0)
    course = {
        "reference.tau_Nm": None,
        "reference.values": [95.0, 95.0, 20.0],
        "reference.t_s": [0.0, 0.1, 0.101],
    }
    kpis = rl.simulate(drive.with_values(course), until=0.4, record=None).kpis
    assert kpis.tau_mean == pytest.approx(20, rel=0.002)


def test_a_step_of_the_reference_is_not_an_error_of_the_mean(tmp_path: Path) -> None:
    bench = quadrants.bench("paper_6_4", tmp_path)
    result = rl.simulate(bench.drive("deadbeat", 1500.0, 40.0, 60.0), until=0.03)
    settled = (result.t > 0.005) & (result.t < 0.03)
    assert result.tau[settled].mean() == pytest.approx(40, rel=0.01)


def test_the_drawn_machine_is_the_same_each_time() -> None:
    assert quadrants.random_machine(2026) == quadrants.random_machine(2026)
    assert quadrants.random_machine(2026) != quadrants.random_machine(2027)


@pytest.mark.long
def test_the_table_is_current(tmp_path: Path) -> None:
    fresh = quadrants.study(quadrants.bench("random_2026", tmp_path), [*LAWS, "paper_mpc"])
    kept = {
        (r["law"], r["quadrant"], float(r["speed_part"]), float(r["torque_part"])): r
        for r in table()
        if r["machine"] == "random_2026"
    }
    for row in fresh:
        old = kept[row.law, row.quadrant, row.speed_part, row.torque_part]
        assert row.mean_error == pytest.approx(float(old["mean_error"]), abs=2e-3)
        assert row.ripple_rms == pytest.approx(float(old["ripple_rms"]), rel=0.05, abs=2e-3)
