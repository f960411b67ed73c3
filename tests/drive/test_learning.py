"""Laws that learn the machine they drive: what they learn, and what it does to the torque.

docs/control/learning.csv is compared with runs; `python studies/learning.py` writes it.
"""

import csv
import ctypes
import subprocess
import sys
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import refused
from coupled import SENSED, WORKING, coupling, machine_file, unlike
from firmware_tools import Native

import reluctance as rl
from reluctance import _core
from reluctance.base.toolchain import build
from reluctance.drive.run.learned import learned

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "studies"))

import learning as study  # noqa: E402

RATED, HALF, BRAKING = study.PAPER
MEAN, RIPPLE = 0.005, 1.1  # bounds of the project, 0.2 s after the start
# deadbeat brakes on the profile of the limit, in flux linkage of the believed map: a shape that is
# learned is not in it (docs/control/learning.md).
RIPPLE_OF_ANOTHER_SHAPE = 1.6


def test_the_parts_follow_their_own_rules(tmp_path):
    """Least squares, volt-seconds against the gates of the simulation, similar machines."""
    program = tmp_path / "learning_check"
    source = ROOT / "tests" / "core" / "learning_check.cpp"
    flags = ["-O1", "-Wall", "-Wextra", "-Werror", "-Iinclude"]
    build([str(source)], program, flags, folder=ROOT, what="the check", link=())
    done = subprocess.run([str(program)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


@pytest.mark.long
@pytest.mark.parametrize("law", study.LAWS)
@pytest.mark.parametrize("point", study.PAPER, ids=lambda p: f"{p.tau_Nm:g} N m")
@pytest.mark.parametrize("belief", study.FEW[1:])
def test_mean_and_ripple_are_those_of_the_right_map(law, point, belief):
    row = study.measured((law, point, belief))
    assert abs(row.mean_error_without) > 0.07
    assert abs(row.mean_error) < MEAN
    another_shape = brakes_on_the_profile(vars(row)) and "saturated" in belief
    assert row.ripple_ratio < (RIPPLE_OF_ANOTHER_SHAPE if another_shape else RIPPLE)
    assert row.state == "settled"


@pytest.mark.long
def test_what_is_learned_is_the_truth():
    """A map that is off by a factor: all four numbers are known."""
    row = study.measured(("edge_mpc", HALF, "flux +10 %, R -20 %"))
    assert abs(row.R_error) < 0.005
    for factor in (row.unaligned, row.aligned, row.saturated):
        assert factor == pytest.approx(1 / 1.1, rel=0.002)


@pytest.mark.long
def test_a_map_from_a_file_is_learned_too():
    (point,) = [p for p in study.OTHERS if p.machine == "npf_vector_6_4"]
    row = study.measured(("edge_mpc", point, "flux -10 %, R +20 %"))
    assert abs(row.mean_error) < MEAN
    assert row.ripple_ratio < RIPPLE
    assert row.aligned == pytest.approx(1 / 0.9, rel=0.003)


PAIRS = {"add": coupling, "take": lambda: coupling(-0.2), "unlike": unlike}
FLUX = (1.1, 0.9)


@pytest.mark.parametrize(
    ("law", "pairs", "flux"),
    [
        case if case == ("deadbeat", "unlike", 1.1) else pytest.param(*case, marks=pytest.mark.long)
        for case in product(("deadbeat", "edge_mpc"), PAIRS, FLUX)
    ],
)
def test_the_mean_is_right_where_phases_couple(law, pairs, flux, tmp_path):
    """Flux linkage and resistance believed wrong, and the pairs with the flux linkage."""
    given = rl.load(
        ROOT / "examples" / f"{study.LAWS[law]}.toml",
        [f"machine={machine_file(tmp_path, PAIRS[pairs]())}", *WORKING, *SENSED],
    ).with_values({"mismatch.flux_factor": flux, "mismatch.R_factor": 1.3})
    result = rl.simulate(given, until=study.UNTIL, record=None)
    learned = result.learned
    assert result.kpis.tau_mean == pytest.approx(given.tau_max, rel=MEAN)
    for factor in (learned.aligned, learned.saturated):
        assert factor[-1] == pytest.approx(1 / flux, rel=0.01)
    assert learned.state == "settled"


def test_without_learning_the_controller_is_what_it_was():
    """Key figures of the same drive with the key, set to false, and without."""
    given = study.drive("edge_mpc", HALF, study.BELIEFS["flux +10 %"], learn=False)
    without = given.with_values({"control.learn": None})
    one, other = (rl.simulate(d, until=0.02, record=None) for d in (given, without))
    assert one.learned is None
    assert one.kpis.tau_mean == other.kpis.tau_mean
    assert one.kpis.torque_ripple_pp == other.kpis.torque_ripple_pp


@pytest.mark.long
def test_a_winding_that_warms_is_followed():
    result = study.warming("edge_mpc")
    assert study.lag(result) < 0.03
    assert result.learned.R[-1] == pytest.approx(study.HOT * result.drive.machine.R, rel=0.005)
    assert result.kpis.tau_mean == pytest.approx(RATED.tau_Nm, rel=MEAN)


@pytest.mark.parametrize("name", ["standstill", "no torque"])
def test_without_excitation_nothing_moves_and_it_says_so(name):
    learned = study.quiet(name).learned
    assert learned.state == "waits"
    assert learned.strokes[-1] == 0
    assert learned.t_since[-1] == pytest.approx(study.UNTIL, rel=1e-3)
    for factor in (learned.unaligned, learned.aligned, learned.saturated):
        assert np.all(factor == 1)
    assert np.all(learned.R == learned.R[0])


@pytest.mark.long
@pytest.mark.parametrize("rpm", [5659, 8488])
def test_currents_that_never_end_tell_nothing(rpm):
    """The 60 kW machine at 2 and 3 times its base speed: every phase stays in current, after a
    first stroke from no current that does not end either."""
    drive = rl.load(
        ROOT / "examples" / "edge_mpc_learning.toml",
        [
            *("machine=generic_60kw_6_4", "converter.u_dc_V=300", "sensing.i_range_A=500"),
            *(f"load.speed_rpm={rpm}", "reference.tau_Nm=60"),
        ],
    )
    result = rl.simulate(drive, until=0.15)
    i = np.asarray(result.i)
    assert i[:, i.shape[1] // 2 :].min() > 1.0
    learned = result.learned
    assert learned.state == "waits" and learned.strokes[-1] == 0
    factors = (learned.unaligned, learned.aligned, learned.saturated)
    assert all(np.all(factor == 1.0) for factor in factors)
    assert np.all(learned.R == learned.R[0])


@pytest.mark.long
def test_a_standstill_after_a_run_keeps_what_was_learned():
    """Learned while it turns; then the rotor stands."""
    given = study.drive("edge_mpc", HALF, study.BELIEFS["flux -10 %"], learn=True)
    course = {"load.t_s": [0, 0.15, 0.16], "load.values": [500.0, 500.0, 0.0]}
    changed = given.with_values({"load.speed_rpm": None, **course})
    learned = rl.simulate(changed, until=0.6, record=None).learned
    assert learned.state == "waits"
    assert learned.aligned[-1] == pytest.approx(1 / 0.9, rel=0.005)
    assert learned.t_since[-1] > 0.3


@pytest.mark.long
@pytest.mark.parametrize("law", study.LAWS)
def test_random_plants_and_starts_are_held(law):
    """Thirty of the study's ten thousand."""
    runs = np.array([study.random_run(law, seed) for seed in range(30)])
    assert np.abs(runs[:, 0]).max() < 0.015
    assert runs[:, 1].max() < 160


def test_what_is_learned_stays_within_its_range():
    """A plant of half the flux linkage that is believed: out of range, and still no instability."""
    given = study.drive("edge_mpc", HALF, study.Belief(), learn=True)
    other = given.with_values({"mismatch.flux_factor": 0.5, "mismatch.R_factor": 0.25})
    plant = replace(given, machine=other.known().machine)
    result = rl.simulate(plant, until=0.2, record=None, controller=given.controller())
    learned = result.learned
    for factor in (learned.unaligned, learned.aligned, learned.saturated):
        assert factor.min() >= 0.75
        assert factor.max() <= 1.35
    assert learned.R.min() >= 0.4 * learned.R[0]
    assert np.isfinite(result.kpis.tau_mean)
    assert result.kpis.i_peak < given.machine.i_max_A


def test_the_firmware_tells_what_it_has_learned(tmp_path):
    given = study.drive("edge_mpc", HALF, study.BELIEFS["flux +10 %"], learn=True)
    target = Native(given, tmp_path)
    desk = replace(given, control=given.control.model_copy(update={"precision": "float"}))
    result = rl.simulate(desk, until=0.05, record=None)
    rl.simulate(given, until=0.05, record=None, controller=target.controller)
    assert target.trip is None

    class Told(ctypes.Structure):
        names = ("R", "unaligned", "aligned", "saturated", "strokes", "asked", "t_since_s")
        _fields_ = tuple((name, ctypes.c_float) for name in names)

    target.library.reluctance_get_learned.restype = Told
    told = target.library.reluctance_get_learned(ctypes.c_void_p(target.state.ctypes.data))
    assert told.aligned == np.float32(result.learned.aligned[-1])
    assert told.saturated == np.float32(result.learned.saturated[-1])
    assert told.strokes == result.learned.strokes[-1] > 3


def test_the_command_line_tells_what_was_learned():
    example = ROOT / "examples" / "edge_mpc_learning.toml"
    command = [sys.executable, "-m", "reluctance", "run", str(example), "--until", "0.05"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "learned: R " in done.stdout
    assert "strokes" in done.stdout


def rows():
    with (ROOT / "docs" / "control" / "learning.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def brakes_on_the_profile(row: dict[str, Any]) -> bool:
    return row["law"] == "deadbeat" and float(row["tau_Nm"]) < 0


def test_the_file_has_every_case_within_the_bounds():
    written = [(r["law"], r["machine"], float(r["rpm"]), float(r["tau_Nm"])) for r in rows()]
    wanted = [(law, p.machine, p.rpm, p.tau_Nm) for law, p, _ in study.tasks()]
    assert written == wanted
    # deadbeat brakes on the profile of the limit, whose strokes hardly end (the page says more)
    held = [row for row in rows() if not brakes_on_the_profile(row)]
    assert len(held) == len(rows()) - len(study.BELIEFS)
    assert all(abs(float(row["mean_error"])) < MEAN for row in held)
    others = [row for row in rows() if brakes_on_the_profile(row)]
    assert sum(abs(float(row["mean_error"])) < MEAN for row in others) == len(others) - 1
    assert all(abs(float(row["mean_error"])) < 0.05 for row in others)
    at_paper = [r for r in rows() if (r["machine"], r["rpm"]) == ("paper_6_4", "1500")]
    assert len(at_paper) == 2 * 3 * len(study.BELIEFS)
    for row in at_paper:
        if brakes_on_the_profile(row):
            continue
        less_often = float(row["f_switch_kHz"]) / float(row["f_switch_right_kHz"])
        one = row["belief"] == "all: flux +10 %, R -20 %, u. -10 %, s. +10 %"  # the page tells it
        assert float(row["ripple_ratio"]) * (less_often if one else 1) < RIPPLE


@pytest.mark.parametrize("task", [study.tasks()[2], study.tasks()[-1]])
def test_the_file_is_current(task):
    law, point, belief = task
    (row,) = [
        r for r in rows()
        if (r["law"], r["machine"], float(r["rpm"]), float(r["tau_Nm"]), r["belief"])
        == (law, point.machine, point.rpm, point.tau_Nm, belief)
    ]  # fmt: skip
    found = vars(study.measured(task))
    for key, text in row.items():
        if isinstance(found[key], float):
            assert found[key] == pytest.approx(float(text), rel=0.01, abs=0.001), key


@pytest.mark.parametrize("form", ["blob", "fmu"])
def test_a_form_that_cannot_learn_says_so(form: str, tmp_path: Path) -> None:
    drive = ROOT / "examples" / "edge_mpc_learning.toml"
    line = refused("export", form, drive, "--out", tmp_path / f"unit.{form}")
    assert line.startswith("error: [control] learn = true")
    assert not list(tmp_path.iterdir())


def told(strokes=5.0, asked=0.001, t_since=0.0):
    """What a control has learned after a second, in one row."""
    one = {"unaligned": 1.1, "aligned": 0.9, "saturated": 1.0, "R": 0.8}
    row = {**one, "strokes": strokes, "asked": asked, "t_since": t_since}
    return learned([[1.0, *(row[name] for name in _core.learned_columns)]], R=0.5)


def test_a_control_settles_waits_or_moves_by_what_its_last_stroke_asked_for():
    assert told().state == "settled" and told(asked=0.011).state == "moves"
    assert told(asked=0.009).state == "settled"
    assert told(strokes=0.0).state == "waits" and told(t_since=0.201).state == "waits"
    assert told(t_since=0.199).state == "settled"
    assert told().figures() == {
        "R_ohm": pytest.approx(0.4),  # 0.8 of the 0.5 ohm that it believed
        **{"unaligned": 1.1, "aligned": 0.9, "saturated": 1.0},
        **{"strokes": 5, "state": "settled"},
    }
    line = "R 0.4 ohm; map: unaligned 1.100, aligned 0.900, saturated 1.000; 5 strokes; "
    assert told().text() == line + "settled"
    assert told(asked=0.5).text() == line + "still moving"
    assert told(t_since=99.0).text().endswith("no current returns to zero: nothing is learned now")
