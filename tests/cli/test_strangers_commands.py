"""What strangers type on the command line: each remedy, followed to the letter, works."""

import re
from pathlib import Path

import pytest
from command import command, refused

import reluctance as rl
from reluctance.explore.comparison.contenders import CONTENDERS

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
RATED = EXAMPLES / "paper_rated.toml"
DEADBEAT, G474 = EXAMPLES / "deadbeat.toml", EXAMPLES / "deadbeat_g474.toml"


@pytest.mark.parametrize(
    "line",
    [
        ("sweep", RATED, "--vary", "control.i_band_A=1,2"),
        ("efficiency", RATED, "--speed", "500,1000", "--torque", "10,20"),
        *[("tune", RATED, "--vary", "control.i_band_A=1,2", "--minimise", "torque_error_rms")],
    ],
    ids=lambda line: line[0],
)
def test_a_cache_that_cannot_be_written_is_told_with_the_variable_that_moves_it(
    line, tmp_path, monkeypatch
):
    (tmp_path / "file").touch()
    monkeypatch.setenv("RELUCTANCE_CACHE", str(tmp_path / "file" / "cache"))
    assert "set RELUCTANCE_CACHE in the environment to a folder of your own" in refused(*line)
    monkeypatch.setenv("RELUCTANCE_CACHE", str(tmp_path / "cache"))
    assert command(*line).code == 0


@pytest.mark.parametrize("value", ["0,02", "20ms", "20 ms", "0.02s"])
def test_an_option_that_is_no_number_is_answered_with_the_number(value):
    line = refused("run", RATED, "--until", value)
    told = re.search(r"--until = '.+', need a number; .*as in ([\d.]+)$", line)
    assert told and command("run", RATED, "--until", told[1]).code == 0, line


def test_an_option_with_two_names_is_told_by_the_one_of_the_pages():
    line = refused("map", "identify", "x.csv", "--R_ohm", "0,45")
    assert "--R_ohm = '0,45', need a number; write a decimal point, as in 0.45" in line


def test_a_whole_number_is_asked_for_where_one_is_needed():
    line = refused("emulate", ".", "spin", "--drive", RATED, "--angles", "3.5")
    assert "--angles = '3.5', need a whole number" in line
    assert "--llp = '2', need <= 1" in refused("size", "x.toml", "--llp", "2")


@pytest.mark.parametrize(
    ("key", "value", "right"),
    [
        *[("converter.u_dc_V", "0.24kV", "240"), ("load.speed_rpm", "1500rpm", "1500")],
        ("load.speed_rpm", "157rad/s", "1499.239564"),
        *[("control.T_s_us", "20us", "20"), ("simulation.until_s", "20ms", "0.02")],
    ],
)
def test_a_number_with_its_unit_is_answered_with_the_number_in_the_unit_of_the_key(
    key, value, right
):
    assert f"write the number alone, as in {right}\n" in refused(
        "run", RATED, "--set", f"{key}={value}"
    )


def test_a_comma_before_three_digits_may_part_thousands(tmp_path):
    both = "write a decimal point, as in 1.500, or 1500 where the comma parts thousands"
    assert both in refused("run", RATED, "--set", "load.speed_rpm=1,500")
    path = tmp_path / "drive.toml"
    path.write_text(RATED.read_text().replace("speed_rpm = 1500", "speed_rpm = 1,500"))
    assert both in refused("run", path)
    assert "as in 0.500\n" in refused("run", RATED, "--set", "control.i_band_A=0,500")


@pytest.mark.parametrize(
    "torn", [("control.i_band_A", "=", "2"), ("control.i_band_A", "=2"), ("control.i_band_A:2",)]
)
def test_set_that_is_torn_apart_or_has_a_colon_is_answered_as_it_is_written(torn):
    line = refused("run", RATED, "--set", *torn)
    assert "control.i_band_A=2" in line and "removes" not in line


def test_the_name_of_an_example_is_answered_with_the_command_that_copies_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("paper_rated", "paper_rated.toml"):
        line = refused("run", name)
        copy = re.search(r"`reluctance (examples paper_rated --copy \.)`", line)
        assert copy, line
    assert command(*copy[1].split()).code == 0 == command("run", name, "--until", 0.02).code
    assert "did you mean paper_rated.toml?" in refused("run", "paper_rated")


def test_a_flux_map_in_the_place_of_a_machine_file_is_told_from_a_mistake_in_toml(tmp_path):
    path = tmp_path / "map.csv"
    path.write_bytes((ROOT / "machines" / "guc_linear_6_4.csv").read_bytes())
    line = refused("run", RATED, "--set", f"machine={path}")
    assert "is a table of numbers" in line and "`reluctance map import`" in line


MCU = ROOT / "examples" / "edge_mpc_mcu.toml"


def test_a_fault_that_comes_after_the_end_of_the_run_is_told():
    late = ("run", RATED, "--until", 0.02, "--set", 'faults=[{kind="open_wire", t_s=0.02}]')
    out = command(*late).out
    assert "[faults.0] t_s = 0.02 is not before the end of the run at 0.02 s" in out
    assert "is not before the end" not in command(*late, "--set", "faults.0.t_s=0.019").out


def test_an_encoder_step_wider_than_a_stroke_is_told_by_run_and_export(tmp_path):
    coarse = ("--set", "sensing.encoder_counts=11")
    told = "is 32.7 deg of the shaft, wider than a stroke, 30 deg"
    out = command("run", MCU, "--until", 0.02, *coarse).out
    assert told in " ".join(out.split())
    assert told in command("export", "firmware", MCU, *coarse, "--out", tmp_path / "fw").out
    enough = re.search(r"take at least (\d+) counts", out)
    assert (
        enough
        and "wider than a stroke"
        not in command(
            *("run", MCU, "--until", 0.02, "--set", f"sensing.encoder_counts={enough[1]}")
        ).out
    )


def test_a_quantity_in_two_units_and_a_course_beside_a_course_are_refused(tmp_path):
    own = ROOT / "examples" / "own_law" / "own_law.toml"
    line = refused("run", own, "--trust", "--set", "control.theta_on=0.1")
    assert "`theta_on_deg` and `theta_on` are one quantity; give one of them" in line
    (tmp_path / "course.csv").write_text("t_s,tau_Nm\n0,10\n0.01,20\n")
    course = ("run", RATED, "--until", 0.02, "--set", f"reference.tau_Nm={tmp_path}/course.csv")
    line = refused(*course, "--set", "reference.t_s=[0, 1]")
    undo = re.search(r"\(--set (reference.t_s=)\)", line)
    assert undo, line
    assert command(*course, "--set", "reference.t_s=[0, 1]", "--set", undo[1]).code == 0


def test_a_current_limit_beyond_all_saturation_is_told_by_the_flux_linkages():
    line = refused(
        *("run", RATED, "--set", "machine=generic_60kw_6_4", "--set", "machine.i_max_A=2000")
    )
    assert "is not above the unaligned one" in line and "lower i_max_A" in line


@pytest.mark.parametrize(
    "line",
    [
        ("limit",),
        ("efficiency", "--speed", "500,1000", "--torque", "5,10"),
        ("compare", "--controls", "deadbeat", "--set", "reference.speed_rpm=1000"),
    ],
    ids=lambda line: line[0],
)
def test_a_drive_on_an_array_has_its_pump_at_the_greatest_speed_as_the_point(line, tmp_path):
    """Of a system too, by the command that its refusal names."""
    name, *options = line
    done = command(name, ROOT / "examples" / "sun_cloud.toml", *options)
    assert done.code == 0, done.error
    pytest.importorskip("pvlib")
    system = ROOT / "examples" / "sun_day.toml"
    told = re.search(r"`reluctance pump .+ (--write-drive) (drive.toml)`", refused(name, system))
    assert told
    path = tmp_path / told[2]
    assert command("pump", system, told[1], path).code == 0
    if name == "limit":
        assert command(name, path).code == 0


def test_a_point_above_tau_max_is_answered_with_what_lowers_it():
    line = ("compare", ROOT / "examples" / "sun_cloud.toml", "--controls", "deadbeat")
    assert "raise it, or ask for less torque" in refused(*line, "--set", "control.tau_max_Nm=1")


def test_a_law_in_the_place_of_its_variants_is_answered_with_these():
    line = refused("compare", RATED, "--controls", "torque_sharing,deadbeat")
    assert "`torque_sharing` is a law; compare sharing_linear, sharing_cubic" in line


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("control.law=mylaw.py:X", '; did you mean "python:mylaw.py:X"?'),
        ("control.law=mylaw.py", '; did you mean "python:mylaw.py:CLASS"?'),
        ("control.law=a/mylaw.so:X", '; did you mean "cpp:a/mylaw.so:X"?'),
        ("control.law=sharing_cubic", 'law = "torque_sharing", sharing = "cubic"'),
        ("control.law=finite_set_mpc_3", 'law = "finite_set_mpc", horizon = 3'),
        ("protection.diagnosis=yes", "diagnosis = 'yes', need true or false"),
        ("supervision.fault_s=None", "leave the key out (--set TABLE.fault_s= removes it)"),
        ("faults.1.kind=open_wire", "`1`, need 0, the first"),
    ],
)
def test_what_people_write_instead_is_answered_with_what_they_mean(setting, said):
    assert said in refused("run", DEADBEAT, "--set", "supervision.enable_s=0", "--set", setting)


def test_names_of_compare_are_laws_with_the_keys_that_the_answer_gives():
    for name in CONTENDERS:
        try:
            rl.load(DEADBEAT, [f"control.law={name}"])
        except rl.ParameterError as fault:
            keys = re.findall(r"(\w+) = ([^,]+)", str(fault).partition("has this name for ")[2])
            drive = rl.load(DEADBEAT, [f"control.{key}={value}" for key, value in keys])
            assert drive.control.law == CONTENDERS[name].law


def test_a_number_of_an_own_law_with_a_decimal_comma_is_told_as_such():
    order = ("run", EXAMPLES / "own_law" / "own_law.toml", "--trust", "--until", "0.002")
    line = refused(*order, "--set", "control.i_band_A=1,5")
    assert "i_band_A = '1,5', need a number; write a decimal point, as in 1.5" in line
    assert command(*order, "--set", "control.i_band_A=1.5").code == 0


def test_compare_knows_the_file_of_an_own_law_without_its_kind():
    line = refused("compare", DEADBEAT, "--controls", "deadbeat,mylaw.py:X")
    assert line.endswith('did you mean "python:mylaw.py:X"?\n')


def test_firmware_says_that_it_leaves_faults_out(tmp_path):
    wire = ("--set", "faults.0.kind=open_wire", "--set", "faults.0.phase=b")
    told = command("export", "firmware", G474, *wire, "--out", tmp_path / "fw").out
    assert "warning: [[faults]] are left out" in told
    told = command("export", "firmware", G474, "--out", tmp_path / "without").out
    assert "[[faults]]" not in told
