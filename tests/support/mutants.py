"""Question: which small faults of the code does no test see?

    python tests/support/mutants.py [--seed N] [--python N] [--cpp N] [--shard K/N] [--only PART]

Draws places in python/reluctance and include/srm from a seed (new and printed without one) and
changes one operator, number, condition or statement there in a copy of the repository. The tests of
the folders that the code belongs to judge it there, those that name what was changed first, and the
nearest of all others; a changed header is judged by the core built with it. A test that fails
counts where it passes without the fault. A change that no test fails is printed as a survivor.

Why no kept library: mutmut and cosmic-ray make and run every mutant of a package against one test
command. Here a draw of a hundred must end in half an hour, each against the tests of its place, and
headers need a core of their own.
"""

from __future__ import annotations

import argparse
import ast
import csv
import importlib.util
import math
import os
import random
import re
import resource
import secrets
import shutil
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from queue import SimpleQueue

ROOT = Path(__file__).parents[2]
PACKAGE, HEADERS, TESTS = ROOT / "python" / "reluctance", ROOT / "include", ROOT / "tests"
NEAREST = 4  # test files besides those of the folder
LIMIT = 120  # of one test, which takes 10 s at most; more is an endless loop [s]
LEFT_OUT = (".*", "build", "out", "dist", "__pycache__", "*.so", "node_modules")
FOLDERS = {  # of tests, by the first that a header's place begins with
    "base": ("core",),
    "machine": ("machine", "core"),
    "plant": ("plant", "core", "drive"),
    "control/law": ("drive", "core"),
    "control/commission": ("targets",),
    "control": ("core", "drive"),
    "sim": ("core", "drive"),
    "c_api": ("targets", "core"),
    "fmi": ("targets",),
}
ENDED = "a test that ended the process"
FAILED = re.compile(r"^(?:FAILED|ERROR) (\S+(?:\[.*?\])?)(?: - .*)?$", re.M)
SWAPS: dict[type, type] = {
    **{ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult},
    **{ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt},
    **{ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.And: ast.Or, ast.Or: ast.And},
    **{ast.Pow: ast.Mult, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn},
}
# Keywords: looks of a figure, the place of a warning, and the version of a result that is kept.
NO_FAULT = ("lw", "ms", "fontsize", "alpha", "size", "frameon", "stacklevel", "algorithm")
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
        value = node.value
        return ast.Constant(value * 1.05 or 1.0 if isinstance(value, float) else value + 1)
    if isinstance(node, ast.Constant) and isinstance(node.value, bool):
        return ast.Constant(not node.value)
    if isinstance(node, ast.If | ast.IfExp):
        return _with(node, test=ast.UnaryOp(ast.Not(), node.test))
    if isinstance(node, ast.Raise):
        return ast.Pass()
    return None


def no_fault(node: ast.AST) -> bool:
    """Whether constants go to one of NO_FAULT, or one is the version that a module keeps by."""
    if isinstance(node, ast.keyword):
        parts = node.value.elts if isinstance(node.value, ast.Tuple) else [node.value]
        return node.arg in NO_FAULT and all(isinstance(part, ast.Constant) for part in parts)
    if not isinstance(node, ast.Assign) or not isinstance(node.value, ast.Constant):
        return False
    return ast.unparse(node.targets[0]) == "ALGORITHM"


def _with(node: ast.AST, **fields: object) -> ast.AST:
    values = {name: getattr(node, name, None) for name in node._fields} | fields
    return ast.copy_location(type(node)(**values), node)


def python_mutant(file: Path, draw: random.Random) -> Mutant | None:
    """A fault somewhere in a module, but in its text, its annotations, what is imported for them,
    and where there is `no_fault`."""
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
                if no_fault(child):
                    continue
                if isinstance(child, ast.If) and ast.unparse(child.test) == "TYPE_CHECKING":
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
    where = (*(name.strip("_") for name in names), at.name, ".".join(at.parts), *offered(tree))
    short = [" ".join(part.split())[:70] for part in (before, after)]
    return Mutant(file, node.lineno, short[0], short[1], text, where)


def offered(tree: ast.Module) -> list[str]:
    """The functions and classes of a module that others import: tests often reach its inner ones
    through them."""
    those = (part.name for part in tree.body if isinstance(part, ast.FunctionDef | ast.ClassDef))
    return [name for name in those if not name.startswith("_")]


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
    shown = [line.strip()[:80] for line in (lines[n], other[n])]
    return Mutant(file, n + 1, shown[0], shown[1], "\n".join(other), (file.stem,))


@cache
def tests() -> dict[Path, Counter[str]]:
    """The words of each test file."""
    files = sorted(TESTS.rglob("test_*.py"))
    return {
        file: Counter(re.findall(r"[\w.]+", file.read_text(encoding="utf-8"))) for file in files
    }


def nearest(names: Iterable[str]) -> list[Path]:
    """The test files that say these names, those that say most first; a rare name counts more."""
    words = {part for name in names for part in (name, f"reluctance.{name}") if len(part) > 2}
    score: Counter[Path] = Counter()
    for word in words:
        those = [file for file, said in tests().items() if said[word]]
        for file in those:
            score[file] += math.log1p(tests()[file][word]) / len(those)
    return [file for file, _ in score.most_common()]


def folders(file: Path) -> tuple[str, ...]:
    """Those of tests that a file of the package or a header belongs to."""
    if file.suffix == ".py":
        return (file.relative_to(PACKAGE).parts[0],)
    place = file.relative_to(HEADERS / "srm").as_posix()
    return next(of for start, of in FOLDERS.items() if place.startswith(f"{start}/"))


def judges(mutant: Mutant) -> list[Path]:
    """The test files of a mutant: those of its folders, the nearest first, and some of all."""
    order = nearest(mutant.names)
    rank = {file: n for n, file in enumerate(order)}
    own = [file for file in tests() if file.relative_to(TESTS).parts[0] in folders(mutant.file)]
    own.sort(key=lambda file: (rank.get(file, len(rank)), file))
    return [*own, *[file for file in order if file not in own][:NEAREST]]


class Copy:
    """A copy of the repository whose tests import its own package, with the core as installed."""

    def __init__(self, place: Path) -> None:
        self.place = place
        shutil.copytree(ROOT, place, ignore=shutil.ignore_patterns(*LEFT_OUT))
        core = importlib.util.find_spec("reluctance._core")
        assert core is not None and core.origin is not None
        for module in Path(core.origin).parent.glob("_core*.so"):
            shutil.copy2(module, place / "python" / "reluctance")  # it may be built anew meanwhile
        self.environment = os.environ | {
            "PYTHONPATH": str(place / "python"),
            "OPENBLAS_NUM_THREADS": "1",
            "CCACHE_BASEDIR": str(place),
            "CCACHE_NOHASHDIR": "1",
        }
        compilers = place / ".compilers"
        compilers.mkdir()
        if ccache := shutil.which("ccache"):  # what a fault does not reach is compiled once
            for name in ("g++", "c++"):
                (compilers / name).symlink_to(ccache)
        path = (str(compilers), str(Path(sys.executable).parent), os.environ.get("PATH", ""))
        self.environment["PATH"] = os.pathsep.join(path)
        code = "import reluctance._core as core; print(core.__file__)"
        found = subprocess.check_output(
            [sys.executable, "-c", code], text=True, cwd=place, env=self.environment
        )
        if not Path(found).is_relative_to(place):
            raise RuntimeError(f"the tests of {place} would import {found}")

    def build(self) -> bool:
        """The core with the headers as they are; False where they do not compile. No number
        changes by the level of optimisation, and this one takes least."""
        folder = self.place / "build"
        if not folder.exists():
            command = ["cmake", "-S", str(self.place), "-B", str(folder), "-G", "Ninja"]
            command += ["-DCMAKE_BUILD_TYPE=Mutant", "-DCMAKE_CXX_FLAGS_MUTANT=-O1 -DNDEBUG"]
            command += ["-DRELUCTANCE_TEST_MODULE=ON", f"-DPython_EXECUTABLE={sys.executable}"]
            command += [f"-Dnanobind_DIR={nanobind_folder()}"]
            subprocess.run(command, check=True, env=self.environment, stdout=subprocess.DEVNULL)
        command = ["cmake", "--build", str(folder), "--parallel", "1"]
        built = subprocess.run(command, env=self.environment, capture_output=True, text=True)
        if built.returncode:
            return False
        for module in folder.glob("_core*.so"):
            shutil.copy2(module, self.place / "python" / "reluctance")
        return True

    def failing(self, what: Sequence[str], without: Iterable[str] = ()) -> str | None:
        """The first test that fails, with the names that pytest gives; None where none does."""
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-rfE", "--tb=no", "-m", "not long"]
        command += ["-o", f"faulthandler_timeout={LIMIT}", "-o", "faulthandler_exit_on_timeout=1"]
        command += [f"--deselect={name}" for name in without]
        running = subprocess.Popen(
            [*command, *what],
            **{"cwd": self.place, "env": self.environment, "text": True},
            **{"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "start_new_session": True},
        )
        said, _ = running.communicate()
        try:
            os.killpg(running.pid, signal.SIGKILL)  # what an endless test has started
        except ProcessLookupError:
            pass
        if running.returncode in (0, 5):  # 5: no test was collected
            return None
        found = FAILED.findall(said)
        if found:
            return str(found[0])
        if running.returncode in (3, 4):
            raise RuntimeError(f"pytest {what}: {said[-2000:]}")
        return ENDED


@cache
def nanobind_folder() -> str:
    return subprocess.check_output(
        [sys.executable, "-m", "nanobind", "--cmake_dir"], text=True
    ).strip()


class Court:
    """An unchanged copy, and one for each mutant that is judged at the same time."""

    def __init__(self, folder: Path, jobs: int) -> None:
        self.unchanged = Copy(folder / "unchanged")
        self.free: SimpleQueue[Copy] = SimpleQueue()
        for n in range(jobs):
            self.free.put(Copy(folder / f"{n}"))
        self.passing: dict[str, bool] = {}  # tests by name: whether they pass without a fault

    def killer(self, mutant: Mutant) -> str | None:
        """The test that fails with the fault and passes without it, or None where there is none;
        "" where the fault does not compile."""
        copy = self.free.get()
        place = copy.place / mutant.file.relative_to(ROOT)
        whole = place.read_text(encoding="utf-8")
        place.write_text(mutant.text, encoding="utf-8")
        try:
            if mutant.file.suffix == ".hpp" and not copy.build():
                return ""
            files = [str(file.relative_to(ROOT)) for file in judges(mutant)]
            while True:
                without = [name for name, passes in self.passing.items() if not passes]
                name = copy.failing(files, without)
                if name is None or self._passes(name):
                    return name
        finally:
            place.write_text(whole, encoding="utf-8")
            self.free.put(copy)

    def _passes(self, name: str) -> bool:
        """Whether a test passes without a fault."""
        if name not in self.passing:
            self.passing[name] = name == ENDED or self.unchanged.failing([name]) is None
            if not self.passing[name]:
                print(f"left out: {name} fails without a fault", flush=True)
        return self.passing[name]


def drawn(kind: str, count: int, only: str, draw: random.Random) -> list[Mutant]:
    """Mutants of files drawn by their length."""
    folder, pattern = (PACKAGE, "*.py") if kind == "python" else (HEADERS / "srm", "*.hpp")
    files = [file for file in sorted(folder.rglob(pattern)) if only in str(file.relative_to(ROOT))]
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
    parser.add_argument("--shard", default="1/1", help="K/N: every N-th mutant from the K-th on")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--only", default="", help="part of a path, as limit")
    parser.add_argument("--out", type=Path, help="each mutant and the test that saw it, as CSV")
    arguments = parser.parse_args()
    shard, shards = (int(part) for part in arguments.shard.split("/"))
    print(f"seed {arguments.seed}", flush=True)
    draw = random.Random(arguments.seed)
    rows: list[tuple[object, ...]] = []
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(arguments.jobs) as pool:
        court = Court(Path(folder), arguments.jobs)
        for kind in ("python", "cpp"):
            mutants = drawn(kind, getattr(arguments, kind), arguments.only, draw)[
                shard - 1 :: shards
            ]
            killed: Counter[str] = Counter()
            count: Counter[str] = Counter()
            for mutant, killer in zip(mutants, pool.map(court.killer, mutants), strict=True):
                room = mutant.file.relative_to(ROOT).parent.as_posix()
                rows.append((arguments.seed, str(mutant), "none" if killer is None else killer))
                if killer == "":
                    print(f"does not compile {mutant}", flush=True)
                    continue
                count[room] += 1
                killed[room] += killer is not None
                what = f"survives {mutant}" if killer is None else f"killed {mutant} by {killer}"
                print(what, flush=True)
            rooms = ", ".join(f"{room} {killed[room]}/{count[room]}" for room in sorted(count))
            print(f"{kind}: {killed.total()} of {count.total()} killed: {rooms}", flush=True)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(f"{used.ru_utime + used.ru_stime:.0f} s of processor time")
    if arguments.out:
        with arguments.out.open("w", newline="") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerows([("seed", "mutant", "seen_by"), *rows])


if __name__ == "__main__":
    main()
