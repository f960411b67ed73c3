"""Whole ways through the program, command by command as a user types them."""

import base64
import json
import re

import numpy as np
import pytest
from command import command
from emulated_board import MACHINES, walk
from firmware_tools import ROOT, needs_target
from pages import blocks, commands
from pvgis_file import pvgis_file

import reluctance as rl
from reluctance.pumping import load_system

HEADER = "i_A,theta_deg,psi_Wb,tau_Nm"  # as docs/your_machine.md has it
OWN = ROOT / "examples" / "own_law" / "own_law.toml"


def done(*arguments):
    found = command(*arguments)
    assert found.code == 0, found.error
    return found.out


def own_table(path):
    """Flux linkage and torque of the 6/4 machine, in mechanical degrees from unaligned."""
    machine = rl.load(ROOT / "examples" / "paper_rated.toml").machine
    rows = [HEADER]
    for i in np.linspace(0, machine.i_max_A, 31):
        for theta_e in np.linspace(0, np.pi, 46):
            values = machine.psi(i, theta_e), machine.tau(i, theta_e)
            angle = np.degrees(theta_e) / machine.N_r
            rows.append(",".join(f"{float(x):.7g}" for x in (i, angle, *values)))
    path.write_text("\n".join(rows) + "\n")
    return machine


@needs_target
@pytest.mark.long
def test_from_an_own_table_to_a_rotor_that_turns(tmp_path, monkeypatch):
    """The table has the header that the page quotes; the emulated board is commissioned with its
    own commands, and ends with a turning rotor."""
    assert HEADER in (ROOT / "docs" / "your_machine.md").read_text()
    machine = own_table(tmp_path / "fe.csv")
    assert "good" in done("map", "check", tmp_path / "fe.csv", "--N_r", machine.N_r)
    winding = ("--N_s", 6, "--N_r", machine.N_r, "--R_ohm", machine.R_ohm)
    winding += ("--J_kgm2", machine.J_kgm2)
    done("map", "import", tmp_path / "fe.csv", *winding, "--out", tmp_path / "motor.toml")
    monkeypatch.setitem(MACHINES, "motor.toml", MACHINES["paper_6_4"])
    walked, said = walk("motor.toml", tmp_path)
    assert walked.torque_error_pct < 2
    assert walked.zero_error_counts < 1
    assert 0.8 < walked.spin_rpm / (walked.speed_limit_rpm + 1) < 1  # printed in whole rpm
    assert walked.trips == 4
    assert "as it must be" in said["wiring"]


def test_from_an_own_law_to_a_figure_with_its_letters(tmp_path):
    """A law in Python, run and drawn at the width of a column: the file has its letters in it."""
    figure = tmp_path / "own.pdf"
    done("run", OWN, "--trust", "--until", "0.05", "--plot", figure, "--width", "88mm")
    page = figure.read_bytes()
    assert page.startswith(b"%PDF")
    fonts = re.findall(rb"/BaseFont /(\S+)", page)
    assert fonts and page.count(b"/FontFile2") >= len(set(fonts))
    assert b"/Type3" not in page
    (box,) = set(re.findall(rb"/MediaBox \[ 0 0 ([\d.]+) ", page))
    assert float(box) / 72 * 25.4 == pytest.approx(88, abs=1)


@needs_target
@pytest.mark.long
def test_from_the_sun_to_the_day_of_the_controller_in_firmware(tmp_path, monkeypatch):
    """Every command of the page, on a system with the page's module and a file of PVGIS: water of
    the year, the string that serves, and the package's controller on the emulated core, which
    takes at most 2 % less than the array has, over a cloud."""
    monkeypatch.chdir(tmp_path)
    said = {}
    for words in commands("sun_to_firmware.md"):
        said.setdefault(" ".join(words[:2]), done(*words))
        if words[0] == "examples":
            as_the_pages_say(tmp_path / "sun_village.toml")
    year = json.loads(done("pump", "sun_village.toml", "--json"))
    assert f"{year['water_m3']:.0f}" in said["pump sun_village.toml"]
    assert year["days"] == 365 and year["e_lift_kWh"] < 0.7 * year["e_mp_kWh"]
    assert "smallest array" in said["size sun_village.toml"]
    assert (tmp_path / "cloud.png").read_bytes().startswith(b"\x89PNG")
    taken = re.search(r"energy from the array.*?([\d.]+) ?%", said["run sun_village.toml"])
    assert float(taken[1]) > 98
    on_target = re.search(r"tracking\W+([\d.]+)\W+([\d.]+)", said["export pil"])
    assert float(on_target[1]) > 0.98
    assert on_target[1] == on_target[2]
    assert {"README.md", "main.c"} <= {
        path.name for path in (tmp_path / "village_firmware").iterdir()
    }
    assert rl.load(tmp_path / "village_on_array.toml").source.n_series == 5


def as_the_pages_say(system):
    """The village with the module of docs/sun_to_firmware.md, and the typical year of
    docs/pumping.md."""
    (module,) = blocks("sun_to_firmware.md", "toml")
    (weather,) = (text for text in blocks("pumping.md", "toml") if "pvgis" in text)
    text = system.read_text()
    for table, block in (("array", module), ("weather", weather)):
        text = re.sub(rf"^\[{table}\]\n.*?(?=^\[)", block + "\n", text, flags=re.S | re.M)
    system.write_text(text)
    pvgis_file(system.with_name("tmy_nairobi.csv"), load_system(system).site, tmy=True)


@pytest.mark.long
def test_a_notebook_has_its_pictures_in_it(tmp_path):
    """The Python of two pages as cells, executed as an editor of notebooks does."""
    nbformat = pytest.importorskip("nbformat", reason="needs nbformat")
    nbclient = pytest.importorskip("nbclient", reason="needs nbclient")
    pytest.importorskip("ipykernel", reason="needs ipykernel")
    done("examples", "paper_rated", "--copy", tmp_path / "examples")
    (first,) = blocks("start.md", "python")
    (second,) = blocks("paper_figures.md", "python")
    cells = [first, "result", second, "figure"]
    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(text) for text in cells])
    where = {"metadata": {"path": str(tmp_path)}}
    nbclient.NotebookClient(book, timeout=120, kernel_name="python3", resources=where).execute()
    nbformat.write(book, tmp_path / "run.ipynb")
    saved = json.loads((tmp_path / "run.ipynb").read_text())
    printed, table, _, picture = (cell["outputs"] for cell in saved["cells"])
    assert re.search(r"mean torque [\d.]+ N m", "".join(printed[0]["text"]))
    assert "<table" in "".join(table[0]["data"]["text/html"])
    png = base64.b64decode("".join(picture[0]["data"]["image/png"]))
    assert png.startswith(b"\x89PNG") and len(png) > 20_000
    assert b"/FontFile2" in (tmp_path / "fig.pdf").read_bytes()
