"""The public surface is checked in, so that every change of it shows in review.

After an intended change: `python tests/cli/test_surface.py` writes the references anew.
"""

import importlib
import json
import re
import subprocess
import sys
import sysconfig
from pathlib import Path

import typer.main
from pydantic.fields import FieldInfo
from typer.testing import CliRunner

from reluctance.base.schema import Section
from reluctance.cli import app
from reluctance.cli.schema import json_schema

ROOT = Path(__file__).parents[2]
STUB = ROOT / "python" / "reluctance" / "_core.pyi"
COMMANDS = ROOT / "tests" / "golden" / "commands.json"
KEYS = ROOT / "tests" / "golden" / "keys.json"
PACKAGE = ROOT / "python"
BOUNDS = ("gt", "ge", "lt", "le", "min_length", "max_length", "pattern")


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


def keys() -> dict[str, dict[str, str]]:
    """Every table of every file with its keys: by default what, and between which bounds."""
    json_schema()  # it takes the tables of all laws
    for file in sorted(PACKAGE.rglob("*.py")):
        if "Section" in file.read_text(encoding="utf-8"):
            place = file.relative_to(PACKAGE).with_suffix("")
            importlib.import_module(".".join(place.parts))
    found = {}
    below = [Section]
    while below:
        section = below.pop()
        below += section.__subclasses__()
        if _named(section):
            found[section.__qualname__] = {
                name: " ".join([told(field), *bounds(field)])
                for name, field in section.model_fields.items()
            }
    return dict(sorted(found.items()))


def _named(section: type[Section]) -> bool:
    """Whether the package has it under its name; those of own laws are made while it runs."""
    module = sys.modules.get(section.__module__)
    ours = section.__module__.startswith("reluctance.")
    return ours and getattr(module, section.__name__, None) is section


def told(field: FieldInfo) -> str:
    default = field.get_default(call_default_factory=True)
    if field.is_required():
        return "must be given"
    return default.__class__.__name__ if isinstance(default, Section) else repr(default)


def bounds(field: FieldInfo) -> list[str]:
    return [
        f"{name} {getattr(part, name)}"
        for part in field.metadata
        for name in BOUNDS
        if getattr(part, name, None) is not None
    ]


def test_stub_is_that_of_the_module(tmp_path: Path) -> None:
    assert stub(tmp_path / "_core.pyi") == STUB.read_text()


def test_commands_and_options_are_those_checked_in() -> None:
    """Their names and help, not its layout, which is the library's."""
    assert commands() == json.loads(COMMANDS.read_text())


def test_keys_of_files_have_the_defaults_and_bounds_checked_in() -> None:
    assert keys() == json.loads(KEYS.read_text())


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
    for file, surface in ((COMMANDS, commands()), (KEYS, keys())):
        file.write_text(json.dumps(surface, indent=1) + "\n")
