"""The floors of the Python package: what stands where, and that no import goes upwards."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "python" / "reluctance"
FLOORS = (  # from the ground up; a part imports only from floors below, and from itself
    {"_core", "errors", "units", "files", "resources", "cache", "figures", "interactive"},
    {"maps"},
    {"drive"},
    {"run", "limit"},
    {"laws"},
    {"load"},
    {"sweep"},
    {"efficiency"},
    {"tune"},
    {"compare", "export", "gym", "paper", "pumping"},
    {"studio", "commission"},
    {"cli"},
)
GROUND = {
    "_core": 0,
    "errors": 0,
    "resources": 0,
    "cache": 0,
    "units": 1,
    "files": 1,
    "interactive": 1,
    "figures": 2,
}
ARGUED = {  # an arrow upwards, with the reason
    ("drive.drive", "load"): "drive.with_values(...) reads best; which laws exist, load knows",
    ("run.result", "run.plots"): "result.plot() reads best; Matplotlib loads when it is used",
    ("sweep.found", "sweep.plots"): "likewise",
}
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
    """What a module imports of the package, function-level imports included."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: a relative import"
            base = node.module or ""
            for alias in node.names:
                inner = f"{base}.{alias.name}".removeprefix("reluctance").removeprefix(".")
                found.add(f"{base}.{alias.name}" if inner in {*MODULES, "_core"} else base)
    ours = {
        name.removeprefix("reluctance").removeprefix(".")
        for name in found
        if name == "reluctance" or name.startswith("reluctance.")
    }
    return ours


ARROWS = {
    (name, other)
    for name, path in MODULES.items()
    for other in imports(path)
    if other and (name, other) not in ARGUED
}


def floor(name: str) -> int:
    part = name.partition(".")[0]
    return next(level for level, parts in enumerate(FLOORS) if part in parts)


def test_every_module_has_its_floor() -> None:
    assert {name.partition(".")[0] for name in MODULES if name} | {"_core"} == set.union(*FLOORS)


@pytest.mark.parametrize("name", [name for name in MODULES if name])
def test_no_import_goes_upwards(name: str) -> None:
    part = name.partition(".")[0]
    for other in (b for a, b in ARROWS if a == name):
        if other.partition(".")[0] == part:
            continue
        if part in GROUND:
            assert GROUND[other] < GROUND[part], f"{name} imports {other}"
        else:
            assert floor(other) < floor(name), f"{name} imports {other}, above or beside it"


def test_imports_form_no_circle() -> None:
    left = {name: {b for a, b in ARROWS if a == name and b in MODULES} for name in MODULES}
    while free := {name for name, others in left.items() if not others}:
        left = {name: others - free for name, others in left.items() if name not in free}
    assert not left, f"in or above a circle: {sorted(left)}"


def test_arguments_for_arrows_upwards_are_needed() -> None:
    for name, other in ARGUED:
        assert other in imports(MODULES[name]), f"{name} no longer imports {other}: remove it"


def test_no_module_hides_the_drive_from_the_interpreter() -> None:
    """An import for the type checker alone hides a circle."""
    for name, path in MODULES.items():
        text = path.read_text()
        hidden = text.partition("if TYPE_CHECKING:")[2].partition("\n\n")[0]
        assert "Drive" not in hidden, name


def test_heavy_libraries_load_when_they_are_used() -> None:
    code = "import sys, reluctance; print(*{m.partition('.')[0] for m in sys.modules})"
    loaded = subprocess.check_output([sys.executable, "-c", code], text=True).split()
    assert "numpy" in loaded
    assert not set(HEAVY) & set(loaded)


def test_import_costs_at_most_twice_that_of_numpy_and_pydantic(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """User CPU time, in turns, the least of each: other work on the computer only adds to it. All
    modules are compiled before."""
    monkeypatch.delenv("PYTHONDONTWRITEBYTECODE", raising=False)
    monkeypatch.setenv("PYTHONPYCACHEPREFIX", str(tmp_path))
    cpu("import reluctance")
    ours, theirs = [], []
    while len(ours) < 5 or (min(ours) >= 2 * min(theirs) and len(ours) < 25):
        ours.append(cpu("import reluctance"))
        theirs.append(cpu("import numpy, pydantic"))
    assert min(ours) < 2 * min(theirs), (ours, theirs)


def cpu(code: str) -> float:
    """User CPU time of a Python that runs a line [s]."""
    timed = (
        "import resource, subprocess, sys; subprocess.run([sys.executable, '-c', sys.argv[1]], "
        "check=True); print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime)"
    )
    return float(subprocess.check_output([sys.executable, "-c", timed, code], text=True))
