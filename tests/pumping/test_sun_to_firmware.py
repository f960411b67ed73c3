"""One file from the sun to the firmware: sizing, simulation and package agree on the array."""

import json
import re
import shutil
from pathlib import Path

import pytest
from command import command, refused

import reluctance as rl

pytest.importorskip("pvlib")
from reluctance.pumping import drive_of, load_system, pump, sizes, with_units

EXAMPLES = Path(__file__).parents[2] / "examples"
VILLAGE, DAY = EXAMPLES / "sun_village.toml", EXAMPLES / "sun_day.toml"


@pytest.mark.parametrize(
    ("lengths", "expected"),
    [
        pytest.param([7], {True}, id="too long"),  # without the loss map of a string that serves
        pytest.param([4, 5, 6, 7], {True, False}, id="all", marks=pytest.mark.long),
    ],
)
@pytest.mark.parametrize("temp_cold", [-10.0, 5.0, -25.0])
def test_sizing_and_export_refuse_the_same_strings(temp_cold, lengths, expected, tmp_path):
    """Over all lengths of the string, at the same open-circuit voltage, everywhere."""
    limit = 320.0
    system = load_system(VILLAGE, [f"limits.u_max_V={limit}", f"limits.temp_cold_degC={temp_cold}"])
    if expected == {True}:  # no size works: an error, not a table
        with pytest.raises(rl.ParameterError) as none:
            sizes(system, {"array.n_series": lengths})
        reasons = [str(none.value)]
    else:
        reasons = list(sizes(system, {"array.n_series": lengths})["why"])
    verdicts = set()
    for n, why in zip(lengths, reasons, strict=True):
        options = [f"array.n_series={n}", f"limits.u_max_V={limit}"]
        options += [f"limits.temp_cold_degC={temp_cold}"]
        given = [word for text in options for word in ("--set", text)]
        out = tmp_path / f"{n}"
        if why:
            volts = re.search(r"([\d.]+) V without load", why)[1]
            for arguments in (("export", "firmware", VILLAGE, "--out", out), ("run", VILLAGE)):
                line = refused(*arguments, *given)
                assert f"{volts} V without load" in line and f"{temp_cold:g}" in line
        else:
            assert command("export", "firmware", VILLAGE, "--out", out, *given).code == 0
        verdicts.add(bool(why))
    assert verdicts == expected


@pytest.fixture(scope="module")
def village():
    """Pumped once, with its loss map."""
    return pump(load_system(VILLAGE))


def test_the_cold_temperature_is_stated_with_its_voltage(village):
    figures = with_units(village)
    assert figures["temp_cold_degC"] == -10
    assert figures["u_oc_cold_V"] == pytest.approx(village.system.u_cold)
    assert figures["u_oc_cold_V"] > figures["u_oc_max_V"]
    done = command("pump", VILLAGE)
    assert "temp_cold_degC" in done.out and f"{village.system.u_cold:.4g} V" in done.out


def test_the_drive_is_that_of_the_system_and_of_the_written_file(tmp_path):
    for name in ("sun_village", "sun_day"):
        system = load_system(EXAMPLES / f"{name}.toml")
        drive = drive_of(system)
        assert drive.source.n_series == system.array.n_series
        assert drive.load.H_static_m == system.pipe.H_static_m
        assert drive.converter.u_rating_V == system.limits.u_max_V
        assert drive.tau_max == pytest.approx(system.tau_max)
        out = tmp_path / f"{name}.toml"
        assert command("pump", EXAMPLES / f"{name}.toml", "--write-drive", out).code == 0
        written = rl.load(out)
        assert written.source == drive.source and written.pv_control == drive.pv_control
        assert written.control == drive.control
        assert written.omega_nominal == pytest.approx(drive.omega_nominal)


@pytest.mark.long
def test_run_of_a_system_tracks_over_a_cloud(tmp_path):
    """2 % of the available energy at most is left, from start-up and through the cloud."""
    figures = json.loads(command("run", DAY, "--json").out)
    assert figures["tracking"] > 0.98
    assert figures["Q_mean_m3ph"] > 10
    plain = command("run", DAY, "--plot", tmp_path / "a.svg")
    assert "energy from the array" in plain.out and "not settled" not in plain.out
    text = (tmp_path / "a.svg").read_text()
    assert all(f"<!-- {words} -->" in text for words in ("available", "flow (m³/h)", "dc link"))


@pytest.mark.parametrize(("string", "more"), [("n_series=4", False), ("n_parallel=2", True)])
def test_a_pump_at_its_greatest_speed_says_why_it_leaves_power(string, more):
    """Two strings give more than the village's pump takes."""
    out = command("run", VILLAGE, "--set", f"array.{string}", "--until", 6).out
    assert ("is at its greatest speed, 2900 rpm" in out) == more


def test_an_operation_names_all_that_it_lacks():
    assert "needs efficiency and u_V" in refused("pump", VILLAGE, "--set", "operation.kind=dcdc")


def test_set_reaches_the_system_and_its_drive():
    both = ("--set", "array.n_parallel=5", "--set", "control.i_band_A=2", "--until", 0.1)
    assert command("run", DAY, *both).code == 0
    assert "n_paralel" in refused("run", DAY, "--set", "array.n_paralel=5")
    assert "i_bnd_A" in refused("run", DAY, "--set", "control.i_bnd_A=5")


@pytest.mark.parametrize("kind", ["dcdc", "fraction"])
def test_an_operation_that_no_controller_does_is_refused(kind):
    numbers = {"dcdc": ["u_V=300", "efficiency=0.97"], "fraction": ["fraction=0.8"]}[kind]
    options = [f"operation.kind='{kind}'", *(f"operation.{n}" for n in numbers)]
    given = [word for text in options for word in ("--set", text)]
    assert "[operation] kind" in refused("run", DAY, *given)


def test_the_readme_of_the_package_speaks_of_the_array(tmp_path):
    assert command("export", "firmware", DAY, "--out", tmp_path / "on_array").code == 0
    text = (tmp_path / "on_array" / "README.md").read_text()
    for words in ("| array current |", "greatest speed", "Tracking", "a tenth of the speed"):
        assert words in text, words
    drive = EXAMPLES / "sharing_cubic.toml"
    assert command("export", "firmware", drive, "--out", tmp_path / "plain").code == 0
    text = (tmp_path / "plain" / "README.md").read_text()
    assert "array" not in text and "a tenth of the torque" in text


def test_a_system_of_another_folder_keeps_its_files(tmp_path):
    for name in ("sun_village.toml", "village_drive.toml", "village_pump.csv"):
        shutil.copy(EXAMPLES / name, tmp_path)
    out = tmp_path / "drive.toml"
    assert command("pump", tmp_path / "sun_village.toml", "--write-drive", out).code == 0
    assert '"village_pump.csv"' in out.read_text()
