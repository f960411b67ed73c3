"""Commands and Python of the pages, as printed, one after the other, in a folder with the examples.

Those of other pages have tests of their own (geometry, extending, commissioning, from the sun to
the firmware), are run while the site is built, or take a file of the reader.
"""

import shlex
import shutil

import pytest
from command import command
from firmware_tools import ROOT, needs_target
from pages import blocks, commands

ON_TARGET = {"firmware.md", "port_stm32g474.md"}
PAGES = [
    *("c_interface.md", "faults.md", "fmu.md", "limit.md", "pumping.md", "pumping_control.md"),
    *("start.md", "control/learning.md", *sorted(ON_TARGET)),
]


@pytest.fixture
def reader(tmp_path, monkeypatch):
    """The folder of a reader, with the examples in it."""
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    (tmp_path / "build").mkdir()
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.long
@pytest.mark.parametrize(
    "page",
    [pytest.param(page, marks=[needs_target] * (page in ON_TARGET)) for page in PAGES],
)
def test_the_commands_of_a_page_run_as_printed(page, reader):
    assert commands(page)
    for words in commands(page):
        done = command(*words)
        assert done.code == 0, f"reluctance {shlex.join(words)}: {done.error}"
        for option in ("--out", "--plot", "--copy"):
            if option in words:
                assert (reader / words[words.index(option) + 1]).exists(), shlex.join(words)


@pytest.mark.long
@pytest.mark.parametrize(
    "page",
    ["commissioning.md", "gymnasium.md", "paper_figures.md", "pumping.md", "start.md", "sweep.md"],
)
@pytest.mark.usefixtures("reader")
def test_the_python_of_a_page_runs_as_printed(page):
    own = {}
    for block in blocks(page, "python"):
        exec(block, own)
    assert len(own) > 2  # names that the page defines
