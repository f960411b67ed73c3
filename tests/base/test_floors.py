"""The wings of the Python package: what stands where, and that no import goes upwards."""

import ast
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest
from rooms import rooms_and_arrows

import reluctance

PACKAGE = Path(__file__).parents[2] / "python" / "reluctance"
WINGS = (  # from the ground up; a wing imports only from those of the lines below, and from itself
    {"base"},
    {"machine", "plant"},
    {"drive"},
    {"explore"},
    {"paper", "pumping"},
    {"targets"},
    {"cli"},
    {"__main__"},  # `python -m reluctance`
)
HEAVY = (
    *("casadi", "scipy", "matplotlib", "typer", "rich", "pandas", "pyarrow"),
    *("sqlite3", "dask", "optuna", "gymnasium"),
)


def modules() -> dict[str, Path]:
    """Every module of the package by its name below `reluctance`."""
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        found[name] = path
    return found


MODULES = modules()


def imports(path: Path) -> set[str]:
    """What a module imports of the package, function-level imports included. `from package import
    module` runs the package's __init__ by name: within that package it is an import of it too."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: a relative import"
            base = node.module or ""
            if path.name != "__init__.py" and base == f"reluctance.{path.parent.name}":
                found.add(base)
            for alias in node.names:
                inner = f"{base}.{alias.name}".removeprefix("reluctance").removeprefix(".")
                found.add(f"{base}.{alias.name}" if inner in {*MODULES, "_core"} else base)
    ours = {
        name.removeprefix("reluctance").removeprefix(".")
        for name in found
        if name == "reluctance" or name.startswith("reluctance.")
    }
    return ours


ARROWS = {(name, other) for name, path in MODULES.items() for other in imports(path) if other}


def wing(name: str) -> str:
    return name.partition(".")[0]


def test_the_package_is_nine_wings() -> None:
    assert {wing(name) for name in MODULES if name} == set.union(*WINGS)
    files = {path.name for path in PACKAGE.glob("*.py*")}
    assert files == {"__init__.py", "__init__.pyi", "__main__.py", "_core.pyi"}


@pytest.mark.parametrize("name", [name for name in MODULES if name])
def test_no_import_goes_upwards(name: str) -> None:
    level = {wing: n for n, wings in enumerate(WINGS) for wing in wings}
    for other in (b for a, b in ARROWS if a == name and b != "_core"):
        if wing(other) != wing(name):
            assert level[wing(other)] < level[wing(name)], f"{name} imports {other}"


def test_imports_form_no_circle() -> None:
    left = {name: {b for a, b in ARROWS if a == name and b in MODULES} for name in MODULES}
    while free := {name for name, others in left.items() if not others}:
        left = {name: others - free for name, others in left.items() if name not in free}
    assert not left, f"in or above a circle: {sorted(left)}"


USED = "import reluctance as rl; rl.load, rl.simulate, rl.sweep, rl.Drive"


def loaded(code: str) -> set[str]:
    """The modules that a line loads."""
    code += "; import sys; print(*sys.modules)"
    return set(subprocess.check_output([sys.executable, "-c", code], text=True).split())


def libraries(code: str) -> set[str]:
    return {name.partition(".")[0] for name in loaded(code)}


def test_a_bare_import_loads_nothing_else() -> None:
    """So it costs less than numpy and pydantic, whatever else the computer does."""
    assert not libraries("import reluctance") & {"numpy", "pydantic", *HEAVY}


def test_heavy_libraries_load_when_they_are_used() -> None:
    assert "numpy" in (used := libraries(USED))
    assert not set(HEAVY) & used


def test_the_command_line_starts_without_heavy_libraries() -> None:
    """Each command imports its own: `reluctance --help` and `run` wait for none."""
    run = "import sys; sys.argv = ['reluctance', 'run', 'examples/paper_rated.toml', '--json']"
    code = f"{run}; sys.exit = lambda code: None; from reluctance.cli import main; main()"
    assert "reluctance.cli.run" in loaded(code)
    assert not ({*HEAVY} - {"typer", "rich"}) & libraries(code)


def test_a_map_is_read_without_matplotlib() -> None:
    assert "matplotlib" not in libraries("import reluctance.machine.maps")


def test_use_loads_little_more_than_numpy_and_pydantic() -> None:
    """Modules besides our own, which are small, are counted: times depend on what else runs."""
    theirs = loaded("import numpy; from pydantic import BaseModel")
    others = {name for name in loaded(USED) if name.partition(".")[0] != "reluctance"}
    assert len(others) <= 1.2 * len(theirs)


def test_names_of_the_package_are_what_its_stub_says() -> None:
    """Also after a module of the same part has been imported."""
    for name in reluctance.__all__:
        found = getattr(reluctance, name)
        assert found.__name__ == name, name
    assert not {*reluctance.__all__} & {part.partition(".")[0] for part in MODULES}


ROOT = PACKAGE.parents[1]
C_FOLDERS = ("include", "bindings", "firmware", "web", "bench")
C_FILES = {
    path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
    for folder in C_FOLDERS
    for path in sorted((ROOT / folder).rglob("*"))
    if path.suffix in (".h", ".hpp", ".c", ".cpp")
}
INCLUDES = {  # of files of this project, by the path that the include ends with
    name: {
        other
        for written in re.findall(r'^\s*#\s*include\s+["<]([^">]+)[">]', text, re.M)
        for other in C_FILES
        if f"/{other}".endswith(f"/{written}")
    }
    for name, text in C_FILES.items()
}


def folder(name: str) -> str:
    return name.rpartition("/")[0]


ROOMS = {  # of the core: a package's files are of several folders here, and of one when exported
    (folder(a), folder(b))
    for a, others in INCLUDES.items()
    for b in others
    if a.startswith("include")
}
FOLDER_INCLUDES = {a: {other for room, other in ROOMS if room == a != other} for a, _ in ROOMS}


@pytest.mark.parametrize("left", [INCLUDES, FOLDER_INCLUDES], ids=["files", "folders"])
def test_includes_of_c_form_no_circle(left: dict[str, set[str]]) -> None:
    while free := {name for name, others in left.items() if not others}:
        left = {name: others - free for name, others in left.items() if name not in free}
    assert not left, f"in or above a circle: {sorted(left)}"


def test_includes_of_c_are_found() -> None:
    assert sum(map(len, INCLUDES.values())) > 300


@pytest.mark.parametrize("name", sorted(reluctance._PUBLIC))
def test_a_public_part_is_found_without_its_wing(name: str) -> None:
    """By import and as an attribute, with what stands in it: the same module, not a copy."""
    wing = reluctance._PUBLIC[name]
    there = import_module(f"reluctance.{wing}.{name}")
    assert import_module(f"reluctance.{name}") is there is getattr(reluctance, name)
    assert there.__spec__ is not None and there.__spec__.name == f"reluctance.{wing}.{name}"
    inner = next(m for m in sorted(MODULES) if m.startswith(f"{wing}.{name}."))
    short = inner.removeprefix(f"{wing}.")
    assert import_module(f"reluctance.{short}") is import_module(f"reluctance.{inner}")


def test_a_newcomer_sees_few_rooms_and_few_arrows() -> None:
    rooms, arrows = rooms_and_arrows()
    assert {"base", "drive", "include"} <= rooms and ("drive", "machine") in arrows
    assert len(rooms) <= 20 and len(arrows) <= 60
