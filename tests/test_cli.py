"""The command line as a user meets it."""

import json
import os
import pty
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

import reluctance as rl

ROOT = Path(__file__).parents[1]
RATED = str(ROOT / "examples" / "paper_rated.toml")
PROMISED = (
    "tau_mean_Nm torque_ripple_pp torque_error_rms i_rms_A i_peak_A p_cu_W p_mech_W p_in_W "
    "efficiency f_switch_Hz speed_mean_rpm speed_ripple_pp energy_residual control_period_s "
    "wall_s_per_sim_s"
).split()


def reluctance(*arguments, **options):
    command = [sys.executable, "-m", "reluctance.cli", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, **options)


def test_json_is_one_object_with_the_promised_keys_and_nothing_else():
    done = reluctance("run", RATED, "--until", "0.03", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    figures = json.loads(done.stdout)
    assert set(PROMISED) <= set(figures)
    without_data = {"p_fe_W", "p_sw_W"}
    assert {key for key, value in figures.items() if value is None} == without_data
    assert all(np.isfinite(v) for key, v in figures.items() if key not in without_data)


def test_key_figures_are_printed_with_units():
    done = reluctance("run", RATED, "--until", "0.03")
    assert done.returncode == 0
    for text in ("mean torque", "N m", "switching frequency", "kHz", "efficiency", "rpm"):
        assert text in done.stdout


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
    for name in ("t_s", "theta_m_rad", "speed_rpm", "u_dc_V", "tau_Nm"):
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


@pytest.mark.parametrize("ending", ["png", "svg", "html"])
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
        (["run", RATED, "--plot", "{dir}/run.pdf"], "need one of .html"),
        (["run", RATED, "--out", "{dir}/none/run.csv"], "does not exist"),
        (["run", RATED, "--untill", "1"], "--untill"),
        (["runn", RATED], "runn"),
    ],
)
def test_a_mistake_is_exit_2_and_leaves_no_file(tmp_path, arguments, says):
    arguments = [a.replace("{dir}", str(tmp_path)) for a in arguments]
    if "--out" not in arguments and "--plot" not in arguments and arguments[0] == "run":
        arguments += ["--out", str(tmp_path / "run.csv")]
    done = reluctance(*arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert says in done.stderr
    assert done.stdout == ""
    assert list(tmp_path.iterdir()) == []


def test_interrupting_a_run_leaves_no_file(tmp_path):
    path = tmp_path / "run.csv"
    command = [sys.executable, "-m", "reluctance.cli", "run", RATED, "--until", "60"]
    process = subprocess.Popen(
        [*command, "--record-us", "1000", "--out", str(path)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    time.sleep(4.0)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=20)
    assert process.returncode == 130
    assert "interrupted" in errors
    assert "Traceback" not in errors
    assert list(tmp_path.iterdir()) == []


def test_a_long_run_shows_progress_on_a_terminal_only():
    arguments = ["run", RATED, "--until", "15", "--json"]
    assert "simulating" not in reluctance(*arguments).stderr
    parent, child = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "reluctance.cli", *arguments],
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
    assert process.wait(timeout=60) == 0
    assert b"simulating paper_rated" in seen


def test_figures_of_a_run_that_has_not_settled_say_so():
    """A torque reference that steps within the evaluated half; held, it is settled."""
    rated = ROOT / "examples" / "paper_rated.toml"
    steps = ["reference.tau_Nm=", "reference.t_s=[0, 0.04, 0.04]", "reference.values=[20, 20, 40]"]
    assert rl.simulate(rl.load(rated), until=0.05, record=None).kpis.remarks() == []
    moved = rl.simulate(rl.load(rated, steps), until=0.05, record=None).kpis
    assert moved.torque_drift > 0.1
    assert any("has not settled" in remark for remark in moved.remarks())
