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
from drawn_machine import drawn_machine  # noqa: E402

LAWS = [*quadrants.PERIODS]
TABLE = ROOT / "docs" / "control" / "quadrants.csv"
each_law = pytest.mark.parametrize("law", LAWS)


def table() -> list[dict[str, str]]:
    with TABLE.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@each_law
def test_braking_at_the_design_speed(law: str, tmp_path: Path) -> None:
    """-20 N m at 1500 rpm, 14 to 23 % short before braking had rules of its own."""
    drive = quadrants.bench("paper_6_4", tmp_path).drive(law, 1500.0, -20.0, 20.0)
    kpis = rl.simulate(drive, until=0.1, record=None).kpis
    assert kpis.tau_mean == pytest.approx(-20, rel=0.01)
    most = {"deadbeat": 0.01, "ditc": 0.02, "edge_mpc": 0.01, "finite_set_mpc": 0.01}
    assert law not in most or kpis.torque_error_rms < most[law]


@each_law
@pytest.mark.parametrize("sign", [1, -1])
def test_backwards_is_the_mirror_image(law: str, sign: int, tmp_path: Path) -> None:
    bench = quadrants.bench("paper_6_4", tmp_path)
    forwards = bench.drive(law, 2000.0, 20.0 * sign, 40.0)
    backwards = bench.drive(law, -2000.0, -20.0 * sign, 40.0)
    there, back = rl.simulate_all([forwards, backwards], until=0.03)
    assert isinstance(there, rl.Kpis) and isinstance(back, rl.Kpis)
    assert back.tau_mean == pytest.approx(-there.tau_mean, rel=1e-4)
    assert back.i_rms == pytest.approx(there.i_rms, rel=1e-4)
    assert back.p_in == pytest.approx(there.p_in, rel=1e-3)


def test_the_table_says_what_holds() -> None:
    rows = table()
    assert len(rows) == 4 * 8 * 2 * 6 * 3
    for row in rows:
        if row["refused"]:
            assert (row["holds"], row["mean_error"]) == ("0", "")
        else:
            assert (row["holds"] == "1") == (abs(float(row["mean_error"])) <= float(row["bound"]))


def test_the_drawn_machine_is_the_same_each_time() -> None:
    assert drawn_machine(2026) == drawn_machine(2026)
    assert drawn_machine(2026) != drawn_machine(2027)


def compared(machine: str, laws: list[str], tmp_path: Path) -> int:
    """Runs of a machine, compared with the table."""
    rows = quadrants.study(quadrants.bench(machine, tmp_path), laws)
    kept = {
        (r["law"], r["quadrant"], float(r["speed_part"]), float(r["torque_part"])): r
        for r in table()
        if r["machine"] == machine
    }
    for row in rows:
        old = kept[row.law, row.quadrant, row.speed_part, row.torque_part]
        assert bool(row.refused) == bool(old["refused"])
        if not row.refused:
            assert row.mean_error == pytest.approx(float(old["mean_error"]), abs=2e-3)
            ripple = float(old["ripple_rms"] or "nan")  # none has meaning where the mean is zero
            assert row.ripple_rms == pytest.approx(ripple, rel=0.05, abs=2e-3, nan_ok=True)
    return len(rows)


def test_the_table_is_current(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(quadrants, "SPEEDS", (1.0, 2.0))
    laws = ["angles", "pwm_current", "torque_sharing", "deadbeat", "ditc", "paper_mpc"]
    assert compared("random_2026", laws, tmp_path) == 2 * 2 * 3 * len(laws)


@pytest.mark.long
@pytest.mark.parametrize("machine", quadrants.MACHINES)
def test_the_whole_table_is_current(machine: str, tmp_path: Path) -> None:
    assert compared(machine, LAWS, tmp_path) == 2 * 6 * 3 * len(LAWS)
