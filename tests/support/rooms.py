"""Rooms and arrows of the project: `python tests/support/rooms.py` prints them.

A room is a wing of the Python package, or a folder of code beside it. An arrow is a pair of rooms
of which one imports or includes a file of the other, function-level imports included.
"""

import ast
import re
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "python" / "reluctance"
BESIDE = ("bench", "bindings", "firmware", "include", "machines", "studies", "web")
INCLUDE = re.compile(r'^\s*#\s*include\s+["<]([^">]+)[">]', re.M)


def room(path: Path) -> str:
    if PACKAGE in path.parents:
        return path.relative_to(PACKAGE).parts[0] if path.parent != PACKAGE else "reluctance"
    return path.relative_to(ROOT).parts[0]


def files() -> list[Path]:
    places = (PACKAGE, *(ROOT / name for name in BESIDE))
    kinds = {".py", ".c", ".h", ".cpp", ".hpp"}
    return sorted(p for place in places for p in place.rglob("*") if p.suffix in kinds)


def python_imports(path: Path) -> set[str]:
    """Rooms that a Python file names."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        for parts in (name.split(".") for name in names):
            if parts[0] == "reluctance":
                inner = len(parts) > 1 and (PACKAGE / parts[1]).is_dir()
                found.add(
                    "bindings" if parts[1:2] == ["_core"] else parts[1] if inner else parts[0]
                )
    return found


def c_includes(path: Path, everything: list[Path]) -> set[str]:
    """Rooms whose files a file of C or C++ includes."""
    ends = [f"/{written}" for written in INCLUDE.findall(path.read_text(encoding="utf-8"))]
    return {room(p) for p in everything if any(p.as_posix().endswith(end) for end in ends)}


def rooms_and_arrows() -> tuple[set[str], set[tuple[str, str]]]:
    everything = files()
    arrows = set()
    for path in everything:
        to = python_imports(path) if path.suffix == ".py" else c_includes(path, everything)
        arrows |= {(room(path), other) for other in to if other != room(path)}
    return {room(path) for path in everything}, arrows


def main() -> None:
    rooms, arrows = rooms_and_arrows()
    to = defaultdict(list)
    for one, other in sorted(arrows):
        to[one].append(other)
    for name in sorted(rooms):
        print(f"{name:12}{', '.join(to[name])}")
    print(f"{len(rooms)} rooms, {len(arrows)} arrows")


if __name__ == "__main__":
    main()
