"""The public surface is checked in, so that every change of it shows in review.

After an intended change: `python tests/cli/test_surface.py` writes both references anew.
"""

import json
import re
import subprocess
import sys
import sysconfig
from pathlib import Path

import typer.main
from typer.testing import CliRunner

from reluctance.cli import app

ROOT = Path(__file__).parents[2]
STUB = ROOT / "python" / "reluctance" / "_core.pyi"
COMMANDS = ROOT / "tests" / "golden" / "commands.json"


def stub(path: Path) -> str:
    """The stub of the extension module as nanobind writes it."""
    command = [sys.executable, "-m", "nanobind.stubgen", "-q", "-m", "reluctance._core", "-o", path]
    subprocess.run(command, check=True)
    return path.read_text()


def commands() -> dict[str, dict[str, str]]:
    """Every command with its arguments and options, what their help says, and in brackets what an
    option is by default."""
    found = {}

    def visit(command, name: str) -> None:
        parameters = {"": command.help or ""}
        for p in command.params:
            key = " ".join(p.opts) if p.param_type_name == "option" else p.metavar or p.name
            usual = f" [{p.default}]" if p.default not in (None, False) else ""
            parameters[key] = (getattr(p, "help", None) or "") + usual
        found[name] = parameters
        for below, inner in getattr(command, "commands", {}).items():
            visit(inner, f"{name} {below}")

    visit(typer.main.get_command(app), "reluctance")
    return dict(sorted(found.items()))


def test_stub_is_that_of_the_module(tmp_path: Path) -> None:
    assert stub(tmp_path / "_core.pyi") == STUB.read_text()


def test_commands_and_options_are_those_checked_in() -> None:
    """Their names and help, not its layout, which is the library's."""
    assert commands() == json.loads(COMMANDS.read_text())


def test_no_summary_in_a_list_of_commands_is_cut_at_80_columns() -> None:
    for name in {name.rpartition(" ")[0] for name in commands()} - {""}:
        done = CliRunner().invoke(app, [*name.split()[1:], "--help"], env={"COLUMNS": "80"})
        listed = done.stdout.partition("Commands:")[2]
        assert listed and "..." not in listed, listed


def test_every_command_prints_its_help() -> None:
    for name in commands():
        done = CliRunner().invoke(app, [*name.split()[1:], "--help"])
        assert (done.exit_code, done.stderr) == (0, ""), name
        assert "Usage: " in done.stdout, name


def test_bindings_use_the_stable_abi_alone() -> None:
    """One wheel serves Python 3.12 and later: what the bindings call themselves must be declared
    where Python.h is limited to the stable interface."""
    used = set()
    for file in sorted((ROOT / "bindings").glob("*.[ch]pp")):
        used |= set(re.findall(r"\bPy[A-Z]\w*(?=\()|\bPy_\w+(?=\()", file.read_text()))
    assert "PyErr_CheckSignals" in used
    source = "#define Py_LIMITED_API 0x030B0000\n#include <Python.h>\n"
    command = ["g++", "-E", "-x", "c++", "-I", sysconfig.get_path("include"), "-"]
    declared = subprocess.run(command, input=source, capture_output=True, text=True, check=True)
    names = set(re.findall(r"\bPy\w+", declared.stdout))
    assert used <= names, used - names


if __name__ == "__main__":
    stub(STUB)
    COMMANDS.write_text(json.dumps(commands(), indent=1) + "\n")
