"""Forms of the core that `make run` leaves out, compiled when they are first asked for."""

from __future__ import annotations

import fcntl
import subprocess
import sys
from pathlib import Path

import pytest

from reluctance.base import other_forms
from reluctance.base.errors import ParameterError
from reluctance.base.resources import resources

FILES = ["law_edge_mpc.cpp", "forms_control.cpp", "other_loops.cpp"]
# Loads a file, and says what runs of its forms give, with what is compiled into the core and with
# what it has added.
RUNS = """
import sys
import numpy as np
import reluctance as rl
from reluctance.base import other_forms

def columns(name, *values):
    run = rl.simulate(rl.load(f"{sys.argv[1]}/{name}.toml", values), until=0.004)
    return np.vstack([run.t, run.tau, run.i])

def runs():
    yield columns("edge_mpc_mcu", "control.precision=float")
    yield columns("coupled_phases")
    yield columns("ditc", "control.precision=float")
    yield columns("five_phases_losses")

before = list(runs())
other_forms.load(sys.argv[2])
assert all(np.array_equal(a, b) for a, b in zip(before, runs(), strict=True))
print("same")
"""


@pytest.mark.long
@pytest.mark.parametrize("file", FILES)
def test_a_file_that_is_compiled_later_gives_the_same_bits(file, tmp_path, monkeypatch):
    monkeypatch.setenv("RELUCTANCE_CACHE", str(tmp_path))
    command = [sys.executable, "-c", RUNS, str(resources("examples")), file]
    first, again = (
        subprocess.run(command, capture_output=True, text=True, check=True) for _ in range(2)
    )
    assert first.stdout == again.stdout == "same\n"
    assert first.stderr.count("compiling other forms of ") == 1
    assert "compiling" not in again.stderr


def test_the_module_of_a_file_calls_its_last_function():
    """Which binds a law, or the two files beside the laws."""
    laws = sorted(resources("bindings").glob("law_*.cpp"))
    found = {path.stem: other_forms.source([path]) for path in laws if path.stem != "law_parts"}
    assert len(found) >= 8
    for text in found.values():
        assert "  bind_built_in<srm::laws::" in text
    for name, calls in (
        ("forms_control", "bind_controllers<"),
        ("other_loops", "bind_other_loops("),
    ):
        assert f"  {calls}" in other_forms.source([resources("bindings") / f"{name}.cpp"])


def test_without_a_compiler_it_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setenv("RELUCTANCE_CACHE", str(tmp_path))
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CXX", raising=False)
    with pytest.raises(ParameterError, match=r"first asked for, and no C.. compiler; on Debian"):
        other_forms.load("law_ditc.cpp")
    assert not list(tmp_path.glob("*.so"))


@pytest.mark.parametrize("writable", [True, False])
def test_a_damaged_file_is_made_again(writable, tmp_path, monkeypatch, capsys):
    made, loaded = [], []
    place = tmp_path if writable else tmp_path / "no" / "folder"
    (tmp_path / "no").write_text("")
    monkeypatch.setenv("RELUCTANCE_CACHE", str(place))

    def compile_extension(text: str, out: Path, **_: object) -> None:
        made.append(text)
        out.write_text("whole")

    def load_extension(_: str, path: Path) -> None:
        if not path.is_file() or path.read_text() != "whole":
            raise ImportError
        loaded.append(path)

    monkeypatch.setattr(other_forms, "compile_extension", compile_extension)
    monkeypatch.setattr(other_forms, "load_extension", load_extension)
    for _ in range(2):
        other_forms.load("law_ditc.cpp")
    assert len(made) == (1 if writable else 2) and len(loaded) == 2
    if writable:
        loaded[-1].write_text("half")
        other_forms.load("law_ditc.cpp")
        assert len(made) == 2
    assert "once: about 20 s" in capsys.readouterr().err


def test_a_process_waits_for_another_one_that_compiles(tmp_path):
    """In a folder that is new, and in one that is there."""
    for place in (tmp_path / "new", tmp_path):
        with other_forms._alone(place), (place / "other_forms.lock").open() as lock:
            with pytest.raises(BlockingIOError):
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        with (place / "other_forms.lock").open() as lock:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
