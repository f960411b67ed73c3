"""What commands tell of results that are given: of a dump, of tuned angles, of a parity."""

import json
import math
import re
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from command import command, refused
from rich.console import Console

from reluctance.base.key_figures import Kpis
from reluctance.cli import export as exporting
from reluctance.cli import progress
from reluctance.cli import replay as replaying
from reluctance.cli.run import kpi_table
from reluctance.explore import tuning
from reluctance.explore.tuning.angles import Node, TunedAngles
from reluctance.explore.tuning.goal import Goal
from reluctance.targets.export.dump import Dump, Segment, record_type
from reluctance.targets.export.replay_dump import Difference, Replayed

EXAMPLES = Path(__file__).parents[2] / "examples"
DRIVE = EXAMPLES / "deadbeat.toml"


def dump(trigger=7, status=8, phase=1, count=5):
    records = np.zeros(count, record_type(3))
    segments = [Segment(4, np.zeros(1, np.uint32), records)] if count else []
    return Dump(0xAB, 3, 1, 20e-6, trigger, status, phase, 1.23456789, 2.5, segments)


def replayed(monkeypatch, found):
    monkeypatch.setattr(replaying, "replay_dump", lambda path, drive: found)
    return command("replay", "dump", "--drive", DRIVE)


def test_a_dump_is_told_by_its_trigger_its_cause_and_its_orders(monkeypatch):
    whole = Replayed(dump(), "sensor dead", 0, None)
    done = replayed(monkeypatch, whole)
    assert done.code == 0 and done.out == (
        "5 samples, trigger at sample 7: sensor dead "
        "(phase b: 1.235 Wb, below the limit of 2.5 Wb)\n"
        "all 5 orders equal\n"
    )
    nobody = replace(whole, dump=dump(phase=-1))
    assert "(1.235 Wb, below the limit of 2.5 Wb)" in replayed(monkeypatch, nobody).out
    first = replayed(monkeypatch, replace(whole, dump=dump(phase=0))).out
    assert "(phase a: 1.235 Wb" in first
    asked = replace(whole, dump=dump(status=0), cause="trigger")
    assert "trigger at sample 7: trigger\n" in replayed(monkeypatch, asked).out
    none = replayed(monkeypatch, replace(whole, dump=dump(trigger=None)))
    assert none.out.startswith("5 samples, no trigger\n")


def test_a_dump_that_differs_is_told_and_ends_with_2(monkeypatch, tmp_path):
    found = Replayed(dump(), "dead", 2, Difference(6, "order", "1", "2"))
    done = replayed(monkeypatch, found)
    assert done.code == 2 and "all 5 orders equal" not in done.out
    assert "2 of 5 samples differ, first sample 6: `order` is 1 of the target, 2 of the desk" in (
        done.error
    )
    told = json.loads(command("replay", "dump", "--drive", DRIVE, "--json").out)
    assert told == {
        "samples": 5,
        "different": 2,
        "first": {"sample": 6, "field": "order", "target": "1", "desk": "2"},
        "trigger": 7,
        "status": 8,
        "cause": "dead",
        "fingerprint": "0x000000AB",
    }
    monkeypatch.setattr(replaying, "replay_dump", lambda *_: Replayed(dump(count=0), "", 0, None))
    line = refused("replay", "dump", "--drive", DRIVE, "--plot", tmp_path / "a.png")
    assert "holds no samples" in line


GOAL = Goal("p_cu_W", False, ())


def test_tuned_angles_are_a_table_with_the_notes_below(monkeypatch, tmp_path):
    nodes = (
        Node(1000.0, 10.0, -12.345, 140.0, {"p_cu_W": 123.456}, ""),
        Node(2000.0, 10.0, -20.0, 150.04, {}, "out of reach"),
    )
    found = TunedAngles("mine", GOAL, nodes, tried=12, ran=9)
    asked = {}

    def tuned(drive, over, minimise, **given):
        asked.update(given, over=over, minimise=minimise)
        given["progress"](1.0)
        return found

    monkeypatch.setattr(tuning, "tune_angles", tuned)
    shares = []

    @contextmanager
    def bar(title, total):
        yield lambda reached: shares.append(reached / total)

    monkeypatch.setattr(progress, "progress_bar", bar)
    axes = ("--over", "speed_rpm=1000,2000", "--over", "torque_Nm=10,20")
    line = ("tune", EXAMPLES / "paper_rated.toml", "--set", "control.law=angles", *axes)
    out = tmp_path / "a.csv"
    done = command(*line, "--minimise", "p_cu", "--out", out)
    assert done.code == 0, done.error
    assert asked["over"] == {"speed_rpm": [1000, 2000], "torque_Nm": [10, 20]}
    assert asked["minimise"] == "p_cu" and asked["maximise"] is None and shares == [1.0]
    text = done.out
    assert text.startswith("least p_cu_W: 12 trials, 9 runs made now\n") and str(out) in text
    rows = [row.split("│") for row in text.splitlines() if row.startswith("│")]
    assert [[cell.strip() for cell in row[1:-1]] for row in rows] == [
        ["1000", "10", "-12.3", "140.0", "123.5"],
        ["2000", "10", "-20.0", "150.0", ""],
    ]
    assert "2000 rpm, 10 N m: out of reach" in text and "1000 rpm, 10 N m:" not in text
    told = json.loads(command(*line, "--minimise", "p_cu", "--json").out)
    assert (told["goal"], told["trials"], len(told["nodes"])) == ("least p_cu_W", 12, 2)


def test_a_torque_of_the_file_is_not_in_the_way_of_a_table_of_angles(monkeypatch):
    """Which has torques of its own; the tuning of one point refuses what cannot be reached."""
    monkeypatch.setattr(tuning, "tune_angles", lambda *_, **__: TunedAngles("", GOAL, (), 0, 0))
    line = ("tune", EXAMPLES / "paper_rated.toml", "--set", "control.law=angles")
    far = ("--set", "reference.tau_Nm=4000", "--minimise", "p_cu")
    axes = ("--over", "speed_rpm=1000,2000", "--over", "torque_Nm=10,20")
    assert command(*line, *far, *axes, "--json").code == 0
    assert "4000" in refused(*line, *far, "--vary", "control.theta_on_deg=0:10")


@pytest.mark.parametrize("different", [0, 3])
def test_a_parity_is_told_in_steps_and_fails_at_the_first_that_differs(monkeypatch, different):
    answers = SimpleNamespace(status=np.array([0, 0, 9]))
    found = SimpleNamespace(
        steps=1000, different=different, exact=not different, first=2, answers=answers
    )
    monkeypatch.setattr(exporting, "check_parity", lambda *_, **__: found)
    done = command("export", "parity", DRIVE, "--cpu", "cortex-m4")
    assert f"{1000 - different} of 1000 steps agree in every bit on cortex-m4" in done.out
    assert done.code == (2 if different else 0)
    assert ("differ first at step 2; the status there is 9" in done.error) == bool(different)
    told = json.loads(command("export", "parity", DRIVE, "--json").out)
    assert told == {"steps": 1000, "different": different, "cpu": "cortex-m7"}
    assert "need one of: cortex-m4, cortex-m7" in refused("export", "parity", DRIVE, "--cpu", "z80")


@pytest.mark.parametrize("group", ["law", "map", "machine", "export"])
def test_a_group_of_commands_without_one_shows_its_help(group):
    shown = command(group)
    assert "Usage: " in shown.out + shown.error and "Commands" in shown.out + shown.error
    assert command(group, "--help").code == 0


@pytest.mark.parametrize("name", ["run", "limit", "efficiency", "compare", "sweep", "tune"])
@pytest.mark.parametrize(("option", "value"), [("--width", "3in"), ("--style", "ggplot")])
def test_a_look_without_a_figure_is_one_line(name: str, option: str, value: str) -> None:
    more = {
        "sweep": ("--vary", "control.i_band_A=1,2"),
        "tune": ("--vary", "control.i_band_A=1:2", "--minimise", "i_rms_A"),
    }.get(name, ())
    told = refused(name, EXAMPLES / "sharing_cubic.toml", *more, option, value)
    assert f"{option} {value} has no effect without a figure; add --plot" in told


FIGURES = Kpis(
    tau_mean=20.12345, tau_ref_mean=20.5, torque_ripple_pp=0.12345, torque_ripple_rms=0.0234,
    torque_error_rms=0.0345, i_rms=45.678, i_peak=90.123, p_cu=456.78, p_dev=12.34, p_fe=23.45,
    p_sw=34.56, p_mech=3161.2, p_in=3700.4, efficiency=0.8543, f_switch=6543.2,
    speed_mean=50 * math.pi, speed_ripple_pp=0.00123, u_dc_min=230.12, u_dc_max=245.67,
    i_cap_rms=34.567,
    i_peak_run=123.456, u_dc_peak_run=251.23, speed_peak_run=60 * math.pi, tracking=0.98765,
    Q_mean=7.5 / 3600, p_source=3800.0, energy_residual=1.26e-7, torque_drift=0.01,
    beyond_map=0.0456, t_trip=None, control_period=20e-6, wall_s_per_sim_s=0.01234, periods=17,
)  # fmt: skip
TOLD = """\
mean torque                               20.123 N m
mean torque reference                     20.500 N m
torque ripple, peak to peak               12.35%
torque ripple, rms                        2.34%
torque error, rms                         3.45%
switching frequency, mean per switch      6.54 kHz
rms phase current                         45.68 A
peak phase current                        90.12 A
peaks of the whole run                    123.46 A, 251.2 V at the dc link
rms current of the dc-link capacitor      34.57 A
copper loss                               456.8 W
device conduction loss                    12.3 W
switching loss                            34.6 W
iron loss, estimate                       23.4 W
mechanical power                          3161.2 W
power from the dc link                    3700.4 W
efficiency                                85.43%
mean speed                                1500.00 rpm
speed ripple, peak to peak                0.123%
energy balance, left open                 1.3e-07
control period                            20 us
electrical periods evaluated              17
wall time per simulated time              0.012
"""
OF_SOURCE_AND_PUMP = """\
dc-link voltage, least to greatest        230.1 to 245.7 V
energy from the array, of the available   98.77%
mean flow                                 7.50 m3/h
peak current beyond the flux map          4.6% extrapolated
"""
UNKNOWN = {
    "torque ripple, rms": "-",
    "device conduction loss": "not counted: no converter.v_switch_V",
    "switching loss": "not counted: no converter.E_on_mJ",
    "iron loss, estimate": "not counted: no machine.iron",
}


def shown_rows(figures, *, devices=True):
    """The lines of the table between its borders, as label and value."""
    console = Console(width=110)
    with console.capture() as found:
        console.print(kpi_table("rated", figures, devices=devices))
    rows = [re.split("[│┃]", line)[1:3] for line in found.get().splitlines() if line[0] in "│┃"]
    return {label.strip(): value.strip() for label, value in rows}


def rows_of(text):
    return dict(re.split(r"\s{2,}", line, maxsplit=1) for line in text.splitlines())


def test_key_figures_are_a_table_of_labels_and_values_with_units():
    assert shown_rows(FIGURES) == rows_of(TOLD + OF_SOURCE_AND_PUMP)
    plain = replace(FIGURES, tracking=None, Q_mean=None, beyond_map=0.0, u_dc_max=FIGURES.u_dc_min)
    assert list(shown_rows(plain)) == list(rows_of(TOLD))


def test_a_figure_that_is_not_known_says_what_it_needs():
    lacks = replace(FIGURES, torque_ripple_rms=None, p_sw=None, p_fe=None)
    assert shown_rows(lacks, devices=False) == rows_of(TOLD + OF_SOURCE_AND_PUMP) | UNKNOWN
