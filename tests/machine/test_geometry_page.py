"""Every command of docs/geometry.md as printed, from its own files, on a coarse mesh."""

import re
import shlex
from pathlib import Path

import pytest
from command import command
from geometries import COARSE

import reluctance as rl
from reluctance.explore.sweeps.vary import samples
from reluctance.machine.geometry import solved

PAGE = Path(__file__).parents[2] / "docs" / "geometry.md"
FEW = "\nangles = 13\ncurrents = 6\n"


@pytest.fixture
def folder(tmp_path):
    """The files that the page prints, with few nodes in the map."""
    folder = tmp_path
    files = re.findall(r"```toml\n# (\S+\.toml)\n(.*?)```", PAGE.read_text(), flags=re.S)
    assert [name for name, _ in files] == ["my.toml", "drive.toml"]
    for name, text in files:
        text = re.sub(r"\ncurrent_max_A = \d+\n", lambda line: line[0].rstrip() + FEW, text)
        (folder / name).write_text(text)
    assert FEW in (folder / "my.toml").read_text()
    return folder


@pytest.fixture(autouse=True)
def coarse(folder, monkeypatch):
    monkeypatch.setattr(solved, "Grid", lambda: COARSE)
    monkeypatch.chdir(folder)


def lines():
    """The commands of the page, each on a line."""
    blocks = re.findall(r"```sh\n(.*?)```", PAGE.read_text().replace("\\\n", ""), flags=re.S)
    return [line for block in blocks for line in block.splitlines()]


SLOW = "--vary control."  # the search over five keys
MADE = "reluctance machine from-geometry my.toml --out my_machine.toml"


def works(line):
    program, *arguments = shlex.split(line)
    assert program == "reluctance"
    if arguments[0] == "tune":  # each trial is a field of its own
        arguments += ["--budget", "2", "--until", "0.05"]
    done = command(*arguments)
    assert done.code == 0, f"{line}: {done.error}"


@pytest.mark.long
def test_the_commands_of_the_page_work_as_printed():
    for line in lines():
        if SLOW not in line:
            works(line)


@pytest.mark.long
def test_poles_and_law_are_tuned_together_as_printed():
    first, *others = lines()
    for line in (first, *(line for line in others if SLOW in line)):
        works(line)


def test_the_drive_of_the_page_holds_its_torque_within_the_current_limit():
    works(MADE)
    drive = rl.load("drive.toml")
    kpis = rl.simulate(drive, record=None).kpis
    assert kpis.tau_mean == pytest.approx(drive.reference.tau_Nm, rel=0.02)
    assert kpis.i_peak < 0.95 * drive.machine.i_max_A


def test_whole_numbers_of_a_geometry_stay_whole():
    works(MADE)
    drive = rl.load("drive.toml", ["machine=my.toml"])
    ranges = {"machine.winding.turns_per_pole": [120, 140], "machine.air_gap.length_mm": [0.2, 0.3]}
    found = samples(drive, ranges, 8, sobol=True, seed=0)
    assert all(type(turns) is int for turns in found["machine.winding.turns_per_pole"])
    assert all(type(gap) is float for gap in found["machine.air_gap.length_mm"])
