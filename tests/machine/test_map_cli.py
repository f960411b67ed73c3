"""From somebody's flux table to a closed loop, as typed on the command line."""

import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from reluctance import ParameterError, _core, load
from reluctance.cli import app
from reluctance.machine.maps import write_map

ROOT = Path(__file__).parents[2]
SHARING = str(ROOT / "examples" / "sharing_cubic.toml")
MACHINE = _core.LeHuy(N_r=6, L_u=8.7e-3, L_a=0.25, L_sat=0.5e-3, i_m=5, psi_m=0.3)
WINDING = ("--N_s", "8", "--R_ohm", "2.15", "--J_kgm2", "0.004")


def reluctance(*arguments, fails=None):
    """What a command prints; with `fails`, its exit code, or the line of a ParameterError."""
    done = CliRunner().invoke(app, [str(a) for a in arguments])
    if isinstance(done.exception, ParameterError):
        assert fails == "line", done.exception
        assert "\n" not in str(done.exception)
        return str(done.exception)
    assert done.exit_code == (fails or 0), done.output
    return done.output


def fe_csv(path, *, torque=1.0, noise=0.0):
    """As a finite-element tool writes it: mechanical degrees from alignment, torque along them."""
    random = np.random.default_rng(0)
    lines = ["current_A,angle_deg,flux_Wb,torque_Nm"]
    for i in np.arange(0, 5.01, 0.25):
        for degrees in np.arange(0, 30.1, 1.5):
            theta_e = np.pi - 6 * np.radians(degrees)
            psi, _, tau = _core.magnetics(MACHINE, np.array([i]), np.array([theta_e]))[0, :3]
            psi *= 1 + noise * random.normal()
            lines.append(f"{i:g},{degrees:g},{psi:.8g},{-torque * tau:.8g}")
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture
def fe(tmp_path):
    return fe_csv(tmp_path / "fe.csv")


def test_three_commands_from_a_table_to_a_closed_loop(fe, tmp_path):
    told = reluctance("map", "check", fe, "--N_r", 6)
    assert "good" in told
    assert "read as: angle zero read as aligned" in told
    motor = tmp_path / "motor.toml"
    told = reluctance("map", "import", fe, "--N_r", 6, *WINDING, "--out", motor)
    assert f"--set machine={motor}" in told
    set_ = ["--set", f"machine={motor}", "--set", "reference.tau_Nm=2"]
    set_ += ["--set", "control.i_band_A=0.1", "--set", "load.speed_rpm=600"]
    figures = json.loads(reluctance("run", SHARING, *set_, "--json"))
    assert figures["tau_mean_Nm"] == pytest.approx(2.0, rel=0.02)
    assert abs(figures["energy_residual"]) < 1e-6
    assert figures["beyond_map"] == 0


def test_the_imported_machine_is_the_one_that_was_sampled(fe, tmp_path):
    motor = tmp_path / "motor.toml"
    reluctance("map", "import", fe, "--N_r", 6, *WINDING, "--out", motor, "--i_max_A", 4)
    table = tomllib.loads(motor.read_text())["machine"]
    assert (table["N_s"], table["N_r"], table["n_phases"]) == (8, 6, 4)
    assert (table["R_ohm"], table["J_kgm2"], table["i_max_A"]) == (2.15, 0.004, 4.0)
    fit = json.loads(reluctance("map", "fit", motor, "--json"))["lehuy"]
    expected = dict(L_u_H=8.7e-3, L_a_H=0.25, L_sat_H=0.5e-3, psi_m_Wb=0.3)
    for key, value in expected.items():
        assert fit[key] == pytest.approx(value, rel=1e-3), key


def test_json_of_a_check_is_the_whole_report(fe):
    report = json.loads(reluctance("map", "check", fe, "--N_r", 6, "--i_max_A", 10, "--json"))
    assert report["verdict"] == "good"
    assert report["extrapolation_share"] == pytest.approx(0.5)
    assert report["torque_error_rms"] < 1e-3
    assert (report["n_i"], report["n_theta"]) == (21, 21)
    assert len(report["notes"]) == 3


def test_an_inertia_in_another_unit_is_asked_about(tmp_path, monkeypatch):
    """0.004 kg m2 are 40 kg cm2 and 40000 g cm2."""
    monkeypatch.chdir(tmp_path)
    fe_csv(tmp_path / "fe.csv")
    for value in ("40", "40000"):
        line = ("map", "import", "fe.csv", "--N_r", 6, *WINDING[:-1], value)
        told = reluctance(*line, "--out", "motor.toml", fails="line")
        assert f"--J_kgm2 {value}, need at most" in told and "1 g cm2 is 1e-7" in told
        most, torque = map(float, re.search(r"at most (\S+): .* phase, (\S+) N m", told).groups())
        assert most == pytest.approx(0.1 * torque, rel=0.01)  # 10 s to 1000 rpm
    assert not Path("motor.toml").exists()


def test_a_resistance_in_milliohm_is_asked_about(tmp_path, monkeypatch):
    """2.15 ohm are 2150 milliohm; the same in ohm, as the advice says, is taken."""
    monkeypatch.chdir(tmp_path)
    fe_csv(tmp_path / "fe.csv")
    line = ("map", "import", "fe.csv", "--N_r", 6, "--N_s", "8", "--J_kgm2", "0.004")
    told = reluctance(*line, "--R_ohm", "2150", "--out", "motor.toml", fails="line")
    psi = _core.magnetics(MACHINE, np.array([5.0]), np.array([np.pi]))[0, 0]
    most = f"{psi / (5e-4 * 5):.3g}"  # at the last current it falls in half a millisecond
    assert f"--R_ohm 2150, need at most {most}:" in told and "1000 milliohm are 1 ohm" in told
    assert not Path("motor.toml").exists()
    reluctance(*line, "--R_ohm", "2.15", "--out", "motor.toml")


def test_a_refused_map_leaves_nothing_behind_without_a_reason(tmp_path):
    bad = fe_csv(tmp_path / "bad.csv", torque=1.2)
    assert "refused" in reluctance("map", "check", bad, "--N_r", 6, fails=1)
    motor = tmp_path / "motor.toml"
    line = reluctance("map", "import", bad, "--N_r", 6, *WINDING, "--out", motor, fails="line")
    assert "Nothing is written" in line
    assert [p.name for p in tmp_path.iterdir()] == ["bad.csv"]


def test_a_reason_goes_into_the_machine_file_and_is_kept(tmp_path):
    bad = fe_csv(tmp_path / "bad.csv", torque=1.2)
    motor = tmp_path / "motor.toml"
    reason = 'torque of the "long" stack \\ other run'
    arguments = ("map", "import", bad, "--N_r", 6, *WINDING, "--out", motor)
    reluctance(*arguments, "--accept", reason)
    assert tomllib.loads(motor.read_text())["machine"]["accepted_because"] == reason
    told = reluctance("map", "check", motor)
    assert "refused: torque" in told
    assert "accepted" in told
    before = motor.read_text()
    reluctance("map", "check", motor, "--accept", "second thought")
    changed = [
        b for a, b in zip(before.split("\n"), motor.read_text().split("\n"), strict=True) if a != b
    ]
    assert changed == ['accepted_because = "second thought"']


def test_accepting_a_good_map_stores_nothing(fe, tmp_path):
    motor = tmp_path / "motor.toml"
    arguments = ("map", "import", fe, "--N_r", 6, *WINDING, "--out", motor)
    reluctance(*arguments, "--accept", "to be safe")
    assert "accepted_because" not in motor.read_text()


def test_repair_writes_a_map_that_passes_and_says_what_it_changed(tmp_path):
    noisy = fe_csv(tmp_path / "noisy.csv", noise=0.01)
    assert "noise" in reluctance("map", "check", noisy, "--N_r", 6, fails=1)
    mended = tmp_path / "mended.csv"
    told = reluctance("map", "check", noisy, "--N_r", 6, "--repair", mended)
    assert "repair: repaired: flux changed by" in told
    assert json.loads(reluctance("map", "check", mended, "--N_r", 6, "--json"))["noise"] < 3e-3
    motor = tmp_path / "motor.toml"
    told = reluctance("map", "import", noisy, "--N_r", 6, *WINDING, "--out", motor, "--repair")
    assert "repaired" in told


def test_the_map_of_the_user_is_never_overwritten(fe, tmp_path):
    before = fe.read_text()
    told = reluctance("map", "import", fe, "--N_r", 6, *WINDING, "--out", tmp_path / "fe.toml")
    assert fe.read_text() == before
    assert "fe_map.csv" in told


@pytest.mark.parametrize("ending", [".png", ".svg"])
def test_plot_writes_one_figure(fe, tmp_path, ending):
    out = tmp_path / f"map{ending}"
    reluctance("map", "plot", fe, "--N_r", 6, "--out", out)
    assert out.stat().st_size > 20_000


def test_the_energy_loop_is_drawn_and_its_numbers_told(tmp_path):
    out = tmp_path / "loop.png"
    told = reluctance("run", SHARING, "--until", "0.03", "--energy-loop", out)
    assert out.stat().st_size > 10_000
    assert told.count("energy loop, phase") == 3
    assert "not counted: no machine.iron" in told


def test_machines_lists_the_library():
    listed = json.loads(reluctance("machines", "--json"))
    assert len(listed) == len(list((ROOT / "machines").glob("*.toml")))
    for entry in listed:
        assert entry["source"]
        assert entry["licence"]
        assert entry["tau_peak_Nm"] > 0
    told = reluctance("machines")
    assert all(entry["machine"] in told and entry["source"] in told for entry in listed)


FAULTS = [
    (["check", "FE"], "does not give the rotor poles; pass N_r"),
    (["check", "nowhere.csv", "--N_r", 6], "nowhere.csv: no such file"),
    (["check", "nowhere.toml"], "nowhere.toml: no such file"),
    (["check", "FE", "--N_r", 4], "cover 120 deg el. with N_r = 4"),
    (["check", "FE", "--N_r", 6, "--zero", "unaligned"], "pass zero=aligned"),
    (["check", "FE", "--N_r", 6, "--angle_unit", "rad"], "pass angle_unit=deg"),
    (["check", "FE", "--N_r", 6, "--angle-unit", "grad"], "need one of deg, rad"),
    (["check", "FE", "--N_r", 6, "--name", "flux=x"], "need psi=NAME"),
    (["check", "FE", "--N_r", 6, "--accept", "why"], "stores its reason in a machine file"),
    (["check", "FE", "--N_r", 6, "--repair", "x.mat"], "need one of .csv"),
    (["check", "FE", "--N_r", 6, "--i_max_A", -1], "i_max = -1 A, need > 0"),
    (["check", ROOT / "machines/paper_6_4.toml"], "need a machine with model = 'map'"),
    (["check", ROOT / "machines/guc_linear_6_4.toml", "--N_r", 4], "stand in it"),
    (["plot", "FE", "--N_r", 6, "--out", "x.gif"], "need one of .html, .pdf, .png, .svg"),
    (["import", "FE", "--N_r", 6, *WINDING, "--out", "x.csv"], "need one of .toml"),
    (["import", "FE", "--N_r", 6, *WINDING, "--out", "no/x.toml"], "does not exist"),
    (["import", "FE", "--N_r", 6, *WINDING[:3], -2, *WINDING[4:], "--out", "x.toml"], "R_ohm = -2"),
    (["import", "FE", "--N_r", 6, "--N_s", 14, *WINDING[2:], "--out", "x.toml"], "7 phases"),
]


@pytest.mark.parametrize(("arguments", "text"), FAULTS, ids=range(len(FAULTS)))
def test_a_mistyped_command_gives_one_clear_line(fe, monkeypatch, arguments, text):
    monkeypatch.chdir(fe.parent)
    given = [fe.name if a == "FE" else a for a in arguments]
    assert text in reluctance("map", *given, fails="line")
    assert [p.name for p in fe.parent.iterdir()] == ["fe.csv"]


COUPLED = ROOT / "examples" / "coupled_phases.toml"
SIX_FOUR = ("--N_r", "4", "--N_s", "6", "--R_ohm", "1.58", "--J_kgm2", "0.0003")


def coupled_map(folder, monkeypatch):
    """The table of one phase of a machine whose phases couple, in the current folder."""
    monkeypatch.chdir(folder)
    machine = load(COUPLED).machine
    write_map(machine.table, Path("map.csv"))
    return machine, ("map", "import", "map.csv", "--angle_kind", "electrical", *SIX_FOUR)


def test_import_takes_the_pairs_of_a_drive_over_with_their_factors(tmp_path, monkeypatch):
    """Its psi_factor goes into the table, since the new map has none; pair_factor stays a key."""
    machine, arguments = coupled_map(tmp_path, monkeypatch)
    values = {"machine.pair_factor": 0.8, "machine.psi_factor": 1.1}
    load(COUPLED).with_values(values).save("drive.toml")
    told = reluctance(*arguments, "--pairs", "drive.toml", "--out", "motor.toml")
    assert "wrote motor.toml, motor.csv and motor_pairs.csv" in told
    found = load(COUPLED, ["machine=motor.toml"]).machine
    assert (found.psi_factor, found.pair_factor) == (1, 0.8)
    i, theta_e = np.array([7.0, 0.0, 4.0]), np.linspace(0, 6, 9)
    torque = 0.88 * machine.coupling.tau(i, theta_e)
    assert found.coupling.tau(i, theta_e) == pytest.approx(torque, abs=1e-6 * np.abs(torque).max())


def test_import_takes_a_pair_table_over_and_leaves_it_where_it_is_already(tmp_path, monkeypatch):
    machine, arguments = coupled_map(tmp_path, monkeypatch)
    given = Path("motor_pairs.csv")
    given.write_bytes(Path(machine.pairs).read_bytes())
    told = reluctance(*arguments, "--pairs", given, "--out", "motor.toml")
    assert "wrote motor.toml and motor.csv" in told
    assert given.read_bytes() == Path(machine.pairs).read_bytes()
    assert load(COUPLED, ["machine=motor.toml"]).machine.coupling is not None


@pytest.mark.parametrize(
    ("drive", "poles", "said"),
    [
        (ROOT / "examples" / "deadbeat.toml", ("6", "4"), "has no pairs; leave --pairs out"),
        (COUPLED, ("8", "6"), "has 3 phases and 4 rotor poles, the map 4 and 6"),
    ],
)
def test_pairs_that_cannot_be_taken_over_are_refused(drive, poles, said, tmp_path, monkeypatch):
    _, arguments = coupled_map(tmp_path, monkeypatch)
    poles = ("--N_s", poles[0], "--N_r", poles[1])
    out = ("--pairs", drive, "--out", "motor.toml")
    assert said in reluctance(*arguments, *poles, *out, fails="line")
    assert not Path("motor.toml").exists()
