"""Plugin of pytest: which functions of the package each test calls, and what the test costs; and
only chosen tests.

    pytest -p reached --reached=FOLDER
    pytest -p reached --chosen=FILE TESTS

By the first, each process writes FOLDER/PID.jsonl, a line per test: its name, its processor time
[s], whether it passes, and the functions, as path within the package and first line. What a fixture
of a whole file calls counts for each of its tests. Commands that a test starts are not seen. By the
second, tests whose names are no line of FILE are left out; a name that has no test is none.
"""

from __future__ import annotations

import json
import os
import threading
from collections import defaultdict
from collections.abc import Iterator
from cProfile import Profile
from pathlib import Path
from types import CodeType, FrameType

import pytest

import reluctance

PACKAGE = str(Path(reluctance.__file__).parent) + os.sep


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--reached", type=Path, help="--reached=FOLDER: what each test calls")
    parser.addoption("--chosen", type=Path, help="--chosen=FILE: the names of tests, a line each")


def pytest_configure(config: pytest.Config) -> None:
    if folder := config.getoption("--reached"):
        folder.mkdir(parents=True, exist_ok=True)
        config.pluginmanager.register(Reached(folder / f"{os.getpid()}.jsonl"))


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if file := config.getoption("--chosen"):
        chosen = set(file.read_text(encoding="utf-8").splitlines())
        items[:] = [item for item in items if item.nodeid in chosen]


def processor_time() -> float:
    """Of this process and of those that it has waited for [s]."""
    return sum(os.times()[:4])


class Reached:
    """Notes the code objects that are entered while a test runs."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self.profile = Profile(subcalls=False, builtins=False)
        self.entered: set[CodeType] = set()
        self.of_file: dict[Path, set[CodeType]] = defaultdict(set)

    def see(self, frame: FrameType, event: str, _: object) -> None:
        if event == "call":
            self.entered.add(frame.f_code)

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(
        self, fixturedef: pytest.FixtureDef[object], request: pytest.FixtureRequest
    ) -> Iterator[None]:
        if fixturedef.scope != "module":
            return (yield)
        before = self.taken()
        found = yield
        self.entered = self.taken()
        self.of_file[request.path] |= self.entered
        self.entered |= before
        return found

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        start, failed = processor_time(), item.session.testsfailed
        threading.setprofile(self.see)
        self.profile.enable()
        try:
            return (yield)
        finally:
            self.profile.disable()
            threading.setprofile(None)
            self.write(item, processor_time() - start, item.session.testsfailed == failed)

    def taken(self) -> set[CodeType]:
        """The code objects that were entered since the last time."""
        seen = self.entered | {
            e.code for e in self.profile.getstats() if isinstance(e.code, CodeType)
        }
        self.profile.clear()
        self.entered = set()
        return seen

    def write(self, item: pytest.Item, cost: float, passes: bool) -> None:
        seen = self.taken() | self.of_file[item.path]
        own = [code for code in seen if code.co_filename.startswith(PACKAGE)]
        places = sorted({(c.co_filename.removeprefix(PACKAGE), c.co_firstlineno) for c in own})
        line = json.dumps([item.nodeid, round(cost, 3), passes, places])
        with self.file.open("a", encoding="utf-8") as file:
            file.write(line + "\n")
