"""Judges a changed file in a copy of the repository: the first test that fails there, of those that
pass without the change."""

from __future__ import annotations

import ast
import importlib.util
import json
import math
import os
import re
import shutil
import signal
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from queue import SimpleQueue
from threading import Lock

ROOT = Path(__file__).parents[2]
PACKAGE, HEADERS, TESTS = ROOT / "python" / "reluctance", ROOT / "include", ROOT / "tests"
CHECK = "test_core.py::test_core_check_holds["  # of headers alone: needs no core built with them
MOST = 30  # processor time of the tests that judge a change [s]
CHEAP = 0.02  # of a test that judges besides [s]
FIRST = 5  # files of tests that judge by themselves; most faults end there
SURFACE = "tests/cli/test_surface.py::"  # reads what is declared outside of functions
LIMIT = 120  # of one test, which takes 10 s at most; more is an endless loop [s]
LEFT_OUT = (".*", "build", "out", "dist", "__pycache__", "*.so", "node_modules")
COMPILES = "targets"  # folder of the tests that compile headers by themselves
FOLDERS = {  # of tests, by the first that a header's place begins with
    "base": ("core",),
    "machine": ("machine", "core"),
    "plant": ("plant", "core", "drive"),
    "control/law": ("drive", "core"),
    "control/commission": (COMPILES,),
    "control": ("core", "drive"),
    "sim": ("core", "drive"),
    "c_api": (COMPILES, "core"),
    "fmi": (COMPILES,),
}
ENDED = "a test that ended the process"
NOT_BEGUN = "what every test imports"  # the tests cannot begin
FAILED = re.compile(r"^(?:FAILED|ERROR) (\S+(?:\[.*?\])?)(?: - .*)?$", re.M)
NOT_COMPILED = re.compile(  # by a check, or by reluctance.base.toolchain
    r"\.[ch]pp:\d+:\d+: error: (?!.*\[-Werror)|ParameterError: .* does not compile"
)


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


@dataclass(frozen=True)
class Test:
    """What tests/support/reached.py notes of one."""

    name: str  # as pytest has it
    cost: float  # processor time [s]
    called: frozenset[tuple[str, int]]  # functions: path within the package, and first line

    @property
    def file(self) -> Path:
        return ROOT / self.name.partition("::")[0]

    @property
    def folder(self) -> str:
        return self.file.relative_to(TESTS).parts[0]


def recorded(folder: Path) -> list[Test]:
    """The tests that a folder of tests/support/reached.py has and that pass, as a test that fails
    without a fault can judge none.

    Raises
    ------
    ValueError
        If one of them is no test any more: it could judge nothing.
    """
    lines = [line for file in folder.glob("*.jsonl") for line in file.read_text().splitlines()]
    found = []
    for name, cost, passes, called in map(json.loads, sorted(lines)):
        if not passes:
            print(f"left out: {name} fails without a fault", flush=True)
            continue
        found.append(Test(name, cost, frozenset(map(tuple, called))))
    for test in found:
        function = test.name.partition("[")[0].rpartition("::")[2]
        said = words().get(test.file, Counter())
        if test.file.is_relative_to(TESTS) and not said[function]:
            raise ValueError(f"{folder} is of other tests: {test.name} is gone; remove the folder")
    return found


@cache
def words() -> dict[Path, Counter[str]]:
    """Of each test file, and of each check of headers."""
    files = sorted([*TESTS.rglob("test_*.py"), *TESTS.rglob("*_check.cpp")])
    return {
        file: Counter(re.findall(r"[\w.]+", file.read_text(encoding="utf-8"))) for file in files
    }


def nearest(names: Iterable[str]) -> list[Path]:
    """The test files that say these names, those that say most first; a rare name counts more."""
    parts = {part for name in names for part in (name, f"reluctance.{name}") if len(part) > 2}
    score: Counter[Path] = Counter()
    for word in parts:
        those = [file for file, said in words().items() if said[word]]
        for file in those:
            score[file] += math.log1p(words()[file][word]) / len(those)
    return [file for file, _ in score.most_common()]


def folders(file: Path) -> tuple[str, ...]:
    """Those of tests that a file of the package or a header belongs to."""
    if file.suffix == ".py":
        return (file.relative_to(PACKAGE).parts[0],)
    place = file.relative_to(HEADERS / "srm").as_posix()
    return next(of for start, of in FOLDERS.items() if place.startswith(f"{start}/"))


def function_at(file: Path, line: int) -> int | None:
    """First line, with decorators, of the innermost function around a line; None outside of all."""
    found = None
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef):
            first = min([node.lineno, *(each.lineno for each in node.decorator_list)])
            if first <= line <= (node.end_lineno or line):
                found = max(first, found or 0)
    return found


def judges(mutant: Mutant, tests: Sequence[Test]) -> list[str]:
    """The tests of a mutant by name, file by file, the nearest first.

    Those that call the changed function, the cheapest first, or read what is declared outside of
    all; and, of the folders that the file belongs to, those of the files that name what was
    changed, then the cheapest. Each list has a case of every test function before a second of any.
    They end after MOST seconds, of which those that call the function take what they need first;
    CHEAP ones count nothing.
    """
    rank = {file: n for n, file in enumerate(nearest(mutant.names))}
    own = folders(mutant.file)

    def place(test: Test) -> int:
        return rank.get(test.file, len(rank))

    called: list[Test] = []
    if mutant.file.suffix == ".py":
        path = mutant.file.relative_to(PACKAGE).as_posix()
        first = function_at(mutant.file, mutant.line)
        called = [
            test
            for test in tests
            if any(file == path and (first is None or line == first) for file, line in test.called)
            or (first is None and test.name.startswith(SURFACE))
        ]
        called.sort(key=lambda test: test.cost)
    near = [test for test in tests if test.folder in own or (not called and test.file in rank)]
    near = [test for test in near if CHECK not in test.name]  # see `checks`
    near.sort(key=lambda test: (place(test), test.cost))
    in_turn = {test.name: test for test in (*by_turns(called), *by_turns(near))}
    chosen = _within(in_turn.values(), MOST)
    return [t.name for t in sorted(chosen, key=lambda t: (place(t), t.file, t.cost))]


def by_turns(tests: Iterable[Test]) -> list[Test]:
    """The first case of each test function, then the second of each, and so on: the cases of one
    see much the same."""
    turns: Counter[str] = Counter()
    found = []
    for test in tests:
        function = test.name.partition("[")[0]
        found.append((turns[function], test))
        turns[function] += 1
    return [test for _, test in sorted(found, key=lambda each: each[0])]


def _within(tests: Iterable[Test], seconds: float) -> list[Test]:
    found: list[Test] = []
    for test in tests:
        cost = test.cost if test.cost > CHEAP else 0.0
        if cost <= seconds:
            seconds -= cost
            found.append(test)
    return found


def portions(names: Sequence[str]) -> tuple[list[str], list[str]]:
    """Tests of the FIRST files that are named, and of the others."""
    nearest = set([*dict.fromkeys(name.partition("::")[0] for name in names)][:FIRST])
    found: tuple[list[str], list[str]] = ([], [])
    for name in names:
        found[name.partition("::")[0] not in nearest].append(name)
    return found


def checks(mutant: Mutant, tests: Sequence[Test]) -> list[str]:
    """The checks of headers by name, the nearest first."""
    order = [file.stem for file in nearest(mutant.names) if file.suffix == ".cpp"]
    rank = {f"{stem}-g++": n for n, stem in enumerate(order)}
    found = [test.name for test in tests if CHECK in test.name]
    return sorted(found, key=lambda name: rank.get(name.partition("[")[2].rstrip("]"), len(rank)))


class Copy:
    """A copy of the repository whose tests import its own package, with the core as installed."""

    def __init__(self, place: Path) -> None:
        self.place = place
        self.said = ""  # by the last run of tests
        shutil.copytree(ROOT, place, ignore=shutil.ignore_patterns(*LEFT_OUT))
        core = importlib.util.find_spec("reluctance._core")
        assert core is not None and core.origin is not None
        self.installed = place.with_suffix(".core")  # as it may be built anew meanwhile
        self.installed.mkdir()
        self.take_core(Path(core.origin).parent, self.installed)
        self.take_core(self.installed)
        self.environment = os.environ | {
            "PYTHONPATH": os.pathsep.join(map(str, (place / "python", place / "tests/support"))),
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

    def take_core(self, folder: Path, to: Path | None = None) -> None:
        """The core of a folder, for the package of the copy where nothing else is said."""
        for module in folder.glob("_core*.so"):
            shutil.copy2(module, to or self.place / "python" / "reluctance")

    def record(self, folder: Path, jobs: int) -> None:
        """Runs all short tests and notes in a folder what each calls."""
        command = [sys.executable, "-m", "pytest", "-q", "--tb=no", "-m", "not long", "-n"]
        command += [str(jobs), "--dist", "worksteal", "-p", "reached", f"--reached={folder}"]
        subprocess.run(command, cwd=self.place, env=self.environment, stdout=subprocess.DEVNULL)

    def build(self) -> bool:
        """The core with the headers as they are; False where they do not compile. No number
        changes by the level of optimisation, and this one takes least."""
        folder = self.place / "build"
        if not folder.exists():
            command = ["cmake", "-S", str(self.place), "-B", str(folder), "-G", "Ninja"]
            flags = "-O1 -DNDEBUG -D_GLIBCXX_ASSERTIONS"  # an index past the end is a fault
            command += ["-DCMAKE_BUILD_TYPE=Mutant", f"-DCMAKE_CXX_FLAGS_MUTANT={flags}"]
            command += ["-DRELUCTANCE_TEST_MODULE=ON", f"-DPython_EXECUTABLE={sys.executable}"]
            command += [f"-Dnanobind_DIR={nanobind_folder()}"]
            subprocess.run(command, check=True, env=self.environment, stdout=subprocess.DEVNULL)
        command = ["cmake", "--build", str(folder), "--parallel", "1"]
        built = subprocess.run(command, env=self.environment, capture_output=True, text=True)
        if built.returncode:
            return False
        self.take_core(folder)
        return True

    def failing(self, what: Sequence[str]) -> str | None:
        """The first test that fails, with the names that pytest gives; None where none does."""
        chosen = self.place.with_suffix(".chosen")  # not a file of the repository
        chosen.write_text("\n".join(what), encoding="utf-8")
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-rfE", "--tb=short"]
        command += ["-o", f"faulthandler_timeout={LIMIT}", "-o", "faulthandler_exit_on_timeout=1"]
        command += ["-p", "reached", f"--chosen={chosen}"]
        command += dict.fromkeys(name.partition("::")[0] for name in what)
        running = subprocess.Popen(
            command,
            **{"cwd": self.place, "env": self.environment, "text": True},
            **{"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "start_new_session": True},
        )
        self.said, _ = running.communicate()
        try:
            os.killpg(running.pid, signal.SIGKILL)  # what an endless test has started
        except ProcessLookupError:
            pass
        if running.returncode in (0, 5):  # 5: there is none of the tests, with this fault
            return None
        found = FAILED.findall(self.said)
        if found:
            return str(found[0])
        return NOT_BEGUN if running.returncode in (3, 4) else ENDED


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
        self.lock = Lock()  # of the unchanged copy

    def killer(self, mutant: Mutant, tests: Sequence[Test]) -> str | None:
        """Which of the tests fails with the fault, or None where none does; "" where the fault does
        not compile."""
        copy = self.free.get()
        place = copy.place / mutant.file.relative_to(ROOT)
        whole = place.read_text(encoding="utf-8")
        place.write_text(mutant.text, encoding="utf-8")
        try:
            if mutant.file.suffix == ".py":
                return self._killer(copy, judges(mutant, tests))
            names = judges(mutant, tests)
            compiling = [checks(mutant, tests)]  # what needs no core built with the header
            if folders(mutant.file)[0] == COMPILES:
                compiling += [[name for name in names if name.startswith(f"tests/{COMPILES}/")]]
            for some in compiling:
                if (name := self._killer(copy, some)) is not None:
                    return "" if NOT_COMPILED.search(copy.said) else name
            return self._killer(copy, names) if copy.build() else ""
        finally:
            place.write_text(whole, encoding="utf-8")
            if mutant.file.suffix != ".py":
                copy.take_core(copy.installed)
            self.free.put(copy)

    def _killer(self, copy: Copy, names: list[str]) -> str | None:
        """The killer among tests of the nearest files, else among those of the others, which take
        longer to import than to run."""
        for some in filter(None, portions(names)):
            name = copy.failing(some)
            if name == NOT_BEGUN:
                with self.lock:
                    if self.unchanged.failing(some) == NOT_BEGUN:
                        raise RuntimeError(f"pytest {some[:3]} ...: {self.unchanged.said[-2000:]}")
            if name is not None:
                return name
        return None
