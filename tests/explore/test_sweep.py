"""Sweeps: every point once, whatever happens; the same figures as single runs."""

import json
import os
import random
import resource
import sqlite3
import subprocess
import sys
import threading
import time
from dataclasses import fields
from importlib import import_module
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from command import command, on_terminal, refused
from sweep_script import BANDS, DRIVE, UNTIL

import reluctance as rl
from reluctance.base.figures import save_figure
from reluctance.explore.sweeps.fingerprint import fingerprint
from reluctance.explore.sweeps.own_imports import own_imports
from reluctance.explore.sweeps.pareto import front
from reluctance.explore.sweeps.store import MARK, Row, Store
from reluctance.explore.sweeps.swept import figure_name
from reluctance.explore.sweeps.vary import grid, is_range, parsed, samples

SUPPORT = Path(__file__).parents[1] / "support"
EXAMPLES = SUPPORT.parents[1] / "examples"
CUBIC = EXAMPLES / "sharing_cubic.toml"
KILLS = int(os.environ.get("RELUCTANCE_KILLS", "4"))  # 50 in a proof by hand
QUICK = {"control.i_band_A": [0.5, 1.0, 2.0]}


@pytest.fixture(autouse=True)
def _own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RELUCTANCE_CACHE", str(tmp_path / "cache"))


def figures(store: Path) -> dict[float, tuple[float, ...]]:
    """All rows by the band that was varied, but for the time that a run took."""
    base = sqlite3.connect(store)
    assert base.execute("PRAGMA integrity_check").fetchone() == ("ok",)
    names = [n for n in rl.Kpis.border_names() if n != "wall_s_per_sim_s"]
    columns = ", ".join(f'"{n}"' for n in names)
    rows = base.execute(f'SELECT "values", {columns} FROM runs').fetchall()
    base.close()
    return {json.loads(values)["control.i_band_A"]: tuple(row) for values, *row in rows}


def test_figures_are_those_of_single_runs(tmp_path: Path) -> None:
    drive = rl.load(DRIVE)
    vary = {"control.i_band_A": [0.5, 2.0], "converter.u_dc_V": [200, 240, 300]}
    found = rl.sweep(drive, vary, until=UNTIL, out=tmp_path / "s.sqlite")
    assert (len(found), found.ran, found.known, found.failed) == (6, 6, 0, 0)
    for n, (band, u_dc) in enumerate(product(*vary.values())):
        alone = drive.with_values({"control.i_band_A": band, "converter.u_dc_V": u_dc})
        kpis = rl.simulate(alone, until=UNTIL, record=None).kpis.with_units()
        for name, value in kpis.items():
            if name != "wall_s_per_sim_s":
                assert found.figures[name][n] == pytest.approx(
                    np.nan if value is None else value, nan_ok=True, rel=1e-15
                )


def test_nothing_is_run_twice(tmp_path: Path) -> None:
    drive, store = rl.load(DRIVE), tmp_path / "s.db"
    first = rl.sweep(drive, QUICK, until=UNTIL, out=store)
    again = rl.sweep(drive, {"control.i_band_A": [2, 0.5, 2.0, 1.5]}, until=UNTIL, out=store)
    assert (first.ran, again.ran) == (3, 1)
    assert again.figure("f_switch")[:2].tolist() == first.figure("f_switch")[[2, 0]].tolist()
    other = rl.sweep(drive, QUICK, until=2 * UNTIL, out=store)
    assert other.ran == 3  # another end, another run


def test_the_key_is_that_of_all_that_a_run_depends_on(tmp_path: Path) -> None:
    drive = rl.load(DRIVE)
    key = fingerprint(drive, 0.1)
    assert key == fingerprint(rl.load(DRIVE, ["sensing.adc_bits=0", "load.J_kgm2=0"]), 0.1)
    for name, value in {
        "machine.R_ohm": 0.5,
        "machine.i_max_A": 199.0,
        "converter.u_dc_V": 241,
        "control.T_s_us": 21,
        "sensing.delay_samples": 1,
        "simulation.dt_max_us": 9,
        "mismatch.R_factor": 1.01,
        "load.J_kgm2": 0.01,
    }.items():
        assert fingerprint(drive.with_values({name: value}), 0.1) != key, name
    text = (EXAMPLES / "own_law" / "own_law.py").read_text()
    law = tmp_path / "law.py"
    law.write_text(text)
    own = rl.load(DRIVE, [f"control.law=python:{law}:RestOfTorque"], trust=True)
    before = fingerprint(own, 0.1)
    law.write_text(text + "\n# other\n")
    assert fingerprint(own, 0.1) != before


def test_what_an_own_law_imports_is_part_of_its_key(tmp_path: Path, monkeypatch) -> None:
    """A module, a package of that module, and what is imported within a function; no other."""
    monkeypatch.syspath_prepend(str(tmp_path / "own"))
    package = tmp_path / "own" / "packed"
    package.mkdir(parents=True)
    law, text = tmp_path / "law.py", (EXAMPLES / "own_law" / "own_law.py").read_text()
    law.write_text("def late():\n    from helper import part\n\n" + text)
    files = [package.parent / "helper.py", package / "__init__.py", package / "inner.py"]
    for file in files:
        file.write_text("")
    files[0].write_text("import json, numpy, packed.inner, no_such_module\n")
    (package.parent / "other.py").write_text("")
    assert own_imports(law) == sorted(files)
    drive = rl.load(DRIVE, [f"control.law=python:{law}:RestOfTorque"], trust=True)
    for file in files:
        before = fingerprint(drive, 0.1)
        file.write_text(file.read_text() + "x = 1\n")
        assert fingerprint(drive, 0.1) != before, file.name
    (package.parent / "other.py").write_text("x = 1\n")
    (package / "inner.py").write_text("import helper\nx = (\n")  # a ring, and no code
    assert own_imports(law) == sorted(files)


def test_points_that_fail_are_kept_with_their_reason(tmp_path: Path) -> None:
    drive, store = rl.load(DRIVE), tmp_path / "s.sqlite"
    vary = {"control.i_band_A": [1.0, -1.0], "load.speed_rpm": [1500, 0.0]}
    for ran in (2, 0):
        found = rl.sweep(drive, vary, until=UNTIL, out=store)
        assert found.ran == ran
        assert [bool(why) for why in found.why][2:] == [True, True]
        assert "i_band_A = -1" in found.why[2]
        assert np.isnan(found.figure("tau_mean")[2])


def test_a_failed_run_is_not_run_again(tmp_path: Path) -> None:
    drive = rl.load(
        DRIVE,
        ["load.kind=torque", "load.tau_Nm=-3000", "reference.tau_Nm=1", "load.speed_rpm=0"],
    )
    for ran in (3, 0):
        loads = {"load.tau_Nm": [-3000.0, -2500.0, 1.0]}
        found = rl.sweep(drive, loads, until=0.5, out=tmp_path / "s.db")
        assert found.ran == ran
        assert ["the speed is" in why for why in found.why] == [True, True, False]


@pytest.mark.long
def test_a_sweep_that_is_killed_goes_on_where_it_was(tmp_path: Path) -> None:
    """At random moments: what is in the store stays in it and is never begun again."""
    store, log = tmp_path / "s.sqlite", tmp_path / "log"
    chance = random.Random(KILLS)
    stored: set[float] = set()
    for _ in range(KILLS):
        log.write_text("")
        running = subprocess.Popen([sys.executable, SUPPORT / "sweep_script.py", store, log])
        while not log.read_text() and running.poll() is None:
            time.sleep(0.005)
        time.sleep(chance.uniform(0, 6.0 / KILLS))
        running.kill()
        running.wait()
        begun = [float(line) for line in log.read_text().split("\n")[:-1]]
        assert not stored & set(begun)
        now = set(figures(store)) if store.exists() else set()
        assert stored <= now
        assert len(now - stored) <= len(begun)
        stored = now
    log.write_text("")
    subprocess.run([sys.executable, SUPPORT / "sweep_script.py", store, log], check=True)
    begun = [float(line) for line in log.read_text().split()]
    assert sorted(begun) == sorted(set(BANDS) - stored)
    whole = figures(store)
    assert set(whole) == set(BANDS)
    some = BANDS[:: len(BANDS) // 5]
    drive = rl.load(DRIVE)
    rl.sweep(drive, {"control.i_band_A": some}, until=UNTIL, out=tmp_path / "other.sqlite")
    for band, row in figures(tmp_path / "other.sqlite").items():
        assert whole[band] == row


@pytest.mark.long
def test_a_full_disk_loses_nothing(tmp_path: Path) -> None:
    drive, store = rl.load(DRIVE), tmp_path / "s.sqlite"
    vary = {"control.i_band_A": [0.5 + n / 100 for n in range(300)]}
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (40_000, before[1]))
    try:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(import_module("reluctance.explore.sweeps.points"), "COMMIT_EVERY", 0.0)
            with pytest.raises(rl.ParameterError, match=r"cannot write .*goes on from there"):
                rl.sweep(drive, vary, until=0.01, out=store)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    kept = len(figures(store))
    assert kept > 10
    found = rl.sweep(drive, vary, until=0.01, out=store)
    assert (found.ran, found.known, found.failed) == (300 - kept, kept, 0)


def rows(start: int, count: int) -> list[Row]:
    return [Row(bytes([k] * 16), {}, {}) for k in range(start, start + count)]


@pytest.mark.parametrize("links", [True, False])
@pytest.mark.parametrize("older", [False, True])
def test_two_who_make_a_store_at_once_lose_no_row(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, links: bool, older: bool
) -> None:
    """One stops before each of its statements in turn, while the other opens the store and adds
    rows; the other adds more once the first is done. `older`: a store that lacks a figure."""
    connect, reached, go = sqlite3.connect, threading.Event(), threading.Event()
    stop, count, faults = 0, 0, []

    def traced(*given: Any, **more: Any) -> sqlite3.Connection:
        def step(_: str) -> None:
            nonlocal count
            count += 1
            if count == stop:
                reached.set()
                go.wait(0.03)  # not for ever: it may hold the lock that the other waits for

        base: sqlite3.Connection = connect(*given, **more)
        if threading.current_thread() is first:
            base.set_trace_callback(step)
        return base

    def make() -> None:
        try:
            store = Store(path)
            store.add(rows(0, 2))
            store.close()
        except Exception as fault:
            faults.append(fault)
        reached.set()

    def no_link(*_: object) -> None:
        raise PermissionError("no links here")

    if not links:
        monkeypatch.setattr(os, "link", no_link)
    monkeypatch.setattr(sqlite3, "connect", traced)
    while count >= stop:
        stop, count = stop + 1, 0
        path = tmp_path / f"{stop}.sqlite"
        if older:
            base = connect(path)
            base.execute(f"PRAGMA application_id = {MARK}")
            base.execute('CREATE TABLE runs ("key" BLOB PRIMARY KEY, "values" TEXT, "why" TEXT)')
            base.close()
        reached.clear()
        go.clear()
        first = threading.Thread(target=make)
        first.start()
        reached.wait()
        other = Store(path)
        other.add(rows(2, 2))
        go.set()
        first.join()
        other.add(rows(4, 2))
        other.close()
        assert not faults
        assert len(list(Store(path).known([row.key for row in rows(0, 6)]))) == 6
    assert stop > 5


@pytest.mark.parametrize(
    "change",
    [
        *(f"tau_mean_Nm = {value}" for value in ("'text'", "x'ff00'", "''", "9e999", "NULL")),
        *("tau_mean_Nm = tau_mean_Nm + 1e-12", "why = 'no'", "\"values\" = '{}'", "crc = NULL"),
        *("efficiency = tau_mean_Nm, tau_mean_Nm = NULL", '"key" = "key", crc = crc + 1'),
    ],
)
def test_a_changed_row_of_a_store_is_one_line(tmp_path: Path, change: str) -> None:
    drive, out = rl.load(DRIVE), tmp_path / "s.sqlite"
    rl.sweep(drive, {"control.i_band_A": [0.5]}, until=UNTIL, out=out)
    with sqlite3.connect(out) as base:
        (mark,) = base.execute("PRAGMA application_id").fetchone()
        assert mark == int.from_bytes(b"RELU", "big")  # of stores that older versions wrote, too
        base.execute(f"UPDATE runs SET {change}")
    base.close()
    with pytest.raises(rl.ParameterError, match=r"s\.sqlite is damaged: the row .*delete"):
        rl.sweep(drive, {"control.i_band_A": [0.5]}, until=UNTIL, out=out)


def test_rows_stay_known_where_a_figure_comes_new(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = list(rl.Kpis.border_names())
    figures = {name: 0.1 * n for n, name in enumerate(names)} | {names[1]: None, names[-1]: None}
    row = Row(bytes(16), {"a": 1}, figures)
    with monkeypatch.context() as older:
        older.setattr(rl.Kpis, "border_names", lambda: dict.fromkeys(names[:-1]))
        store = Store(tmp_path / "s.sqlite")
        store.add([row])
        store.close()
    (found,) = Store(tmp_path / "s.sqlite").known([row.key])
    assert found.figures == figures


def test_a_sweep_over_machines_is_drawn_as_a_page(tmp_path: Path) -> None:
    pytest.importorskip("bokeh")
    vary = {"machine": ["paper_6_4", "generic_60kw_6_4"]}
    found = rl.sweep(rl.load(EXAMPLES / "single_pulse.toml"), vary, until=UNTIL)
    save_figure(found.plot(["torque_ripple_rms"]), tmp_path / "x.html", title="x")
    assert "generic_60kw_6_4" in (tmp_path / "x.html").read_text()


def test_a_store_is_nothing_else(tmp_path: Path) -> None:
    (tmp_path / "text.sqlite").write_text("mine")
    other = sqlite3.connect(tmp_path / "other.db")
    other.execute("CREATE TABLE runs (a)")
    other.close()
    for name in ("text.sqlite", "other.db", "s.txt", "none/s.db"):
        with pytest.raises(rl.ParameterError):
            rl.sweep(rl.load(DRIVE), QUICK, until=UNTIL, out=tmp_path / name)
    assert (tmp_path / "text.sqlite").read_text() == "mine"


@pytest.mark.long
def test_a_cluster_of_two_workers_survives_the_loss_of_one(tmp_path: Path) -> None:
    script = SUPPORT / "cluster_script.py"
    store = tmp_path / "s.sqlite"
    done = subprocess.run(
        [sys.executable, script, store], capture_output=True, text=True, timeout=300
    )
    assert done.stdout.split() == ["2", "1", "80", "0"], done.stderr[-2000:]
    drive = rl.load(DRIVE)
    bands = [0.5 + n / 50 for n in range(0, 80, 20)]
    rl.sweep(drive, {"control.i_band_A": bands}, until=UNTIL, out=tmp_path / "t.db")
    there = figures(store)
    for band, row in figures(tmp_path / "t.db").items():
        assert there[band] == row


def test_no_scheduler_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from reluctance.explore.sweeps import cluster

    monkeypatch.setattr(cluster, "PATIENCE", 0.5)
    with pytest.raises(rl.ParameterError, match="no Dask scheduler answers"):
        rl.sweep(rl.load(DRIVE), QUICK, out=tmp_path / "s.db", cluster="tcp://127.0.0.1:9")


def test_values_on_the_command_line() -> None:
    assert parsed("a.b=0:60:4") == ("a.b", [0, 20, 40, 60])
    assert parsed("a.b=0:1:3") == ("a.b", [0.0, 0.5, 1.0])
    assert parsed("a.b=5:20") == ("a.b", [5, 20]) and is_range("a.b=5:20")
    listed = ("a.b=5:20:2", "a.b=5,20", "machine=a:b", "control.law=python:A.py", "a.b=1")
    assert not any(map(is_range, listed))
    assert parsed("a.b=1,2.5,5") == ("a.b", [1, 2.5, 5])
    assert parsed("a.b=[[1, 2], [3]]") == ("a.b", [[1, 2], [3]])
    assert parsed("machine=paper_6_4,m.toml") == ("machine", ["paper_6_4", "m.toml"])
    assert parsed("control.law=ditc,python:a.py:B") == ("control.law", ["ditc", "python:a.py:B"])
    for wrong in ("a.b", "a.b=", "a.b=1:2:x", "a.b=1:2:0", "a.b=1:2:3:4", "a.b=0:inf:3"):
        with pytest.raises(rl.ParameterError, match="need"):
            parsed(wrong)


@pytest.mark.parametrize(
    ("machine", "key", "ends"),
    [
        ("paper_6_4", "machine.R_ohm", "0.5:1:3"),
        ("paper_6_4", "machine.temp_w_degC", "20:100:3"),
        ("npf_vector_6_4", "machine.temp_w_degC", "20:100:3"),
    ],
)
def test_a_range_of_any_key_of_the_machine(
    machine: str, key: str, ends: str, tmp_path: Path
) -> None:
    own = ("--set", f"machine={machine}", "--set", "reference.tau_Nm=1", "--until", "0.02")
    varied = ("--vary", f"{key}={ends}", "--out", tmp_path / "s.db", "--json")
    done = command("sweep", DRIVE, *own, *varied)
    assert done.code == 0, done.error
    points = json.loads(done.out)["points"]
    assert [point[key] for point in points] == parsed(f"{key}={ends}")[1]
    losses = [point["p_cu_W"] for point in points]
    assert len(set(losses)) == 3 and None not in losses


def test_a_range_of_a_key_of_the_machine_is_tuned(tmp_path: Path) -> None:
    goal = ("--minimise", "p_cu_W", "--budget", "12", "--until", "0.02", "--json")
    done = command("tune", DRIVE, "--vary", "machine.R_ohm=0.5:1", *goal)
    assert done.code == 0, done.error
    assert 0.5 <= json.loads(done.out)["values"]["machine.R_ohm"] <= 0.55


def test_a_grid_has_all_combinations_and_the_last_key_is_fastest() -> None:
    assert grid({"a": [1, 2], "b": ["x", "y"]}) == {"a": [1, 1, 2, 2], "b": ["x", "y"] * 2}


def test_samples_stay_in_their_ranges_and_sobol_fills_them_evenly() -> None:
    drive = rl.load(DRIVE)
    vary = {
        "control.i_band_A": [0.5, 2.0],
        "sensing.adc_bits": [8, 11],
        "control.law": ["ditc", "deadbeat", "torque_sharing"],
    }
    for sobol in (True, False):
        found = samples(drive, vary, 64, sobol=sobol, seed=3)
        assert found == samples(drive, vary, 64, sobol=sobol, seed=3)
        bands = np.array(found["control.i_band_A"])
        assert 0.5 <= bands.min() and bands.max() <= 2.0
        assert set(found["sensing.adc_bits"]) == {8, 9, 10, 11}
        assert all(type(bits) is int for bits in found["sensing.adc_bits"])
        assert set(found["control.law"]) == {"ditc", "deadbeat", "torque_sharing"}
        if sobol:  # each of 64 equal cells has one point
            cells = np.floor((bands - 0.5) / 1.5 * 64).astype(int)
            assert sorted(cells.tolist()) == list(range(64))


def test_no_other_point_beats_one_of_the_front() -> None:
    generator = np.random.default_rng(1)
    for most in product((False, True), repeat=2):
        x, y = generator.random((2, 60)).round(1)
        x[::11] = np.nan
        a, b = (v * (-1 if m else 1) for v, m in zip((x, y), most, strict=True))
        kept = front(x, y, most)
        beaten = [
            any((a <= a[n]) & (b <= b[n]) & ((a < a[n]) | (b < b[n])))
            for n in range(60)
            if not np.isnan(a[n])
        ]
        points = {(a[n], b[n]) for n in kept}
        there = [n for n in range(60) if not np.isnan(a[n])]
        assert points == {(a[n], b[n]) for n, no in zip(there, beaten, strict=True) if not no}


def test_figures_go_by_either_name() -> None:
    assert figure_name("i_rms") == figure_name("i_rms_A") == "i_rms_A"
    with pytest.raises(rl.ParameterError, match="did you mean `i_rms_A`"):
        figure_name("i_rm")


def test_the_command_prints_what_was_run(tmp_path: Path) -> None:
    line = ("sweep", DRIVE, "--vary", "control.i_band_A=1,2", "--until", "0.02")
    out = ("--out", tmp_path / "s.db", "--table", tmp_path / "t.csv")
    first = command(*line, *out)
    assert "2 points: 2 run now, 0 from the store" in first.out
    told = json.loads(command(*line, *out, "--json").out)
    assert (told["ran"], told["known"], told["failed"]) == (0, 2, 0)
    assert [p["control.i_band_A"] for p in told["points"]] == [1, 2]
    header = (tmp_path / "t.csv").read_text().split("\n")[0]
    assert header.startswith("control.i_band_A,tau_mean_Nm") and header.endswith(",why")
    assert "none of the 1 points works" in refused(
        "sweep", DRIVE, "--vary", "control.i_band_A=-1", "--out", tmp_path / "s.db"
    )
    assert "--trust" in refused("sweep", DRIVE, "--vary", "control.law=python:a.py:B")
    for name, more in (("sweep", ()), ("tune", ("--minimise", "p_cu_W"))):
        twice = ("--vary", "machine.R_ohm=1:2", "--vary", "machine.R_ohm=3:4")
        told = "machine.R_ohm is there twice; give all of its values at once"
        assert told in refused(name, DRIVE, *twice, *more)


@pytest.mark.parametrize(
    ("speeds", "told"),
    [
        ("3000,6000", []),
        ("60,3000,120", ["run longer (--until); so it is at 2 of 3 points, the first: "]),
        ("0,60", ["standstill: the figures are over all", "no whole electrical period"]),
    ],
)
def test_figures_that_include_the_start_are_told_once_for_each_reason(
    speeds: str, told: list[str]
) -> None:
    line = ("sweep", CUBIC, "--set", "converter.u_dc_V=600", "--until", 0.03)
    done = command(*line, "--vary", f"load.speed_rpm={speeds}", "--json")
    lines = [x for x in done.error.splitlines() if "start" in x]
    assert len(lines) == len(told)
    assert all(part in line for part, line in zip(told, lines, strict=True))


def test_a_tuning_tells_points_that_include_the_start_though_others_do_not() -> None:
    line = ("tune", CUBIC, "--vary", "control.i_band_A=1:2", "--minimise", "i_rms", "--budget", 2)
    line = (*line, "--until", 0.03)
    points = ("--at", "load.speed_rpm=3000", "--at", "load.speed_rpm=60")
    assert "so it is at 2 of 2 points" in command(*line, *points).out
    assert "so it is" not in command(*line, *points[:2]).out


def test_no_number_of_the_table_is_cut_on_a_narrow_terminal() -> None:
    line = ("sweep", DRIVE, "--vary", "control.i_band_A=1,2", "--until", "0.02")
    found = {p["tau_mean_Nm"] for p in json.loads(command(*line, "--json").out)["points"]}
    shown = on_terminal(*line, "--vary", "converter.u_dc_V=240,241")
    assert "…" not in "".join(shown) and len({len(row) for row in shown if row[:1] == "│"}) == 1
    rows = [[cell.strip() for cell in row.split("│")[1:-1]] for row in shown if row[:1] == "│"]
    assert {f"{x:.4g}" for x in found} <= {row[2] for row in rows}


def test_a_table_of_twenty_columns_is_as_wide_as_its_numbers() -> None:
    line = ("sweep", DRIVE, "--vary", "control.i_band_A=1,2", "--until", "0.02")
    points = json.loads(command(*line, "--json").out)["points"]
    names = [name for name, x in points[0].items() if isinstance(x, float)]
    names = [name for name in names if not name.startswith("control.")][:18]
    shown = on_terminal(*line, "--figure", ",".join(names))
    rows = [[cell.strip() for cell in row.split("│")[1:-1]] for row in shown if row[:1] == "│"]
    assert [row[1:19] for row in rows] == [[f"{p[name]:.4g}" for name in names] for p in points]
    assert max(map(len, shown)) > 80


@pytest.mark.parametrize("kind", ["lines", "heat", "parallel", "pareto"])
def test_every_kind_of_figure_draws(kind: str) -> None:
    drive = rl.load(DRIVE)
    vary = {"control.i_band_A": [0.5, 1, 2], "converter.u_dc_V": [200, 240]}
    found = rl.sweep(drive, vary, until=UNTIL)
    drawn = found.plot(["torque_ripple_rms", "f_switch"], kind)
    for ax in drawn.axes:
        assert kind == "parallel" or (ax.get_xlabel() or ax.get_ylabel())


class Cluster:
    """What a sweep uses of Dask: two threads that work when they are asked for an answer."""

    def __init__(self, threads: int = 2, version: str = "", fault: str = "") -> None:
        self.threads, self.version, self.fault = threads, version, fault
        self.queue: list[Any] = []
        self.sizes: list[int] = []
        self.longest, self.loop = 0, None

    def __call__(self, *_: object, **__: object) -> "Cluster":  # Client(address), as_completed([])
        return self

    def __enter__(self) -> "Cluster":
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def nthreads(self) -> dict[str, int]:
        return {"one": self.threads}

    def run(self, asked: Any) -> dict[str, str]:
        return {"one": self.version or asked()}

    def submit(self, work: Any, task: Any, until: float | None, pure: bool) -> Any:
        assert not pure  # the same drive may be asked for again
        self.sizes.append(len(task))
        return lambda: work(task, until)

    def add(self, task: Any) -> None:
        self.queue.append(task)
        self.longest = max(self.longest, len(self.queue))

    def __next__(self) -> Any:
        work = self.queue.pop(0)
        status = "error" if self.fault else "finished"
        return SimpleNamespace(
            status=status, result=work, exception=lambda: RuntimeError(self.fault)
        )


def on(cluster: Cluster, monkeypatch: pytest.MonkeyPatch, count: int) -> list[Any]:
    import distributed

    from reluctance.explore.sweeps import cluster as module

    monkeypatch.setattr(distributed, "Client", cluster)
    monkeypatch.setattr(distributed, "as_completed", cluster)
    drive = rl.load(DRIVE)
    usual = {f.name: 0.0 for f in fields(rl.Kpis)}

    def run(drives: Any, *, until: float, jobs: int) -> Any:
        assert (until, jobs) == (0.004, 1)
        for n, made in drives:
            assert made == drive
            yield n, rl.ParameterError("slow") if n == 5 else rl.Kpis(**usual | {"i_rms": n})

    monkeypatch.setattr(module, "finished", run)
    return list(module.finished_on("tcp://here", ((n, drive) for n in range(count)), until=0.004))


def test_a_cluster_gets_eight_drives_a_task_and_three_tasks_a_thread(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    cluster = Cluster()
    found = dict(on(cluster, monkeypatch, 60))
    assert [*found] == [*range(60)] and cluster.sizes == [8] * 7 + [4]
    assert cluster.longest == 6 and not cluster.queue
    assert found[59].i_rms == 59
    assert isinstance(found[5], rl.ParameterError) and str(found[5]) == "slow"


@pytest.mark.parametrize(
    ("cluster", "told"),
    [
        (Cluster(threads=0), "has no workers; start one"),
        (Cluster(version="0.0.1 (other)"), "worker one has reluctance 0.0.1 .*same version on"),
        (Cluster(fault="killed"), "a task ended its workers: .*killed; what has been stored"),
    ],
)
def test_a_cluster_that_cannot_serve_says_why(
    cluster: Cluster, told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(rl.ParameterError, match=told):
        on(cluster, monkeypatch, 3)


def test_more_rows_than_one_question_takes_are_all_known(tmp_path: Path) -> None:
    names = list(rl.Kpis.border_names())
    many = [Row(n.to_bytes(16, "big"), {}, {names[0]: float(n)}) for n in range(1203)]
    store = Store(tmp_path / "s.sqlite")
    store.add(many)
    found = {row.key: row.figures[names[0]] for row in store.known([row.key for row in many])}
    assert found == {row.key: row.figures[names[0]] for row in many}
    assert many[5].key in store and bytes([255] * 16) not in store
    store.close()


def test_points_are_either_a_sequence_or_random_and_repeat_with_their_seed(
    tmp_path: Path,
) -> None:
    drive, vary = rl.load(DRIVE), {"control.i_band_A": [0.5, 2.0]}
    with pytest.raises(rl.ParameterError, match="either sobol or random"):
        rl.sweep(drive, vary, sobol=4, random=4)
    with pytest.raises(rl.ParameterError, match="sweep takes a Drive, not 'x'"):
        rl.sweep("x", vary)  # type: ignore[arg-type]
    given = {"until": 0.002, "out": tmp_path / "s.db"}
    even = rl.sweep(drive, vary, sobol=2, seed=1, **given)  # type: ignore[arg-type]
    found = rl.sweep(drive, vary, random=2, seed=1, **given)  # type: ignore[arg-type]
    assert even.values == samples(drive, vary, 2, sobol=True, seed=1) != found.values
    assert found.values == samples(drive, vary, 2, sobol=False, seed=1) and found.grid == ()
    again = rl.sweep(drive, vary, random=2, seed=1, **given)  # type: ignore[arg-type]
    assert (again.ran, again.known, again.values) == (0, 2, found.values)
    first = rl.sweep(drive, vary, random=2, **given)  # type: ignore[arg-type]
    assert first.values == samples(drive, vary, 2, sobol=False, seed=0)
    with pytest.raises(rl.ParameterError, match="samples = 0"):
        rl.sweep(drive, vary, sobol=0)


def test_a_table_of_a_sweep_has_its_rows(tmp_path: Path) -> None:
    drive = rl.load(DRIVE)
    found = rl.sweep(drive, {"control.i_band_A": [1, 2]}, until=0.002, out=tmp_path / "s.db")
    found.save(tmp_path / "t.csv")
    table = np.genfromtxt(tmp_path / "t.csv", delimiter=",", names=True, usecols=range(4))
    assert [*table["controli_band_A"]] == [1, 2]
    assert table["tau_mean_Nm"] == pytest.approx(found.figure("tau_mean"))
    assert len(fingerprint(drive, 0.1)) == 16  # 128 bits
