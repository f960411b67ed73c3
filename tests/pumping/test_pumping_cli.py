"""`reluctance pump` and `reluctance size` as a user meets them."""

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from command import command, on_terminal, refused

from reluctance.pumping import load_system, sizing

ROOT = Path(__file__).parents[2]
DAY = str(ROOT / "examples" / "sun_day.toml")
VILLAGE = str(ROOT / "examples" / "sun_village.toml")
YEAR = str(ROOT / "examples" / "sun_year.toml")
PROMISED = {"water_m3", "e_mp_kWh", "e_in_kWh", "pumping_h", "loss_of_load_probability"}


def reluctance(*arguments):
    done = command(*arguments)
    return subprocess.CompletedProcess(arguments, done.code, done.out, done.error)


def process(*arguments, **options):
    line = [sys.executable, "-m", "reluctance", *arguments]
    return subprocess.run(line, capture_output=True, text=True, timeout=600, **options)


def test_json_is_one_object_with_the_promised_keys_and_nothing_else():
    done = reluctance("pump", DAY, "--json")
    assert done.returncode == 0
    assert all(line.startswith("note: ") for line in done.stderr.splitlines())
    figures = json.loads(done.stdout)
    assert set(figures) >= PROMISED
    assert figures["loss_of_load_probability"] is None  # no demand
    assert figures["water_m3"] == pytest.approx(566.05, rel=1e-2)


def test_a_year_prints_its_figures_and_writes_whole_files(tmp_path):
    out = tmp_path / "new" / "year"
    done = reluctance("pump", YEAR, "--out", str(out))
    assert (done.returncode, done.stderr) == (0, "")
    for text in ("water pumped", "m³", "loss of load probability", "note: the weather is means"):
        assert text in done.stdout
    written = {path.name for path in out.iterdir()}
    assert written == {Path(line).name for line in done.stdout.splitlines() if str(out) in line}
    figures = "losses day water array pump threshold efficiency tank".split()
    assert written >= {f"{name}.png" for name in figures} | {"report.html", "pump.json"}
    months = np.genfromtxt(out / "months.csv", delimiter=",", names=True, dtype=None, encoding=None)
    total = json.loads((out / "pump.json").read_text())["water_m3"]
    assert len(months) == 12 and months["water_m3"].sum() == pytest.approx(total)
    samples = (out / "samples.csv").read_text().splitlines()
    assert len(samples) == 8761 and samples[0].startswith("time,poa_global,")
    report = (out / "report.html").read_text()
    assert report.count("<img") == len(figures) and "http" not in report.split("<body")[0]
    assert "td{white-space:pre-wrap}" in report and "<td>  " in report
    assert 'src="data:image/png;base64,' in report and 'src="/' not in report


def test_sizing_tells_how_far_it_is_within_a_size(monkeypatch):
    """The loss map of the first size takes the most time."""
    parts, pumped = [], sizing.pump

    def told(system, progress):
        progress(0.5)
        return pumped(system)

    monkeypatch.setattr(sizing, "pump", told)
    sizing.sizes(load_system(DAY), {"array.n_series": [7, 6]}, progress=parts.append)
    assert parts == [0.25, 0.5, 0.75, 1.0]


@pytest.mark.parametrize("what", ["pump", "size", "run", "pump --write-drive x.toml"])
@pytest.mark.parametrize("value", ["limits.u_max_V=280", "pipe.H_static_m=60"])
def test_a_fault_that_only_the_tables_together_have_names_the_file(what, value):
    name, *options = what.split()
    assert refused(name, DAY, *options, "--set", value).startswith(f"error: {DAY}: ")


def test_a_fault_of_a_pump_file_names_that_file(tmp_path):
    path = tmp_path / "pump.toml"
    path.write_text("[pump]\nn_ref_rpm = -1500\n")
    line = refused("pump", DAY, "--set", f'pump="{path}"')
    assert f"{path}: [pump] n_ref_rpm = -1500, need > 0" in line
    load = ("kind=pump", f"pump={path}", "D_mm=80", "H_static_m=12", "k_pump_Nms2=")
    example = ROOT / "examples" / "paper_pump.toml"
    given = [word for text in load for word in ("--set", f"load.{text}")]
    assert f"{path}: [pump] n_ref_rpm = -1500, need > 0" in refused("run", example, *given)


@pytest.mark.long
def test_a_value_is_set_for_both_commands_as_if_the_file_had_it():
    settings = (
        "--set",
        "array.n_series=6",
        "--set",
        "tank.volume_m3=",
        "--set",
        "tank.volume_m3=9",
    )
    done = reluctance("pump", VILLAGE, *settings, "--json")
    pumped = json.loads(done.stdout)
    sized = reluctance("size", VILLAGE, *settings[2:], "--vary", "array.n_series=6", "--json")
    ((row,),) = json.loads(sized.stdout)
    assert row["water_m3"] == pytest.approx(pumped["water_m3"])
    assert pumped["array_kWp"] == pytest.approx(2.4, rel=1e-2) and pumped["level_end_m3"] <= 9


@pytest.mark.long
def test_sizes_over_series_and_over_head(tmp_path):
    done = reluctance(
        "size", DAY, "--vary", "array.n_series=6:8", "--vary", "pipe.H_static_m=10:20:2", "--json"
    )
    told = " ".join(done.stderr.split())
    assert done.returncode == 0
    assert told.startswith(
        "note: 1.5 h with array.n_series = 8, pipe.H_static_m = 10 at the torque"
    )
    assert told.count("note:") == 1
    (rows,) = json.loads(done.stdout)
    assert [(row["array.n_series"], row["pipe.H_static_m"]) for row in rows] == [
        (n, H) for n in (6, 7, 8) for H in (10.0, 20.0)
    ]
    water = np.array([row["water_m3"] for row in rows]).reshape(3, 2)
    assert np.all(np.diff(water, axis=0) > 0) and np.all(np.diff(water, axis=1) < 0)
    done = reluctance("size", DAY, "--vary", "array.n_series=7:8", "--out", str(tmp_path / "s"))
    assert (tmp_path / "s" / "sizes_n_series.csv").is_file(), done.stderr
    assert (tmp_path / "s" / "sizes_n_series.png").is_file()


def test_sizing_says_what_its_weather_hides_and_which_size_is_longest_at_a_limit():
    done = reluctance("size", YEAR, "--vary", "array.n_parallel=6,12")
    said = " ".join(done.stdout.split())
    assert said.count("note: the weather is means over 60 min: they overstate the water") == 1
    (hours,) = re.findall(r"note: ([\d.]+) h with array.n_parallel = 12 at the torque limit", said)
    more = reluctance("pump", YEAR, "--set", "array.n_parallel=12")
    assert f"note: {hours} h at the torque limit" in " ".join(more.stdout.split())
    mended = reluctance(
        "size", YEAR, "--set", "weather.generate_minutes=true", "--vary", "array.n_parallel=6"
    )
    assert "means over 60 min" not in mended.stdout


def test_values_of_sizes_may_stand_with_commas():
    done = reluctance("size", DAY, "--vary", "pipe.H_static_m=10,15.5", "--json")
    (rows,) = json.loads(done.stdout)
    assert [row["pipe.H_static_m"] for row in rows] == [10, 15.5]


def test_a_size_that_does_not_work_is_told_and_the_others_are_kept():
    done = reluctance("size", DAY, "--vary", "pipe.H_static_m=15:60:2", "--json")
    (rows,) = json.loads(done.stdout)
    assert rows[0]["why"] == "" and rows[1]["water_m3"] == 0
    assert "lower the head" in rows[1]["why"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("pump", "none.toml"), "cannot read none.toml"),
        (("pump", str(ROOT / "examples" / "paper_rated.toml")), "use `reluctance run`"),
        (("size", DAY, "--vary", "tank.volume_m3=10:50:3"), "has no effect without [demand]"),
        (("size", DAY, "--vary", "array.n_series=a:b"), "need section.key=FROM:TO:COUNT"),
        (("size", DAY, "--vary", "array.n_series=4:9:2.5"), "need section.key=FROM:TO:COUNT"),
        (("size", DAY, "--vary", "array.series=4:9"), "unknown value `array.series`"),
        (("size", DAY, "--vary", "array.n_series=-1:0"), "n_series = -1, need >= 1"),
        (("pump", DAY, "--out", DAY), "is a file, need a folder"),
        (("size", DAY, "--vary", "pipe.H_static_m=60"), "none of the 1 sizes works"),
        (("pump", DAY, "--set", "array.n_serie=6"), "unknown key `n_serie` in [array]"),
        (("pump", DAY, "--set", "array.n_series"), "need section.key=value"),
        (("pump", DAY, "--set", "array.soiling="), "no such key to remove"),
        (("size", DAY, "--set", "drive.file=x"), "`drive` is not a table"),
    ],
)
def test_a_fault_is_one_line_and_exit_code_2(arguments, message):
    done = reluctance(*arguments)
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr.startswith("error: ") and done.stderr.count("\n") == 1
    assert message in done.stderr


@pytest.mark.long
def test_an_example_is_copied_with_the_files_that_it_names(tmp_path):
    for name in ("sun_day", "sun_village", "sun_year"):  # the first has the third's drive already
        assert reluctance("examples", name, "--copy", str(tmp_path)).returncode == 0
    copies = {path.name for path in tmp_path.iterdir()}
    assert copies == {
        *("sun_day.toml", "sharing_cubic.toml", "sun_village.toml", "village_drive.toml"),
        *("village_pump.csv", "sun_year.toml"),
    }
    assert reluctance("pump", str(tmp_path / "sun_village.toml"), "--json").returncode == 0
    again = reluctance("examples", "sun_day", "--copy", str(tmp_path))
    assert again.returncode == 2 and "exists" in again.stderr
    assert "sun_village" in reluctance("examples").stdout.splitlines()[-1]


@pytest.mark.long  # loss maps at eight voltages
def test_sizes_of_a_village_mark_the_smallest_array_that_meets_the_demand(tmp_path):
    out = tmp_path / "sizes"
    done = reluctance("size", VILLAGE, "--vary", "array.n_series=0:5", "--json", "--out", str(out))
    (rows,) = json.loads(done.stdout)
    assert "need >= 1" in rows[0]["why"] and rows[0]["water_m3"] == 0
    enough = [
        r["array_kWp"] for r in rows if not r["why"] and r["loss_of_load_probability"] <= 0.02
    ]
    shown = reluctance("size", VILLAGE, "--vary", "array.n_series=0:5").stdout
    marked = [line for line in shown.splitlines() if line.endswith("*")]
    assert len(marked) == 1 and f"{min(enough):.4g}" in marked[0]
    assert "* smallest array that loses at most 2.0% of the demand" in shown
    assert "no margin for cloudy days" in shown
    loss = 100 * rows[3]["loss_of_load_probability"]  # of 3 modules
    table = shown.partition("\n[1] ")[0].splitlines()  # notes are broken on a terminal only
    (row,) = [line.split() for line in table if line.split()[:1] == ["3"]]
    assert f"{loss:.4g}" in row
    assert max(map(len, table)) <= 80  # readable where a size cannot work
    strict = reluctance("size", VILLAGE, "--vary", "array.n_series=2:3", "--llp", "0.001").stdout
    assert "no size of these" in strict


@pytest.mark.long
def test_a_system_of_one_string_is_varied_to_four_and_its_own_head_decides():
    shown = reluctance("size", VILLAGE, "--json").stdout
    first, second = json.loads(shown)
    assert {row["array.n_parallel"] for row in first} == {1, 2, 3, 4}
    assert len({row["array.n_series"] for row in second}) > 4


def test_faults_of_several_tables_are_told_together(tmp_path):
    text = Path(VILLAGE).read_text().replace('"village_drive.toml"', '"none.toml"')
    text = text.replace("latitude_deg", "latitude").replace("village_pump.csv", "none.csv")
    (tmp_path / "v.toml").write_text(text)
    done = reluctance("pump", str(tmp_path / "v.toml"))
    assert "none.toml" in done.stderr and "latitude" in done.stderr
    assert done.returncode == 2 and done.stderr.count("\n") == 1


@pytest.mark.parametrize(("name", "near"), [("400 Wp", "400"), ("CS3W-400P", "CS3W_400P")])
def test_an_unknown_module_lists_names_that_hold_its_words_or_its_power(tmp_path, name, near):
    text = Path(VILLAGE).read_text().replace("Canadian_Solar_Inc__CS3W_400P", name)
    for path in (ROOT / "examples").glob("village_*"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / "v.toml").write_text(text)
    done = reluctance("pump", str(tmp_path / "v.toml"))
    assert near in done.stderr.partition("nearest:")[2] and "names are maker" in done.stderr


def test_without_pvlib_one_line_says_what_to_install(tmp_path):
    (tmp_path / "sitecustomize.py").write_text(
        "import importlib.util as u\nfind = u.find_spec\n"
        "u.find_spec = lambda n, *a: None if n == 'pvlib' else find(n, *a)\n"
    )
    import os

    done = process("pump", DAY, env={**os.environ, "PYTHONPATH": str(tmp_path)})
    assert done.returncode == 2 and "pip install 'reluctance[sun]'" in done.stderr
    assert done.stderr.count("\n") == 1


def test_other_commands_do_not_import_pvlib_or_pandas():
    code = (
        "import sys, reluctance.cli; "
        "assert not {'pvlib', 'pandas', 'reluctance.pumping'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_sizes_and_notes_are_whole_at_80_columns():
    """The table of two varied values, the reasons below it, the sentence, a fault and a note."""
    two = "size", YEAR, "--vary", "pipe.H_static_m=15:60:2", "--vary", "array.n_parallel=6:7"
    fault = on_terminal("pump", DAY, "--set", "array.module='CS6X 300'", errors=True)
    for lines in (on_terminal(*two), on_terminal("pump", DAY), fault):
        assert len(lines) > 3 and max(map(len, lines)) <= 80, lines
        assert not any("e+" in line for line in lines)
