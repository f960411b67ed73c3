"""The command line as a user meets it."""

import json
import os
import pty
import re
import signal
import subprocess
import sys
import tomllib
from contextlib import redirect_stdout
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from command import command, on_terminal, refused, wait_until_at_work
from scipy.io import loadmat

import reluctance as rl
from reluctance.base.interactive import MOST_POINTS, thinned
from reluctance.cli import app, export, progress

ROOT = Path(__file__).parents[2]
RATED = str(ROOT / "examples" / "paper_rated.toml")
PROMISED = (
    "tau_mean_Nm torque_ripple_pp torque_error_rms i_rms_A i_peak_A p_cu_W p_mech_W p_in_W "
    "efficiency f_switch_Hz speed_mean_rpm speed_ripple_pp energy_residual control_period_s "
    "wall_s_per_sim_s"
).split()


def reluctance(*arguments, **options):
    command = [sys.executable, "-m", "reluctance", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, **options)


def test_json_is_one_object_with_the_promised_keys_and_nothing_else():
    done = reluctance("run", RATED, "--until", "0.03", "--json")
    assert done.returncode == 0
    assert [line.partition(":")[0] for line in done.stderr.splitlines()] == ["note"]
    figures = json.loads(done.stdout)
    assert set(PROMISED) <= set(figures)
    assert figures.pop("by_rule") == {"tau_max_Nm": 41.339}
    without_data = {"p_fe_W", "p_sw_W", "Q_mean_m3ph", "tracking", "t_trip_s"}  # nor pump, array
    assert {key for key, value in figures.items() if value is None} == without_data
    assert all(np.isfinite(v) for key, v in figures.items() if key not in without_data)


def test_key_figures_are_printed_with_units():
    done = reluctance("run", RATED, "--until", "0.03")
    assert done.returncode == 0
    for text in ("mean torque", "N m", "switching frequency", "kHz", "efficiency", "rpm"):
        assert text in done.stdout
    assert done.stdout.endswith("[control] by rule: tau_max_Nm = 41.339\n")


@pytest.mark.long
def test_every_format_holds_the_same_waveforms(tmp_path):
    read = {
        "csv": lambda p: dict(
            zip(
                p.read_text().split("\n", 1)[0].split(","),
                np.loadtxt(p, delimiter=",", skiprows=1).T,
                strict=True,
            )
        ),
        "npz": lambda p: dict(np.load(p)),
        "parquet": lambda p: _parquet(p),
        "mat": lambda p: {k: v.ravel() for k, v in loadmat(p).items() if not k.startswith("__")},
    }
    tables = {}
    for ending, reader in read.items():
        path = tmp_path / f"run.{ending}"
        done = reluctance("run", RATED, "--until", "0.002", "--out", str(path), "--json")
        assert done.returncode == 0, done.stderr
        tables[ending] = reader(path)
    csv = tables["csv"]
    for name in ("t_s", "theta_m_deg", "speed_rpm", "u_dc_V", "tau_Nm"):
        assert name in csv
    for phase in "abc":
        for name in (f"i_{phase}_A", f"u_{phase}_V", f"psi_{phase}_Wb", f"tau_{phase}_Nm"):
            assert name in csv
        assert set(np.unique(csv[f"leg_{phase}"])) <= {-1, 0, 1}
    total = sum(csv[f"tau_{phase}_Nm"] for phase in "abc")
    assert csv["tau_Nm"] == pytest.approx(total, abs=1e-12)
    for ending, table in tables.items():
        for name, column in csv.items():
            assert np.array_equal(table[name], column), (ending, name)


def _parquet(path):
    import pyarrow.parquet

    table = pyarrow.parquet.read_table(path)
    return {name: table[name].to_numpy() for name in table.column_names}


def test_a_record_grid_thins_the_waveforms(tmp_path):
    path = tmp_path / "run.npz"
    options = ("--until", "0.002", "--record-us", "50", "--out", str(path), "--json")
    assert reluctance("run", RATED, *options).returncode == 0
    assert np.load(path)["t_s"] == pytest.approx(np.arange(41) * 50e-6, abs=1e-12)


@pytest.mark.parametrize(
    "ending", ["png", *(pytest.param(x, marks=pytest.mark.long) for x in ("svg", "pdf", "html"))]
)
def test_plots_are_written_and_reproducible(tmp_path, ending):
    paths = [tmp_path / f"{name}.{ending}" for name in ("one", "two")]
    for path in paths:
        done = reluctance("run", RATED, "--until", "0.025", "--plot", str(path), "--json")
        assert done.returncode == 0, done.stderr
    assert paths[0].stat().st_size > 10_000
    if ending != "html":  # the page names the wall time
        assert paths[0].read_bytes() == paths[1].read_bytes()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["run", "nowhere.toml"], "cannot read nowhere.toml"),
        (["run", RATED, "--set", "control.T_s_us=0"], "need > 0"),
        (["run", RATED, "--until", "0"], "until"),
        (["run", RATED, "--until", "nan"], "until"),
        (["run", RATED, "--out", "{dir}/run.xls"], "need one of .csv"),
        (["run", RATED, "--plot", "{dir}/run.gif"], "need one of .html, .pdf, .png, .svg"),
        (["run", RATED, "--out", "{dir}/none/run.csv"], "does not exist"),
        (["run", RATED, "--untill", "1"], "--untill"),
        (["runn", RATED], "runn"),
    ],
)
def test_a_mistake_is_exit_2_and_leaves_no_file(tmp_path, monkeypatch, arguments, says):
    monkeypatch.chdir(tmp_path)
    arguments = [a.replace("{dir}", str(tmp_path)) for a in arguments]
    if "--out" not in arguments and "--plot" not in arguments and arguments[0] == "run":
        arguments += ["--out", str(tmp_path / "run.csv")]
    done = command(*arguments)
    assert (done.code, done.out) == (2, "")
    assert says in done.error
    assert list(tmp_path.iterdir()) == []


def test_interrupting_a_run_leaves_no_file(tmp_path):
    path = tmp_path / "run.csv"
    command = [sys.executable, "-m", "reluctance", "run", RATED, "--until", "1000"]
    process = subprocess.Popen(
        [*command, "--record-us", "10000", "--out", str(path)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    wait_until_at_work(process)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate()
    assert process.returncode == 130
    assert "interrupted" in errors
    assert "Traceback" not in errors
    assert list(tmp_path.iterdir()) == []


def test_a_log_has_a_line_of_progress_now_and_then(monkeypatch, capsys):
    """Also before the work has told anything. Each pass of the loop ends with a line."""
    monkeypatch.setattr(progress, "EVERY_S", 1e-3)
    seen = ""
    with progress.progress_bar("solving", 2.0) as told:
        for reached in (None, 1.0, 2.0):
            if reached is not None:
                told(reached)
            line = f"solving: {50 * (reached or 0.0):.0f} % after"
            while line not in seen:
                shown = capsys.readouterr()
                assert shown.out == ""
                seen += shown.err
    told_shares = (line.partition(" after")[0] for line in seen.splitlines())
    assert [*dict.fromkeys(told_shares)] == [f"solving: {x} %" for x in (0, 50, 100)]


def test_a_long_run_shows_a_bar_on_a_terminal():
    arguments = ["run", RATED, "--until", "40", "--json"]
    parent, child = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "reluctance", *arguments],
        stdout=subprocess.DEVNULL,
        stderr=child,
        env={**os.environ, "TERM": "xterm"},
    )
    os.close(child)
    seen = b""
    try:
        while chunk := os.read(parent, 4096):
            seen += chunk
    except OSError:  # the terminal closes with the process
        pass
    assert process.wait() == 0
    assert b"simulating paper_rated" in seen


def test_figures_of_a_run_that_has_not_settled_say_so():
    """A torque reference that steps within the evaluated half; held, it is settled."""
    rated = ROOT / "examples" / "paper_rated.toml"
    steps = ["reference.tau_Nm=", "reference.t_s=[0, 0.04, 0.04]", "reference.values=[20, 20, 40]"]
    assert rl.simulate(rl.load(rated), until=0.05, record=None).kpis.remarks() == []
    moved = rl.simulate(rl.load(rated, steps), until=0.05, record=None).kpis
    assert moved.torque_drift > 0.1
    assert any("has not settled" in remark for remark in moved.remarks())


NOTES = {
    "speed": (
        *("reference.kind=speed", "reference.speed_rpm=900", "reference.tau_Nm=", "load.kind=fan"),
        *("load.k_fan_Nms2=0.01", "control.tau_max_Nm=10", "simulation.until_s=0.5"),
    ),
    "standstill": ("load.speed_rpm=0",),
    "diagnosis": ("protection.diagnosis=true",),
    "trip": (
        *("supervision.enable_s=0", "protection.diagnosis=true", "simulation.until_s=0.12"),
        *("faults.0.kind=open_wire", "faults.0.t_s=0.08", "faults.0.phase=b"),
    ),
}
SAID = {
    "speed": "the speed reference is not held (33% of it)",
    "standstill": "no electrical period ends at standstill",
    "diagnosis": "set [supervision] enable_s",
    "trip": "the drive trips at 0.08",
}


@pytest.mark.parametrize("name", NOTES)
def test_a_note_says_what_a_reader_must_know_and_no_wrong_remedy(name):
    changes = [word for change in NOTES[name] for word in ("--set", change)]
    done = command("run", ROOT / "examples" / "deadbeat.toml", *changes)
    said = " ".join(done.out.split())
    assert (done.code, done.error) == (0, "")
    assert SAID[name] in said
    assert ("--until" in said) == (name == "speed")
    if name == "trip":
        lines = done.out.splitlines()
        order = ["ready", "run", "planted: open_wire, phase b", "fault: "]
        at = [next(n for n, line in enumerate(lines) if f" s  {text}" in line) for text in order]
        assert at == sorted(at)
        assert "phase 1 (b): " in said


def test_a_trip_that_is_cleared_before_the_evaluated_half_is_no_note():
    again = {"fault": "over_current", "fault_s": 0.08, "clear_s": 0.09, "restart_s": 0.1}
    changes = [f"supervision.{key}={value}" for key, value in {"enable_s": 0, **again}.items()]
    words = [word for change in changes for word in ("--set", change)]
    for end, said in ((0.5, False), (0.3, True)):  # it runs again at 0.17 s
        done = command("run", ROOT / "examples" / "deadbeat.toml", *words, "--until", str(end))
        assert ("the drive trips at 0.08" in done.out) == said


def test_the_program_alone_prints_its_help():
    for group in ((), ("map",), ("export",)):
        done = command(*group)
        assert (done.code, done.error) == (0, "")
        assert "Usage:" in done.out and "Commands:" in done.out


def test_examples_are_listed_shown_and_copied(tmp_path):
    listed = command("examples").out
    names = {path.stem for path in (ROOT / "examples").glob("*.toml")}
    table, _, next_commands = listed.partition("next: ")
    assert names == {line.split()[0] for line in table.splitlines()}
    assert "reluctance run NAME.toml" in next_commands and "sun_day" in next_commands
    shown = (ROOT / "examples" / "ditc.toml").read_text()
    assert command("examples", "ditc").out == shown
    assert command("examples", "ditc", "--copy", tmp_path).code == 0
    assert (tmp_path / "ditc.toml").read_text() == shown
    (tmp_path / "ditc.toml").write_text("mine")
    assert "exists" in refused("examples", "--copy", tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["ditc.toml"]
    assert (tmp_path / "ditc.toml").read_text() == "mine"
    assert "did you mean `ditc`" in refused("examples", "dict")
    assert command("examples", "--copy", tmp_path / "all").code == 0
    assert {p.stem for p in (tmp_path / "all").glob("*.toml")} == names


def test_comments_of_the_examples_stand_in_one_column():
    """Two spaces behind the longest name, also where they go on in a second line."""
    lines = [line for line in on_terminal("examples") if not line.startswith(("next", "for a"))]
    names = {path.stem for path in (ROOT / "examples").glob("*.toml")}
    column = max(map(len, names)) + 2
    assert {line[:column].strip() for line in lines} - {""} <= names
    listed = [line for line in lines if line.split()[0] in names]
    assert len(listed) == len(names)
    for line in lines:
        assert line[column - 2 : column] == "  " and line[column] != " "
    assert any(line.startswith(" " * column) for line in lines)


def test_key_figures_of_target_and_desk_stand_in_columns_that_end_alike(monkeypatch):
    kpis = rl.simulate(rl.load(RATED), until=0.02, record=None).kpis
    pair = replace(kpis, tau_mean=41.25), replace(kpis, tau_mean=41.123456789)
    monkeypatch.setattr(export, "in_the_loop", lambda *_, **__: pair)
    lines = command("export", "pil", RATED).out.splitlines()
    (row,) = [line for line in lines if "tau_mean_Nm" in line]
    cells = row.strip("│┃ ").split("│")
    assert [cell.strip() for cell in cells] == ["tau_mean_Nm", "41.25", "41.1234568"]
    assert cells[0].startswith("tau_mean") and cells[1].endswith("41.25 ")
    found = json.loads(command("export", "pil", RATED, "--json").out)
    given = command("export", "pil", RATED, "--json", "--set", "supervision.enable_s=0")
    assert "[supervision] is left out" in given.error and json.loads(given.out) == found
    assert [found[of]["tau_mean"] for of in ("target", "desk")] == [41.25, 41.123456789]
    short = replace(kpis, periods=1)
    monkeypatch.setattr(export, "in_the_loop", lambda *_, **__: (short, short))
    told = " ".join(command("export", "pil", RATED).out.split())
    assert "note: one whole electrical period is evaluated" in told


def test_one_machine_is_shown_with_its_file():
    shown = command("machines", "paper_6_4").out
    assert "6/4, three phases" in shown and "psi_m_Wb" in shown and "generic_60kw" not in shown
    assert json.loads(command("machines", "paper_6_4", "--json").out)["N_r"] == 4
    assert "did you mean `paper_6_4`" in refused("machines", "paper_64")


def test_the_schema_accepts_every_example_and_refuses_what_load_refuses(tmp_path):
    import jsonschema

    schema = json.loads(command("schema").out)
    jsonschema.Draft202012Validator.check_schema(schema)
    judge = jsonschema.Draft202012Validator(schema)
    examples = [tomllib.loads(p.read_text()) for p in (ROOT / "examples").glob("*.toml")]
    drives = [data for data in examples if "control" in data]
    assert len(drives) >= 15
    for data in drives:
        assert judge.is_valid(data), list(judge.iter_errors(data))[:1]
    for table, key, value in (
        ("converter", "u_dv_V", 240),
        ("control", "i_bnd_A", 1),
        ("simulation", "until_s", -1),
        ("load", "kind", "lokced"),
        ("xyz", "a", 1),
    ):
        wrong = json.loads(json.dumps(drives[0]))
        wrong.setdefault(table, {})[key] = value
        assert not judge.is_valid(wrong), (table, key)
    out = tmp_path / "drive.schema.json"
    assert "#:schema" in command("schema", "--out", out).out
    assert json.loads(out.read_text()) == schema


def test_the_shell_completes_commands_and_names():
    program = Path(sys.executable).with_name("reluctance")
    asked = {"_RELUCTANCE_COMPLETE": "complete_bash", "COMP_CWORD": "2"}
    cases = {"reluctance machines pap": "paper_6_4", "reluctance examples di": "ditc"}
    for words, wanted in cases.items():
        environment = {**os.environ, **asked, "COMP_WORDS": words}
        done = subprocess.run([program], env=environment, capture_output=True, text=True)
        assert done.stdout.split() == [wanted], done.stderr


def test_a_page_with_zoom_needs_no_network_and_keeps_every_peak(tmp_path):
    page = tmp_path / "run.html"
    assert command("run", RATED, "--until", "0.03", "--plot", page).code == 0
    text = page.read_text()
    for needed in ("torque (N m)", "current (A)", "phase a", "WheelZoomTool", "HoverTool"):
        assert needed in text
    assert not re.search(r"<(script|link|img)[^>]+(src|href)=.?https?:", text)
    assert len(text) < 4e6
    x = np.arange(200_000.0)
    y = np.sin(x)
    y[[777, 123_456]] = 50, -50
    thin_x, thin_y = thinned(x, y)
    assert len(thin_x) <= MOST_POINTS + 2
    assert {50.0, -50.0} <= set(thin_y)
    assert np.all(np.diff(thin_x) > 0)


def test_without_bokeh_a_page_is_one_line_with_the_remedy(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "bokeh", None)
    line = refused("run", RATED, "--plot", tmp_path / "run.html")
    assert "pip install 'reluctance[html]'" in line


def test_every_command_that_draws_has_the_same_formats(tmp_path):
    for arguments in (("run", RATED), ("limit", RATED), ("compare", RATED)):
        line = refused(*arguments, "--plot", tmp_path / "w.bmp")
        assert "need one of .html, .pdf, .png, .svg" in line


def test_a_plot_of_a_result_is_written_where_a_path_is_given(tmp_path):
    result = rl.simulate(rl.load(ROOT / "examples" / "sharing_cubic.toml"), until=0.01)
    result.plot(tmp_path / "x.png")
    result.plot(str(tmp_path / "x.pdf"))
    assert (tmp_path / "x.png").read_bytes()[1:4] == b"PNG" and (tmp_path / "x.pdf").exists()
    with pytest.raises(rl.ParameterError, match=r"x\.doc"):
        result.plot(tmp_path / "x.doc")


def test_the_address_of_the_studio_is_out_before_it_serves(tmp_path, monkeypatch):
    """In a file or a pipe, too."""
    written, seen = tmp_path / "out", []
    server = SimpleNamespace(
        server_port=4711,
        serve_forever=lambda: seen.append(written.read_text()),
        server_close=lambda: None,
    )
    monkeypatch.setattr("reluctance.targets.studio.serve", lambda port: server)
    with written.open("w") as out, redirect_stdout(out):
        app(["studio", "--no-browser"], standalone_mode=False)
    assert "http://127.0.0.1:4711/" in seen[0]
