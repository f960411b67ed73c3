"""Question: which small faults of the code does no test see?

    python tests/support/mutants.py [--seed N] [--python N] [--cpp N] [--jobs N] [--only PART]

Draws places in python/reluctance and include/srm from a seed (new and printed without one), changes
one operator, number, condition or statement there in a copy, and runs the tests nearest to it:
of the package the test files that name what was changed, the rarest names first; of the headers the
checks in tests/core that include them. A change that no test fails is printed as a survivor.

Why no kept library: mutmut and cosmic-ray make and run every mutant of a package against one test
command. Here a draw of a hundred must end in half an hour, each against the tests next to it, and
the copies of the package share one built extension.
"""

from __future__ import annotations

import argparse
import ast
import math
import os
import random
import re
import secrets
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE, HEADERS, TESTS = ROOT / "python" / "reluctance", ROOT / "include", ROOT / "tests"
NEAREST = 4  # test files of a Python mutant
LIMIT = 240  # of a mutant's tests; more is an endless loop [s]
FLAGS = ("-std=c++20", "-O1", "-ffp-contract=off", f"-I{TESTS}/core")
SWAPS: dict[type, type] = {
    **{ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult},
    **{ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt},
    **{ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.And: ast.Or, ast.Or: ast.And},
    **{ast.Pow: ast.Mult, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn},
}
CPP_SWAPS = {
    **{" + ": " - ", " - ": " + ", " * ": " / ", " / ": " * ", " < ": " <= ", " > ": " >= "},
    **{" <= ": " < ", " >= ": " > ", " && ": " || ", " || ": " && ", " == ": " != "},
}


@dataclass(frozen=True)
class Mutant:
    """A changed file."""

    file: Path
    line: int
    before: str
    after: str
    text: str  # of the whole file, changed
    names: tuple[str, ...] = ()  # by which a test may mean the place

    def __str__(self) -> str:
        return f"{self.file.relative_to(ROOT)}:{self.line}: {self.before}  ->  {self.after}"


def changed(node: ast.AST) -> ast.AST | None:
    """The node with its fault, or None where it has none."""
    if isinstance(node, ast.BinOp | ast.BoolOp) and type(node.op) in SWAPS:
        return _with(node, op=SWAPS[type(node.op)]())
    if isinstance(node, ast.Compare) and type(node.ops[0]) in SWAPS:
        return _with(node, ops=[SWAPS[type(node.ops[0])](), *node.ops[1:]])
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        return ast.Constant(node.value * 1.05 if isinstance(node.value, float) else node.value + 1)
    if isinstance(node, ast.Constant) and isinstance(node.value, bool):
        return ast.Constant(not node.value)
    if isinstance(node, ast.If | ast.IfExp):
        return _with(node, test=ast.UnaryOp(ast.Not(), node.test))
    if isinstance(node, ast.Raise):
        return ast.Pass()
    return None


def _with(node: ast.AST, **fields: object) -> ast.AST:
    values = {name: getattr(node, name, None) for name in node._fields} | fields
    return ast.copy_location(type(node)(**values), node)


def python_mutant(file: Path, draw: random.Random) -> Mutant | None:
    """A fault somewhere in a module, but in its text and annotations."""
    source = file.read_text(encoding="utf-8")
    lines = source.splitlines(keepends=True)
    tree = ast.parse(source)
    found: list[tuple[ast.AST, ast.AST, tuple[str, ...]]] = []

    def visit(node: ast.AST, names: tuple[str, ...]) -> None:
        for name, value in ast.iter_fields(node):
            if name in ("annotation", "returns", "decorator_list", "type_params"):
                continue
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.JoinedStr) or not isinstance(child, ast.AST):
                    continue
                inner = names
                if isinstance(child, ast.FunctionDef | ast.ClassDef):
                    inner = (*names, child.name)
                other = changed(child)
                if other is not None:
                    found.append((child, other, inner))
                visit(child, inner)

    visit(tree, ())
    if not found:
        return None
    node, other, names = draw.choice(found)
    assert isinstance(node, ast.expr | ast.stmt)
    before = ast.get_source_segment(source, node) or ""
    after = ast.unparse(ast.fix_missing_locations(other))
    if isinstance(node, ast.expr):
        after = f"({after})"
    else:
        after = after.replace("\n", "\n" + " " * node.col_offset)
    first, last = node.lineno - 1, (node.end_lineno or node.lineno) - 1
    head = lines[first].encode()[: node.col_offset].decode()
    tail = lines[last].encode()[node.end_col_offset :].decode()
    text = "".join([*lines[:first], head, after, tail, *lines[last + 1 :]])
    at = file.relative_to(PACKAGE).with_suffix("")
    where = (*(name.strip("_") for name in names), at.name, ".".join(at.parts))
    short = [" ".join(part.split())[:70] for part in (before, after)]
    return Mutant(file, node.lineno, short[0], short[1], text, where)


def cpp_mutant(file: Path, draw: random.Random) -> Mutant | None:
    """A swapped operator in a header's code."""
    lines = file.read_text(encoding="utf-8").split("\n")
    found = [
        (n, place.start(), place.group())
        for n, line in enumerate(lines)
        if not line.lstrip().startswith(("//", "#", "template", "static_assert"))
        for place in re.finditer("|".join(map(re.escape, CPP_SWAPS)), line.split("//")[0])
    ]
    if not found:
        return None
    n, at, operator = draw.choice(found)
    other = [*lines]
    other[n] = lines[n][:at] + CPP_SWAPS[operator] + lines[n][at + len(operator) :]
    return Mutant(file, n + 1, lines[n].strip()[:80], other[n].strip()[:80], "\n".join(other))


@cache
def tests() -> dict[Path, Counter[str]]:
    """The words of each test file."""
    files = sorted(TESTS.rglob("test_*.py"))
    return {
        file: Counter(re.findall(r"[\w.]+", file.read_text(encoding="utf-8"))) for file in files
    }


def nearest(names: tuple[str, ...]) -> list[Path]:
    """The test files that say most of these names, a rare name counting more."""
    words = {part for name in names for part in (name, f"reluctance.{name}") if len(part) > 2}
    score: Counter[Path] = Counter()
    for word in words:
        those = [file for file, said in tests().items() if said[word]]
        for file in those:
            score[file] += math.log1p(tests()[file][word]) / len(those)
    return [file for file, _ in score.most_common(NEAREST)]


def python_killed(mutant: Mutant) -> bool:
    """Whether a test near the fault fails."""
    with tempfile.TemporaryDirectory() as folder:
        for entry in ROOT.iterdir():  # examples, machines, headers: the package looks for them
            if entry.name != "python":
                (Path(folder) / entry.name).symlink_to(entry)
        copy = Path(folder) / "python" / "reluctance"
        skip = shutil.ignore_patterns("__pycache__")
        shutil.copytree(PACKAGE, copy, ignore=skip, copy_function=os.symlink)
        place = copy / mutant.file.relative_to(PACKAGE)
        place.unlink()
        place.write_text(mutant.text, encoding="utf-8")
        environment = os.environ | {
            "PYTHONPATH": f"{folder}/python",
            "RELUCTANCE_CACHE": f"{folder}/cache",
        }
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider"]
        for file in nearest(mutant.names):
            try:
                done = subprocess.run(
                    [*command, "-m", "not long", str(file)],
                    **{"cwd": ROOT, "env": environment, "capture_output": True, "timeout": LIMIT},
                )
            except subprocess.TimeoutExpired:
                return True
            if done.returncode not in (0, 5):  # 5: no test was collected
                return True
    return False


@cache
def includes(file: Path) -> frozenset[Path]:
    """What a C++ file includes of include/, at any depth."""
    direct = re.findall(r'#include "(srm/[\w/.]+)"', file.read_text(encoding="utf-8"))
    found = {HEADERS / name for name in direct}
    return frozenset(found.union(*(includes(name) for name in found)))


def cpp_killed(mutant: Mutant) -> bool | None:
    """Whether a check fails; None where the fault does not compile."""
    checks = [
        file
        for file in sorted((TESTS / "core").glob("*_check.cpp"))
        if mutant.file in includes(file)
    ]
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "include"
        shutil.copytree(HEADERS, copy)
        (copy / mutant.file.relative_to(HEADERS)).write_text(mutant.text, encoding="utf-8")
        for check in checks:
            program = Path(folder) / check.stem
            built = subprocess.run(
                ["g++", *FLAGS, f"-I{copy}", str(check), "-o", str(program)], capture_output=True
            )
            if built.returncode:
                return None
            try:
                done = subprocess.run([program], capture_output=True, timeout=LIMIT)
            except subprocess.TimeoutExpired:
                return True
            if done.returncode:
                return True
    return False


def drawn(kind: str, count: int, only: str, draw: random.Random) -> list[Mutant]:
    """Mutants of files drawn by their length."""
    folder, pattern = (PACKAGE, "*.py") if kind == "python" else (HEADERS, "*.hpp")
    files = [file for file in sorted(folder.rglob(pattern)) if only in str(file.relative_to(ROOT))]
    if kind == "cpp":
        checks = (TESTS / "core").glob("*_check.cpp")
        seen = frozenset[Path]().union(*(includes(check) for check in checks))
        files = [file for file in files if file in seen]
    sizes = [file.stat().st_size for file in files]
    make = python_mutant if kind == "python" else cpp_mutant
    made: list[Mutant] = []
    while files and len(made) < count:
        mutant = make(draw.choices(files, sizes)[0], draw)
        if mutant is not None:
            made.append(mutant)
    return made


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seed", type=int, default=secrets.randbelow(10**6))
    parser.add_argument("--python", type=int, default=75)
    parser.add_argument("--cpp", type=int, default=25)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--only", default="", help="part of a path, as limit")
    arguments = parser.parse_args()
    print(f"seed {arguments.seed}", flush=True)
    draw = random.Random(arguments.seed)
    for kind, judge in (("python", python_killed), ("cpp", cpp_killed)):
        mutants = drawn(kind, getattr(arguments, kind), arguments.only, draw)
        killed: Counter[str] = Counter()
        count: Counter[str] = Counter()
        with ThreadPoolExecutor(arguments.jobs) as pool:
            for mutant, dead in zip(mutants, pool.map(judge, mutants), strict=True):
                if dead is None:
                    continue
                folder = PACKAGE if kind == "python" else HEADERS / "srm"
                room = mutant.file.relative_to(folder).parts[0]
                count[room] += 1
                killed[room] += bool(dead)
                if not dead:
                    print(f"survives {mutant}", flush=True)
        rooms = ", ".join(f"{room} {killed[room]}/{count[room]}" for room in sorted(count))
        print(f"{kind}: {killed.total()} of {count.total()} killed: {rooms}", flush=True)


if __name__ == "__main__":
    main()
