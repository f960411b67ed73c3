"""No result replaces a file that its command reads, wherever the file is named."""

import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from reluctance.base.files import check_place
from reluctance.cli import app
from reluctance.machine.library import machine_table

EXAMPLES = Path(__file__).parents[2] / "examples"
COURSE = "t_s,tau_Nm\n0,10\n0.02,20\n"


def answer(*words):
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A drive with a flux map beside it, a table of angles and a course."""
    monkeypatch.chdir(tmp_path)
    library = EXAMPLES.parent / "machines"
    for path in library.glob("npf_vector_6_4*"):
        shutil.copy(path, tmp_path)
    for name in ("angle_table.csv", "angle_table.toml"):
        shutil.copy(EXAMPLES / name, tmp_path)
    (tmp_path / "course.csv").write_text(COURSE)
    text = (EXAMPLES / "map_mpc.toml").read_text()
    assert machine_table("npf_vector_6_4", tmp_path)
    (tmp_path / "d.toml").write_text(text)
    return tmp_path


@pytest.mark.parametrize(
    ("words", "kept"),
    [
        (["run", "angle_table.toml", "--until", "0.01", "--out", "angle_table.csv"], None),
        (
            [
                *("run", EXAMPLES / "deadbeat.toml", "--until", "0.01"),
                *("--set", "reference.tau_Nm=course.csv", "--out", "course.csv"),
            ],
            "course.csv",
        ),
        (
            [
                *("sweep", "angle_table.toml", "--set", "simulation.until_s=0.01"),
                *("--vary", "load.speed_rpm=900:1000:2", "--table", "angle_table.csv"),
            ],
            None,
        ),
    ],
)
def test_a_file_that_the_command_reads_stays(place, words, kept):
    kept = place / (kept or "angle_table.csv")
    before = kept.read_bytes()
    answered = answer(*words)
    assert answered.exit_code != 0
    assert f"{kept.name} is read by this command" in str(answered.exception) + answered.output
    assert kept.read_bytes() == before


def test_a_flux_map_stays(place):
    """That a machine file names."""
    maps = {path: path.read_bytes() for path in place.glob("npf_vector_6_4*.csv")}
    assert maps
    for path in maps:
        answered = answer(
            *("run", "d.toml", "--set", "machine=npf_vector_6_4.toml", "--until", "0.005"),
            *("--out", path.name),
        )
        assert "is read by this command" in str(answered.exception) + answered.output
        assert path.read_bytes() == maps[path]


def test_a_result_may_replace_a_result(place):
    """The next command begins anew."""
    words = ("run", "angle_table.toml", "--until", "0.005", "--out", "w.csv")
    assert answer(*words).exit_code == 0
    assert answer(*words).exit_code == 0


def test_after_a_command_python_may_write_what_it_read(place):
    """A command that ends leaves nothing behind, in a notebook that runs one."""
    assert answer("run", "angle_table.toml", "--until", "0.005").exit_code == 0
    check_place(place / "angle_table.csv")
