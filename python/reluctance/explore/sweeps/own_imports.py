"""What a Python file imports of the user's own code: found in its text, nothing runs."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from importlib.machinery import PathFinder
from pathlib import Path

from reluctance.drive.laws.own_code import NOT_OF_THE_USER


def own_imports(file: Path) -> list[Path]:
    """The files of the modules and whole packages that a file imports, and those that these import;
    none of Python, of installed packages or of this one."""
    found: dict[Path, None] = {}
    left = [file]
    while left:
        for name in sorted(set(_imported(left.pop()))):
            for path in _files(name):
                if path not in found:
                    found[path] = None
                    left.append(path)
    return sorted(found)


def _imported(file: Path) -> Iterator[str]:
    """The first parts of the names that a file imports by `import` and `from`."""
    try:
        tree = ast.parse(file.read_bytes())
    except (SyntaxError, ValueError):  # compiled, or no code
        return
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module.partition(".")[0]


def _files(name: str) -> list[Path]:
    """Of the module or package of a name."""
    if name in sys.stdlib_module_names:
        return []
    spec = PathFinder.find_spec(name)
    if spec is None:
        return []
    places = spec.submodule_search_locations or ([spec.origin] if spec.origin else [])
    own = [Path(at) for at in places if not any(part in at for part in NOT_OF_THE_USER)]
    return [path for at in own for path in (at.rglob("*.py") if at.is_dir() else [at])]
