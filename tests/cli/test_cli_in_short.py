"""What commands print of findings that are given: nothing is simulated, solved or compiled."""

import io
import json
import sys
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace as Namespace

import numpy as np
import pytest
from command import command, refused, words

import reluctance as rl
from reluctance.base.errors import ParameterError
from reluctance.cli import progress as bars
from reluctance.cli import replay, tune
from reluctance.explore.efficiency_map.map import EfficiencyMap
from reluctance.explore.sweeps.result import Sweep
from reluctance.targets.export.blob import Kind
from reluctance.targets.export.cost import Cost
from reluctance.targets.export.replay_dump import Difference, Replayed

EXAMPLES = Path(__file__).parents[2] / "examples"


CUBIC = EXAMPLES / "sharing_cubic.toml"


exporting = import_module("reluctance.cli.export")


run = import_module("reluctance.cli.run")  # the package has the function under this name


# replay, of a dump


def dump(**values):
    usual = {"samples": 40, "trigger": 30, "status": 0, "phase": -1, "value": 0.0, "limit": 0.0}
    return Namespace(dump=Namespace(**usual | values), cause="sensor dead")


def test_a_trigger_is_told_with_its_cause_and_its_phase():
    assert replay._trigger(dump(trigger=None)) == "40 samples, no trigger"
    told = "40 samples, trigger at sample 30: sensor dead"
    assert replay._trigger(dump()) == told
    fault = {"status": 2, "value": 180.0, "limit": 150.0}
    assert replay._trigger(dump(**fault)) == f"{told} (180 A, above the limit of 150 A)"
    assert (
        replay._trigger(dump(**fault, phase=0))
        == f"{told} (phase a: 180 A, above the limit of 150 A)"
    )


# run


def test_a_speed_that_is_missed_is_told_with_the_greatest_torque(monkeypatch):
    """By a twentieth, or by half of it where fewer than two periods are in the figures."""
    drive = rl.load(EXAMPLES / "paper_pump.toml")
    asked = drive.reference.speed_rpm * np.pi / 30
    for part, periods, told in (
        (0.951, 2, False), (0.949, 2, True), (1.049, 2, False), (1.051, 2, True),
        (0.51, 1, False), (0.49, 1, True), (0.949, 1, False),
    ):  # fmt: skip
        kpis = Namespace(speed_mean=part * asked, periods=periods, remarks=lambda **_: ["r"])
        remark, *missed = run.unmet(drive, kpis)
        assert remark == "r" and len(missed) == told, (part, periods)
        if told:
            assert missed[0].startswith(f"the speed reference is not held ({part:.0%} of it)")
            assert missed[0].endswith(f"tau_max_Nm = {drive.tau_max:.4g} N m")
    assert run.unmet(rl.load(CUBIC), kpis) == ["r"]


def test_three_phases_at_once_are_told_from_a_hundredth_of_the_time_on():
    def periods(three, t=2.0):
        return Namespace(rise={"three_on": three, "t": t}.get)

    assert run.crowded(periods(0.02)) == run.crowded(periods(0.0, 0.0)) == []
    (line,) = run.crowded(periods(0.05))
    assert line.startswith("three phases or more conduct at once for 2% of the time")


def test_a_figure_on_a_grid_that_is_coarser_than_the_orders_is_told(tmp_path):
    """Waveforms in a file have the grid that was asked."""
    order = ("run", EXAMPLES / "paper_rated.toml", "--until", "0.02")
    period = f"{1e6 * rl.load(order[1]).control.T_s:g}"
    note = f"at every 50 us (--record-us), and the control orders at every {period} us: ripple and"
    for options, told in (
        (("--record-us", "50", "--plot", tmp_path / "a.png"), True),
        (("--record-us", "50", "--energy-loop", tmp_path / "b.png"), True),
        (("--record-us", period, "--plot", tmp_path / "c.png"), False),
        (("--record-us", "50", "--out", tmp_path / "d.csv"), False),
    ):
        assert (note in words(command(*order, *options).out)) == told, options


def test_a_diagnosis_that_does_not_run_is_told():
    for diagnosis, on, told in ((True, False, 1), (True, True, 0), (False, False, 0)):
        parts = Namespace(diagnosis=diagnosis), Namespace(on=on)
        assert len(run.undiagnosed(Namespace(protection=parts[0], supervision=parts[1]))) == told


def test_what_acts_on_a_steady_drive_is_constant():
    def drive(kind="torque", reference=None, load=None, source=None):
        reference = Namespace(kind=kind, values=reference)
        return Namespace(
            reference=reference, load=Namespace(values=load), source=Namespace(values=source)
        )

    assert run.is_steady(drive()) and not run.is_steady(drive("pv"))
    for name in ("reference", "load", "source"):
        assert not run.is_steady(drive(**{name: [1.0, 2.0]}))
    assert run.loss(None, "a.b") == "not counted: no a.b" and run.loss(1.26, "a.b") == "1.3 W"


# efficiency


def test_an_efficiency_is_asked_for_in_rpm_and_braking_where_the_cycle_brakes(
    monkeypatch, tmp_path
):
    drive, asked = rl.load(CUBIC), []
    room = import_module("reluctance.explore.efficiency_map")

    def over(given, *, omega, tau, u_dc, jobs, progress):
        asked.append((omega, tau, u_dc, jobs))
        omega = np.array([10.0, 20.0]) if omega is None else omega
        tau = np.array([1.0, 2.0]) if tau is None else tau
        grid = np.ones((len(omega), len(tau)))
        kinds = {"p_cu_W": grid}
        figures = dict.fromkeys(import_module(f"{room.__name__}.map").FIGURES, grid)
        return EfficiencyMap(
            given, 240.0, omega, tau, tau[-1] * grid[:, 0], grid, kinds, figures, 4
        )

    monkeypatch.setattr(room, "efficiency", over)
    given = ("--speed", "300:600:2", "--torque", "1,2", "--u-dc", "200", "--jobs", "1")
    done = command("efficiency", CUBIC, *given, "--out", tmp_path / "e.csv")
    assert done.code == 0, done.error
    ((omega, tau, u_dc, jobs),) = asked
    assert omega == pytest.approx([10 * np.pi, 20 * np.pi]) and tau.tolist() == [1, 2]
    assert (u_dc, jobs) == (200, 1) and str(tmp_path / "e.csv") in done.out
    assert f"{drive.name}, 240 V" in done.out
    for torques, count in (("1,1", 1), ("1,-1", 2)):
        asked.clear()
        first, second = torques.split(",")
        (tmp_path / "c.csv").write_text(f"t_s,speed_rpm,tau_Nm\n0,100,{first}\n1,100,{second}\n")
        done = command("efficiency", CUBIC, "--cycle", tmp_path / "c.csv", "--json")
        assert done.code == 0, done.error
        assert len(asked) == count and "E_in_J" in done.out
    assert asked[0][:2] == (None, None) and asked[1][1].tolist() == [-1, -2]


# tune, progress


def test_an_operating_point_is_keys_and_values():
    assert tune._point("load.speed_rpm=1000, reference.tau_Nm = 20") == {
        "load.speed_rpm": 1000, "reference.tau_Nm": 20,
    }  # fmt: skip
    for wrong in ("load.speed_rpm", "load.speed_rpm=", "=3", "a=1,,b=2"):
        with pytest.raises(ParameterError, match="need KEY=VALUE,KEY=VALUE"):
            tune._point(wrong)


def test_a_log_has_lines_of_where_the_work_is(monkeypatch, capsys):
    """Of the last that was told, in parts of the whole."""
    shows = []

    class Each:
        def __init__(self, seconds, show):
            shows.append((seconds, show))

        def __enter__(self):
            return None

        def __exit__(self, *_):
            return False

    monkeypatch.setattr(bars, "_each", Each)
    monkeypatch.setattr(bars, "EVERY_S", 10.0)
    with bars._in_lines("working", 4.0) as told:
        ((seconds, show),) = shows
        assert seconds == 10
        show()
        told(1.0)
        show()
        told(4.0)
        show()
    assert capsys.readouterr().err.splitlines() == [
        "working: 0 % after 10 s",
        "working: 25 % after 20 s",
        "working: 100 % after 30 s",
    ]


def test_what_a_command_shows_while_it_works_never_mixes_with_its_answer(monkeypatch):
    """It goes to the terminal of the errors, also where the answer goes to a file."""

    class Terminal(io.StringIO):
        def isatty(self):
            return True

    terminal, file = Terminal(), io.StringIO()
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setattr(sys, "stdout", file)
    with bars.working("building"):
        pass
    with bars.progress_bar("solving", 2.0) as told:
        told(1.0)
    assert "building" in terminal.getvalue() and file.getvalue() == ""


# export


def spent(cpu, most):
    return Cost("d", "L", cpu, 9, True, 1000.0, most, 20_480, 10_240, 0, 1000, ())


def test_a_firmware_package_is_told_with_its_cost_and_whether_it_fits(monkeypatch):
    """The verdict is of the cost on its own processor; the clock of the worst step of all."""
    made = Namespace(folder="out", law="Deadbeat", fingerprint=0xCAFE, table_bytes=2560)
    both = [spent("cortex-m4", 4000), spent("cortex-m7", 5000)]
    judged = []

    def verdict(drive, part, cost, gates, *, ported):
        judged.append((part.name, cost.cpu, gates, ported))
        return [(True, "time"), (len(judged) > 1, "flash")]

    monkeypatch.setattr(exporting.export, "firmware", lambda *_, **__: made)
    monkeypatch.setattr(exporting, "costs", lambda drive, steps: both)
    monkeypatch.setattr(exporting, "gates_of", lambda drive: {1})
    monkeypatch.setattr(exporting, "left_out", lambda drive, gates: ["the angle is ideal"])
    monkeypatch.setattr(exporting, "verdict", verdict)
    order = ("export", "firmware", CUBIC, "--out", "o")
    plain = command(*order).out
    assert plain.splitlines() == [
        "out: Deadbeat",
        "fingerprint 0x0000CAFE, tables 2.5 KiB; start with its README.md",
        "warning: the angle is ideal",
    ]
    first, second = (command(*order, "--mcu", name).out for name in ("stm32g474", "stm32h743"))
    assert "stm32g474: does not fit\n  yes  time\n  NO   flash\n" in first
    assert "stm32h743: fits\n  yes  time\n  yes  flash\n" in second
    assert judged == [
        ("stm32g474", "cortex-m4", {1}, False),
        ("stm32h743", "cortex-m7", {1}, False),
    ]
    command(*order, "--mcu", "stm32g474", "--port", "stm32g474")
    assert judged[-1] == ("stm32g474", "cortex-m4", {1}, True)
    cost = words(command(*order, "--cost").out)
    T_s = rl.load(CUBIC).control.T_s_us
    assert f"at one instruction a cycle: {5000 / T_s:.0f} MHz and more" in cost
    assert "instructions_max │ 4000 │ 5000" in cost and "cpu" not in cost
    shown = json.loads(command(*order, "--json", "--mcu", "stm32h743", "--cost").out)
    assert shown["fingerprint"] == "0x0000CAFE" and shown["tables_B"] == 2560
    assert shown["verdict"][0] == {"fits": True, "reason": "time"}
    assert [row["instructions_max"] for row in shown["cost"]] == [4000, 5000]
    assert "cost" not in json.loads(command(*order, "--json").out)


def test_steps_that_differ_are_counted_and_the_first_is_an_error(monkeypatch):
    answers = Namespace(status=[0, 0, 7])
    for different, first in ((0, None), (3, 2)):
        found = Namespace(
            steps=10, different=different, first=first, exact=not different, answers=answers
        )
        monkeypatch.setattr(exporting, "check_parity", lambda *_, found=found, **__: found)
        done = command("export", "parity", CUBIC)
        assert done.out == f"{10 - different} of 10 steps agree in every bit on cortex-m7\n"
        assert (done.code, bool(done.error)) == ((2, True) if different else (0, False))
        assert not different or "differ first at step 2; the status there is 7" in done.error
        shown = json.loads(command("export", "parity", CUBIC, "--json").out)
        assert shown == {"steps": 10, "different": different, "cpu": "cortex-m7"}


def test_units_and_blobs_are_told_with_what_they_are(monkeypatch):
    made = Namespace(name="d_drive", variables=12)
    monkeypatch.setattr(exporting.export, "fmu", lambda *_, **__: made)
    kind = Kind("EdgeMpc", "LeHuy", 3, "float")
    monkeypatch.setattr(exporting.export, "write_blob", lambda *_: kind)
    assert command("export", "fmu", CUBIC, "--out", "a.fmu").out == (
        "a.fmu: d_drive, 12 variables\n"
    )
    assert json.loads(command("export", "fmu", CUBIC, "--out", "a.fmu", "--json").out) == {
        "file": "a.fmu", "name": "d_drive", "variables": 12,
    }  # fmt: skip
    assert command("export", "blob", CUBIC, "--out", "a").out == (
        "a: EdgeMpc, LeHuy, 3 phases, float\n"
    )
    long = "a" * 90  # no line is broken within a name
    assert (
        f"{long}.fmu: d_drive, 12 variables\n"
        in command("export", "fmu", CUBIC, "--out", f"{long}.fmu").out
    )
    assert (
        f"{long}: EdgeMpc, LeHuy, 3 phases, float\n"
        in command("export", "blob", CUBIC, "--out", long).out
    )
    shown = json.loads(command("export", "blob", CUBIC, "--out", "a", "--json").out)
    assert shown["file"] == "a" and shown["n_phases"] == 3


# replay


def test_samples_that_differ_are_an_error_after_what_the_dump_holds(monkeypatch, tmp_path):
    held = dump(status=2, value=180.0, limit=150.0, fingerprint=0xAB).dump
    equal = Replayed(held, "over-current", 0, None)
    other = Replayed(held, "over-current", 3, Difference(12, "mode", "1", "2"))
    for found in (equal, other):
        monkeypatch.setattr(replay, "replay_dump", lambda *_, found=found: found)
        done = command("replay", "d.bin", "--drive", CUBIC)
        first = "40 samples, trigger at sample 30: over-current (180 A, above the limit of 150 A)\n"
        assert done.out == first + ("all 40 orders equal\n" if found.exact else "")
        assert found.exact or (
            "3 of 40 samples differ, first sample 12: `mode` is 1 of the target, 2 of the desk"
            in done.error
        )
        assert done.code == (0 if found.exact else 2)
        shown = json.loads(command("replay", "d.bin", "--drive", CUBIC, "--json").out)
        assert (shown["different"], shown["fingerprint"]) == (found.different, "0x000000AB")
        assert shown["first"] == (None if found.exact else vars(found.first))
    empty = Replayed(dump(samples=0).dump, "", 0, None)
    monkeypatch.setattr(replay, "replay_dump", lambda *_: empty)
    line = refused("replay", "d.bin", "--drive", CUBIC, "--plot", tmp_path / "p.png")
    assert "d.bin holds no samples; without --plot it is told what it holds" in line


@pytest.mark.parametrize(
    ("group", "one"), [("machine", "from-geometry"), ("export", "firmware"), ("map", "identify")]
)
def test_a_group_of_commands_alone_shows_its_help(group, one):
    done = command(group)
    assert done.code == 0 and one in done.out and "Usage" in done.out and not done.error


def machine(coupled, poles=(6, 4)):
    return Namespace(machine=Namespace(coupled=coupled, N_s=poles[0], N_r=poles[1]))


@pytest.mark.parametrize(
    ("drive", "given", "own", "told"),
    [
        (machine(False), ["machine=m.toml"], machine(True), 1),
        (machine(False), ["a.b=1", "machine=m.toml"], machine(True), 1),
        (machine(True), ["machine=m.toml"], machine(True), 0),
        (machine(False), ["a.b=1"], machine(True), 0),
        (machine(False), None, machine(True), 0),
        (machine(False), ["machine=m.toml"], machine(False), 0),
        (machine(False), ["machine=m.toml"], machine(True, (8, 4)), 0),
        (machine(False), ["machine=m.toml"], machine(True, (6, 8)), 0),
        (machine(False), ["machine=m.toml"], ParameterError("no machine"), 0),
    ],
)
def test_pairs_that_another_machine_lacks_are_told(monkeypatch, drive, given, own, told):
    """Where --set gives one of as many poles, and the drive file has one whose phases couple."""
    asked = []

    def load(file, others, *, trust):
        asked.append(others)
        if isinstance(own, Exception):
            raise own
        return own

    monkeypatch.setattr(exporting, "load_drive", load)
    lines = exporting._lost(drive, Path("d.toml"), given, False)
    assert len(lines) == told
    assert not told or "`reluctance map import --pairs d.toml` takes them over" in lines[0]
    assert all("machine=m.toml" not in others for others in asked)


# sweep


def swept(count, **more):
    """Points whose figures count up; the second of them failed, the third trips."""
    figures = {name: np.arange(count) + 0.5 for name in rl.Kpis.border_names()}
    figures["t_trip_s"] = np.full(count, np.nan)
    if count > 2:
        figures["t_trip_s"][2] = 0.25
    why = ["", "too weak", *[""] * (count - 2)]
    values = {"control.i_band_A": [1.0 + n for n in range(count)], "control.law": ["a"] * count}
    return Sweep("mine", values, figures, why, (count,), ran=2, known=1, **more)


def test_a_sweep_is_told_with_its_points_its_failures_and_its_files(monkeypatch, tmp_path):
    monkeypatch.setattr(rl, "sweep", lambda *_, **__: swept(3), raising=False)
    order = ("sweep", CUBIC, "--vary", "control.i_band_A=1:3:3")
    table = tmp_path / "t.csv"
    said = command(*order, "--table", table, "--figure", "i_rms").out
    lines = [line.split("│")[1:-1] for line in said.splitlines() if line.startswith("│")]
    cells = [[cell.strip() for cell in line] for line in lines]
    assert cells == [["1", "a", "0.5", "-"], ["2", "a", "1.5", "-"], ["3 !", "a", "2.5", "0.25"]]
    told = words(said)
    assert "3 points: 2 run now, 1 from the store" in told
    assert "note: 1 of them failed; the first: too weak" in told
    assert "the first: control.i_band_A = 3.0, control.law = a, at 0.25 s" in told
    assert said.rstrip().endswith(str(table)) and table.exists()
    assert str(tmp_path) not in command(*order).out
    shown = json.loads(command(*order, "--json").out)
    assert (shown["ran"], shown["known"], shown["failed"]) == (2, 1, 1)
    assert [p["why"] for p in shown["points"]] == [None, "too weak", None]
    assert [p["t_trip_s"] for p in shown["points"]] == [None, None, 0.25]


def test_of_many_points_those_are_shown_where_a_figure_is_least_or_most(monkeypatch):
    for count, rows in ((40, 40), (41, 3)):  # the first, the one that trips, and the last
        monkeypatch.setattr(rl, "sweep", lambda *_, n=count, **__: swept(n), raising=False)
        said = command("sweep", CUBIC, "--vary", "control.i_band_A=1:3:3", "--figure", "i_rms").out
        assert sum(line.startswith("│") for line in said.splitlines()) == rows
        assert ("where a figure is least or most" in words(said)) == (count > 40)
