"""Where the voltage runs out: the boundary of a law's own references, and what lies beyond it."""

import csv
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import command

import reluctance as rl
from reluctance.base.errors import ParameterError
from reluctance.drive.laws import hand_over
from reluctance.drive.laws.shared_torque import ANGLES, feasible_shares
from reluctance.explore.comparison import contest
from reluctance.explore.comparison.conditions import operating_point

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "studies"))
import quadrants  # noqa: E402
import voltage  # noqa: E402
from drawn_machine import WIDE, drawn_machine  # noqa: E402

TABLE = ROOT / "docs" / "control" / "voltage.csv"


@pytest.fixture(params=["paper_6_4", "usual 611", "usual 612", "wide 613"])
def at(request: pytest.FixtureRequest, tmp_path: Path) -> quadrants.Bench:
    """A machine of the library, and some that were drawn."""
    ranges, _, seed = request.param.partition(" ")
    if not seed:
        return quadrants.bench(request.param, tmp_path)
    text, u_dc = drawn_machine(int(seed), *([WIDE] if ranges == "wide" else []))
    machine = tmp_path / "machine.toml"
    machine.write_text(text, encoding="utf-8")
    given = (f"machine={machine}", f"converter.u_dc_V={u_dc}", "reference.tau_Nm=0.01")
    return quadrants.Bench(request.param, given)


def half_torque(at: quadrants.Bench) -> float:
    """Half of the greatest torque without ripple at standstill [N m]."""
    return 0.5 * quadrants.limits(at.at_rest(), [0.0], 1)[0]


def drive(at: quadrants.Bench, law: str, part: float) -> rl.Drive:
    """Motoring at a part of the speed at which the law hands over."""
    tau = float(f"{half_torque(at):.5g}")
    known = at.drive(law, 100.0, tau, tau).known()
    control: Any = at.drive(law, 100.0, tau, tau).control
    reach = float(control.boundary(known)[0][-1])
    rpm = part * reach * known.u_dc / known.N_r * 30 / np.pi
    return at.drive(law, float(f"{rpm:.6g}"), tau, tau)


def test_the_mean_is_that_of_the_shares_up_to_the_boundary(at: quadrants.Bench) -> None:
    """And not far beyond it, where the profile of the limit holds it instead."""
    drives = [drive(at, "deadbeat", part) for part in (0.95, 1.6)]
    with voltage.own_references():
        below, beyond = (rl.simulate(d, until=0.2, record=None).kpis for d in drives)
    tau = below.tau_ref_mean
    assert below.tau_mean == pytest.approx(tau, rel=0.01)
    assert beyond.tau_mean < 0.98 * tau


@pytest.mark.parametrize("law", ["torque_sharing", "deadbeat"])
def test_the_mean_is_held_on_both_sides_of_the_boundary(at: quadrants.Bench, law: str) -> None:
    """Below it flux that falls behind the shares adds up to 1.3 %."""
    for part in (0.97, 1.03):
        kpis = rl.simulate(drive(at, law, part), until=0.2, record=None).kpis
        assert kpis.tau_mean == pytest.approx(kpis.tau_ref_mean, rel=0.015)


@pytest.mark.parametrize("sign", [1, -1])
def test_the_window_of_ditc_gives_the_torque_up_to_its_boundary(
    at: quadrants.Bench, sign: int
) -> None:
    """At twice that speed feedback may still hold the mean, but not the torque at every angle."""
    tau = 0.2 * sign * half_torque(at)
    known = at.drive("ditc", 100.0, tau, abs(tau)).known()
    control: Any = at.drive("ditc", 100.0, tau, abs(tau)).control
    reach = control.boundary(known)[0 if sign > 0 else 1][-1]
    rpm = reach * known.u_dc / known.N_r * 30 / np.pi
    parts = (0.95, 1, 2)
    drives = [at.drive("ditc", float(f"{part * rpm:.6g}"), tau, abs(tau)) for part in parts]
    with voltage.own_references():
        below, limit, beyond = (rl.simulate(d, until=0.2, record=None).kpis for d in drives)
    assert [below.tau_mean, limit.tau_mean] == pytest.approx([tau, tau], rel=0.01)
    assert beyond.torque_error_rms > 2 * below.torque_error_rms


def test_voltage_and_resistance_together_change_no_boundary() -> None:
    """R i over u_dc is all that resistance says."""
    known = rl.load(ROOT / "examples" / "sharing_cubic.toml").known()
    sharing = rl.load(ROOT / "examples" / "sharing_cubic.toml").control.shares(known)
    angles = np.linspace(0, np.pi, ANGLES)
    twice = replace(
        known, u_dc=2 * known.u_dc, machine=known.machine.computed(R_ohm=2 * known.machine.R_ohm)
    )
    once, again = (feasible_shares(k, sharing, angles) for k in (known, twice))
    assert again == pytest.approx(once, rel=1e-12)
    assert np.all(np.diff(once[1:]) <= 0)  # more torque takes more voltage


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[float]]:
    """Speeds for which profiles are asked for; none is found."""
    asked: list[float] = []

    def none(known: Any, make: Any, room: float) -> Any:
        asked.append(known.omega_m)
        raise RuntimeError("no optimum")

    monkeypatch.setattr(hand_over, "with_room", none)
    yield asked


@pytest.mark.parametrize(
    ("overrides", "asks"),
    [
        ((), False),
        (("reference.tau_Nm=-41.339",), True),
        (("control.guide_speed_rpm=1500",), True),
        (("converter.u_dc_V=150",), True),
    ],
)
def test_profiles_are_made_for_a_drive_that_may_need_them(
    overrides: tuple[str, ...], asks: bool, made: list[float]
) -> None:
    drive = rl.load(ROOT / "examples" / "sharing_cubic.toml", [*overrides])
    try:
        drive.controller()
    except ParameterError:
        assert asks
    assert bool(made) == asks


@pytest.mark.parametrize(("tau_Nm", "asks"), [("41.339", True), ("-41.339", False)])
def test_each_direction_is_held_against_its_own_boundary(
    tau_Nm: str, asks: bool, made: list[float]
) -> None:
    """With a dc link that sags, ditc motors beyond its boundary here and brakes within."""
    given = ["load.speed_rpm=2058", f"reference.tau_Nm={tau_Nm}"]
    drive = rl.load(ROOT / "examples" / "ditc.toml", given)
    known = drive.known()
    control: Any = drive.control
    motoring, braking = (float(reach.min()) for reach in control.boundary(known))
    assert motoring < known.N_r * known.omega_m / (hand_over.SAG * known.u_dc) < braking
    drive.controller()
    assert bool(made) == asks


def test_a_drive_beyond_its_boundary_without_a_profile_is_refused(made: list[float]) -> None:
    drive = rl.load(ROOT / "examples" / "sharing_cubic.toml", ["load.speed_rpm=4000"])
    with pytest.raises(ParameterError, match=r"needs more than the 240 V.*4000 rpm.*lower speed"):
        drive.controller()


@pytest.mark.long
def test_the_table_is_current(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(voltage, "SPEEDS", (0.5, 1.5))
    found = list(voltage.runs(quadrants.bench("paper_6_4", tmp_path)))
    with TABLE.open(newline="", encoding="utf-8") as file:
        kept = list(csv.DictReader(file))
    for run in found:
        (row,) = [
            r
            for r in kept
            if (r["law"], r["quadrant"], r["own"]) == (run.law, run.quadrant, str(run.own))
            and float(r["speed_part"]) == run.speed_part
            and float(r["torque_part"]) == run.torque_part
        ]
        assert int(row["beyond"]) == run.beyond
        assert run.mean_error == pytest.approx(float(row["mean_error"]), abs=2e-3)
        assert run.ripple_rms == pytest.approx(float(row["ripple_rms"]), rel=0.05, abs=2e-3)
    assert len(found) == 2 * 2 * 2 * 2 * 3


CUBIC = ROOT / "examples" / "sharing_cubic.toml"  # the boundary at 20 N m is above 2500 rpm
PAPER = f"machine={ROOT / 'machines' / 'paper_6_4.toml'}"
SHORT = ("--until", "0.03", "--set", "reference.tau_Nm=20")


@pytest.mark.parametrize(("rpm", "used"), [(2000, True), (3500, False)])
def test_a_run_tells_of_a_sharing_function_that_is_not_used(rpm: float, used: bool) -> None:
    """Where the note is there two functions give the same run, and else they do not."""
    runs = [
        command("run", CUBIC, *SHORT, "--set", f"load.speed_rpm={rpm}", "--set", f"control.{key}")
        for key in ("sharing='cubic'", "sharing='linear'")
    ]
    figures = [[line for line in done.out.splitlines() if "wall" not in line] for done in runs]
    notes = [[line for line in lines if "does not use" in line] for lines in figures]
    same = [[line for line in lines[1:] if "does not use" not in line] for lines in figures]
    assert (same[0] == same[1]) != used
    if used:
        assert notes == [[], []]
    else:
        assert "3500 rpm the law does not use [control] sharing = 'linear': 240 V do" in notes[1][0]


def test_a_sharing_function_that_the_current_limit_forbids_is_told_with_it() -> None:
    more = ("--set", PAPER, "--set", "machine.i_max_A=58", "--set", "load.speed_rpm=300")
    told = command("run", CUBIC, "--until", "0.1", "--set", "reference.tau_Nm=28", *more).out
    assert "sharing = 'cubic': i_max_A = 58 does not suffice for it" in told


def test_a_law_whose_angles_by_rule_are_not_used_tells_so() -> None:
    fast = ("--set", "load.speed_rpm=4000", "--set", "control.law=ditc")
    assert "its angles by rule: 240 V do not suffice" in command("run", CUBIC, *SHORT, *fast).out
    own = ("--set", "control.theta_on_deg=20", "--set", "control.theta_off_deg=160")
    assert "does not use" not in command("run", CUBIC, *SHORT, *fast, *own).out


def test_a_sweep_over_sharing_functions_tells_where_none_is_used() -> None:
    vary = ("--vary", "load.speed_rpm=2000,3500", "--vary", "control.sharing=cubic,linear")
    told = command("sweep", CUBIC, *SHORT, *vary).out
    assert "2 of 4 points do not use their control.sharing" in told
    assert "the first: load.speed_rpm = 3500, control.sharing = cubic" in told
    alone = command("sweep", CUBIC, *SHORT, "--vary", "load.speed_rpm=2000,3500").out
    assert "do not use" not in alone


@pytest.mark.parametrize(("rpm", "noted"), [(1500, False), (3500, True)])
def test_a_comparison_notes_a_law_that_follows_the_profile_of_the_limit(
    rpm: int, noted: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(contest, "BUDGET", 12)
    point = operating_point(rl.load(CUBIC, [f"load.speed_rpm={rpm}", "reference.tau_Nm=20"]))
    found = contest.contest(point, "sharing_linear", 8e3, ())
    assert (contest.FOLLOWS in found.note) == noted
