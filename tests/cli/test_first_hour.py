"""What a person meets in the first hour: mistakes get one line with the remedy, results no trap."""

import json
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from command import command, on_terminal, refused

import reluctance as rl
from reluctance.cli.tune import at_the_end
from reluctance.drive.course import MOST_POINTS

ROOT = Path(__file__).parents[2]
RATED = ROOT / "examples" / "paper_rated.toml"
PULSE = ROOT / "examples" / "single_pulse.toml"
SHARING = ROOT / "examples" / "sharing_cubic.toml"


def test_set_without_a_value_says_how_a_key_is_removed():
    assert "`control.i_band_A=` removes the key" in refused(
        "run", RATED, "--set", "control.i_band_A"
    )


@pytest.mark.parametrize("law", ["deadbeat", "torque_sharing", "ditc", "finite_set_mpc"])
def test_a_new_law_leaves_no_half_of_a_window_behind(law):
    drive = rl.load(PULSE, ["machine=paper_6_4", "reference.kind=torque", "reference.tau_Nm=20",
                            "converter.u_dc_V=240", "load.speed_rpm=800",
                            f"control.law={law}"])  # fmt: skip
    assert drive.control.law == law


def test_a_key_that_is_not_there_may_be_removed_and_a_mistype_not():
    assert rl.load(RATED, ["control.tau_max_Nm="]).control.tau_max_Nm is None
    assert "i_band_A" in refused("run", RATED, "--set", "control.i_bnd_A=")
    fixed = rl.load(PULSE, ["machine=paper_6_4", "reference.kind=torque", "reference.tau_Nm=20",
                            "converter.u_dc_V=240", "load.speed_rpm=800", "control.law=deadbeat",
                            "control.theta_off_deg="])  # fmt: skip
    assert fixed.control.law == "deadbeat"


def test_a_course_from_a_csv_file(tmp_path):
    path = tmp_path / "prof.csv"
    path.write_text("t_s,tau_Nm\n0,10\n0.01,20\n")
    drive = rl.load(RATED, [f"reference.tau_Nm={path}"])
    assert drive.reference.t_s == [0, 0.01] and drive.reference.values == [10, 20]
    path.write_text("0,10\n0.01,20\n")
    assert rl.load(RATED, [f"reference.tau_Nm={path}"]).reference.values == [10, 20]
    other = tmp_path / "prof.txt"  # another ending, and blanks between the numbers
    other.write_text("0  10\n0.01 20\n")
    assert rl.load(RATED, [f"reference.tau_Nm={other}"]).reference.values == [10, 20]
    path.write_text("time,torque\n0,10\n")
    assert "need t_s and tau_Nm" in refused("run", RATED, "--set", f"reference.tau_Nm={path}")
    both = ("--set", "reference.t_s=[0,1]", "--set", "reference.values=[1,2]")
    assert "reference.tau_Nm= does" in refused("run", RATED, *both)


@pytest.mark.parametrize("head", ["", "t_s,tau_Nm\n"])
def test_a_course_of_one_row_is_constant_and_one_of_none_is_refused(tmp_path, head):
    path = tmp_path / "short.csv"
    path.write_text(head + "0,30\n")
    assert rl.load(RATED, [f"reference.tau_Nm={path}"]).reference.values == [30]
    path.write_text(head)
    assert "rows" in refused("run", RATED, "--set", f"reference.tau_Nm={path}")


@pytest.mark.parametrize("head", ["", "t_s,tau_Nm\n"])
def test_a_course_of_too_many_rows_is_refused_and_not_cut(tmp_path, head):
    path = tmp_path / "long.csv"
    rows = [f"{n}e-6,{20 if n < MOST_POINTS else 30}\n" for n in range(MOST_POINTS + 1)]
    path.write_text(head + "".join(rows[:-1]))
    assert len(rl.load(RATED, [f"reference.tau_Nm={path}"]).reference.values) == MOST_POINTS
    path.write_text(head + "".join(rows))
    with pytest.raises(
        rl.ParameterError, match="100001 rows of t_s and tau_Nm, need 1 to 100000; keep every"
    ):
        rl.load(RATED, [f"reference.tau_Nm={path}"])


def test_tuning_tells_where_it_stopped_at_an_end():
    assert "0.3:3" in at_the_end({"control.i_band_A": 0.31}, {"control.i_band_A": [0.3, 3]})[0]
    assert at_the_end({"control.i_band_A": 1.0}, {"control.i_band_A": [0.3, 3]}) == []
    assert at_the_end({"control.law": "ditc"}, {"control.law": ["ditc", "deadbeat"]}) == []


def test_a_written_drive_names_files_beside_it_from_there(tmp_path):

    (tmp_path / "map.csv").write_bytes((ROOT / "machines" / "guc_linear_6_4.csv").read_bytes())
    text = (ROOT / "machines" / "guc_linear_6_4.toml").read_text()
    (tmp_path / "m.toml").write_text(text.replace("guc_linear_6_4.csv", "map.csv"))
    drive = rl.load(SHARING, [f"machine={tmp_path}/m.toml", "reference.tau_Nm=1",
                              "control.tau_max_Nm=1.2", "control.i_band_A=0.05"])  # fmt: skip
    drive.save(tmp_path / "tuned.toml")
    written = tomllib.loads((tmp_path / "tuned.toml").read_text())
    assert written["machine"]["map"] == "map.csv"
    assert rl.load(tmp_path / "tuned.toml").machine.psi(1.0, 1.0) == drive.machine.psi(1.0, 1.0)


def test_a_loss_without_data_is_not_counted():
    out = command("run", RATED, "--until", 0.02).out
    assert "device conduction loss               │ not counted" in out
    devices = command("run", RATED, "--until", 0.02, "--set", "converter.v_diode_V=1").out
    assert "device conduction loss               │ not counted" not in devices


@pytest.mark.parametrize(
    "action", [[np.nan] * 3, [0.1], None, [2, 2, 2], [[0.1, 0.1, 0.1]], ["a", "b", "c"], [-1, 0, 0]]
)
def test_an_action_that_is_none_is_refused(action):
    pytest.importorskip("gymnasium")
    from reluctance.targets.gym import DriveEnv

    env = DriveEnv(task="torque", action="currents")
    env.reset(seed=1)
    env.step(np.array([0.1, 0.2, 0.3]))
    with pytest.raises(rl.ParameterError, match="action"):
        env.step(action)


def test_a_sweep_of_a_mistyped_key_raises():
    with pytest.raises(rl.ParameterError, match="i_band"):
        rl.sweep(rl.load(SHARING), {"control.i_band": [1, 2]}, until=0.02)


def test_a_law_that_does_not_hold_the_torque_is_marked_in_compare():
    from reluctance.explore.comparison.table import star

    assert star({"met": True, "torque_error_mean": -0.34}) == " !"
    assert star({"met": False, "torque_error_mean": 0.01}) == " *"
    assert star({"met": True}) == ""


def test_a_drive_file_may_begin_with_a_byte_order_mark(tmp_path):
    path = tmp_path / "bom.toml"
    path.write_bytes(b"\xef\xbb\xbf" + RATED.read_bytes())
    assert rl.load(path).reference.tau_Nm == pytest.approx(41.339)


def test_a_name_without_its_ending_gets_a_hint(monkeypatch):
    monkeypatch.chdir(RATED.parent)
    assert "paper_rated.toml" in refused("run", "paper_rated")


def test_a_run_that_is_too_long_is_told_so():
    line = refused("run", RATED, "--until", "1e9")
    assert "1e+09 s" in line and "--until" in line


def test_milliohms_are_seen():
    assert "milliohm" in refused("run", RATED, "--set", "machine.R_ohm=32")


@pytest.mark.parametrize(
    ("key", "most"),
    [
        ("v_switch_V", 120),  # half of the dc link
        ("v_diode_V", 120),
        ("R_switch_ohm", 0.8),  # times 150 A
        ("R_diode_ohm", 0.8),
    ],
)
def test_devices_that_drop_more_than_the_dc_link_has_are_seen(key, most):
    line = refused("run", RATED, "--set", f"converter.{key}={most}")
    assert f"{key} = {most:g}: two devices in series drop 240 V" in line and "milli" in line
    rl.load(RATED, [f"converter.{key}={0.999 * most}"])


def test_examples_are_whole_sentences():
    lines = command("examples").out.splitlines()
    listed = [line for line in lines if line.startswith(("angle_table", "sun_cloud", "paper_pump"))]
    assert listed and all(line.rstrip().endswith(".") for line in listed), listed


def test_a_drive_is_shown_on_one_line():
    assert len(repr(rl.load(RATED))) < 200


def test_the_names_that_people_try_are_there():
    drive = rl.load(RATED)
    assert rl.limit(drive).with_units()["i_rms_A"] == pytest.approx(48.93, abs=0.02)
    assert callable(rl.compare) and callable(rl.tune)
    assert any("6/4" in str(entry.with_units()) for entry in rl.machines())
    assert not hasattr(rl, "nothing")
    aligned, unaligned = drive.machine.psi(20.0, np.pi), drive.machine.psi(20.0, 0.0)
    assert aligned > 5 * unaligned > 0


def test_a_decimal_comma_is_named(tmp_path):
    path = tmp_path / "d.toml"
    path.write_text(RATED.read_text().replace("tau_Nm = 41.339", "tau_Nm = 41,339  # rated"))
    assert "write a decimal point, as in 41.339" in refused("run", path)
    line = refused("run", RATED, "--set", "reference.tau_Nm=41,339")
    assert "write a decimal point, as in 41.339" in line
    path.write_bytes(RATED.read_text().encode("utf-16"))
    assert "save the file as UTF-8" in refused("run", path)


def test_texts_in_brackets_reach_the_terminal(capsys):
    """`[limits]` would be markup of the table."""
    from reluctance.cli.pump import _print_table

    _print_table("farm [x]", [("coldest cell ([limits] temp_cold_degC)", "-5 [y]")])
    shown = capsys.readouterr().out
    assert "[limits] temp_cold_degC" in shown and "[y]" in shown and "[x]" in shown


def test_a_key_that_lacks_a_part_is_recognised():
    from reluctance.base.schema import did_you_mean

    known = ["H_static_m", "L_m", "D_mm", "K"]
    assert did_you_mean("H_m", known) == "; did you mean `H_static_m`?"
    assert did_you_mean("L_mm", known) == "; did you mean `L_m`?"


def test_a_date_in_quotes_is_told_so():
    line = refused(
        "pump", ROOT / "examples" / "sun_day.toml", "--set", "weather.start='2026-08-15'"
    )
    assert "need a date without quotes" in line


def test_a_limit_is_shown_on_one_line():
    shown = repr(rl.limit(rl.load(RATED)))
    assert len(shown) < 200 and "48.93 A rms" in shown


def test_a_long_run_is_drawn_in_seconds():
    from reluctance.base.picture import Picture
    from reluctance.drive.run.plots import plot_currents, plot_torque

    for until, label in ((0.01, "time (ms)"), (6.0, "time (s)")):
        run = rl.simulate(rl.load(RATED), until=until, record=until / 50)
        ax = plot_torque(Picture(4, 3).add_subplot(), run)
        assert ax.get_xlabel() == plot_currents(Picture(4, 3).add_subplot(), run).get_xlabel()
        assert ax.get_xlabel() == label
        assert ax.lines[0].get_xdata()[-1] == pytest.approx(until * (1e3 if until < 1 else 1))


def test_a_map_that_is_drawn_says_where(tmp_path):
    out = tmp_path / "m.png"
    done = command("map", "plot", ROOT / "machines" / "onelab_6_4.toml", "--out", out)
    assert done.code == 0 and str(out) in done.out


def test_a_range_in_another_form_is_told_the_form():
    line = refused("sweep", SHARING, "--vary", "control.i_band_A=0.5-2")
    assert "a range is FROM:TO:COUNT, as in 0.5:2:5" in line


def test_a_table_as_the_store_of_a_sweep_is_told_its_option(tmp_path):
    varied = ("sweep", RATED, "--vary", "control.i_band_A=1,2", "--until", 0.002)
    table = tmp_path / "x.csv"
    line = refused(*varied, "--out", table)
    assert line.strip().endswith(f"for their table write --table {table}") and ".sqlite" in line
    assert command(*varied, "--out", tmp_path / "x.db", "--table", table).code == 0
    assert table.read_text().count("\n") == 3


def test_an_option_of_another_command_is_told_where_it_is():
    line = refused("run", RATED, "--vary", "control.i_band_A=1,2")
    assert "No such option: --vary" in line and "`reluctance sweep`" in line
    assert "`reluctance run`" not in line
    assert "reluctance" not in refused("run", RATED, "--no-such-thing")


def test_a_name_whose_package_is_missing_is_no_attribute():
    script = (
        "import importlib.util as u; find = u.find_spec\n"
        "u.find_spec = lambda name, *more: None if name == 'pvlib' else find(name, *more)\n"
        "import reluctance as rl\n"
        "assert not hasattr(rl, 'pump') and hasattr(rl, 'load')\n"
        "try: rl.pump\n"
        "except AttributeError as fault: print(fault)\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert "pip install 'reluctance[sun]'" in done.stdout, done.stderr


def test_pump_and_weather_columns_as_people_have_them(tmp_path):
    from reluctance.plant.hydraulics.pump import Pump

    curve = tmp_path / "curve.csv"
    curve.write_text("Flow [l/s],Head (m),Power [kW]\n0,60,1.0\n1,55,1.2\n2,45,1.4\n3,30,1.5\n")
    ours = tmp_path / "ours.csv"
    ours.write_text("Q_m3ph,H_m,p_shaft_W\n0,60,1000\n3.6,55,1200\n7.2,45,1400\n10.8,30,1500\n")
    a, b = (Pump(n_ref_rpm=2900.0, curve_csv=str(path)).curve() for path in (curve, ours))
    Q = np.linspace(0, 0.003, 7)
    assert a.head(Q, np.ones(7)) == pytest.approx(b.head(Q, np.ones(7)))
    assert a.shaft_power(Q, np.ones(7)) == pytest.approx(b.shaft_power(Q, np.ones(7)))
    curve.write_text("Flow [bbl],Head (m),Power [kW]\n0,60,1\n1,55,1.2\n2,45,1.4\n")
    with pytest.raises(rl.ParameterError, match=r"unit `bbl`, need m3ph or m3/h or l/s"):
        Pump(n_ref_rpm=2900.0, curve_csv=str(curve)).curve()


def test_weather_with_its_own_headers(tmp_path):
    pytest.importorskip("pvlib")
    from reluctance.pumping import load_system
    from reluctance.pumping.weather_file import read_weather

    rows = [f"2026-03-21 {h:02d}:00,{max(0, 900 - 25 * (h - 12) ** 2)},28" for h in range(24)]
    for head in ("Time,GHI,T2m", "time,ghi [W/m2],Temp (degC)", "timestamp,G(h),temperature"):
        (tmp_path / "w.csv").write_text("\n".join([head, *rows]) + "\n")
        system = load_system(
            ROOT / "examples" / "sun_day.toml",
            ["weather.kind='csv'", f"weather.file={json.dumps(str(tmp_path / 'w.csv'))}",
             *(f"weather.{k}=" for k in ("start", "days", "step_min", "linke_turbidity")),
             "weather.temp_air_degC="],
        )  # fmt: skip
        weather = read_weather(system.weather, system.site, system.folder)
        assert weather.sun is not None and len(weather.t) == 24


def test_the_citation_is_one_that_a_reference_manager_takes():
    text = (ROOT / "CITATION.cff").read_text()
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert f"version: {version}" in text
    assert "authors:\n  - name: The reluctance authors" in text
    assert 'date-released: "2026-' in text


@pytest.mark.parametrize("words", [("examples",), ("machines",)])
def test_lists_break_between_words_on_a_terminal(words):
    """The words are those of a pipe, and no line is longer than 80 columns."""
    lines = on_terminal(*words)
    assert max(map(len, lines)) <= 80
    assert " ".join(lines).split() == command(*words).out.split()


def test_what_an_export_warns_of_breaks_between_words(tmp_path):
    lines = on_terminal("export", "firmware", RATED, "--out", tmp_path / "fw")[1:]  # of the path
    assert len(lines) > 3 and max(map(len, lines)) <= 80


def test_a_list_where_a_number_stands_is_told_how_a_course_is_written():
    told = refused("run", SHARING, "--set", "reference.tau_Nm=[5, 20]")
    assert "t_s and values" in told
    course = ("tau_Nm=", "t_s=[0, 0.02]", "values=[5, 20]")
    given = [word for text in course for word in ("--set", f"reference.{text}")]
    assert command("run", SHARING, *given, "--until", 0.02).code == 0


def test_a_run_that_ends_before_the_drive_has_run_says_so():
    supervised = "--set", "supervision.enable_s=0", "--set", "supervision.precharge_ms=30"
    short = command("run", ROOT / "examples" / "deadbeat.toml", *supervised, "--until", 0.02).out
    assert "the run ends in `precharge`" in short
    whole = command("run", ROOT / "examples" / "deadbeat.toml", *supervised, "--until", 0.15).out
    assert "the run ends in" not in whole


def test_a_figure_that_no_trial_has_is_told_with_the_way_to_the_reason():
    varied = "--vary", "control.i_band_A=0.5:1", "--budget", 2, "--until", 0.01
    found = refused("tune", SHARING, *varied, "--minimise", "p_fe_W")
    assert "no trial has p_fe_W; what `reluctance run` shows says why" in found
    assert "no machine.iron" in command("run", SHARING, "--until", 0.01).out
