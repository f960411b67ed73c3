"""One cache for the whole session, one hypothesis profile, shards, and what the tests cost."""

import csv
import os
import shutil
import signal
import sys
import tempfile
import zlib
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

# The workers share the cores: threads within a matrix product only cost time. NumPy reads this when
# it is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

sys.path.insert(0, str(Path(__file__).parent / "support"))  # what tests share

settings.register_profile("no wall clock", deadline=None)
settings.load_profile("no wall clock")

COST = "processor_s"
DEAREST = 10
SKIPPED = "reluctance/skipped"


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--shard", default="1/1", help="K/N: the tests whose name's hash is K of N")
    parser.addoption("--skipped", action="store_true", help="the tests that the last run skipped")
    parser.addoption(
        "--costs",
        type=Path,
        help="--costs=FILE: processor time of each test, and of each file's set-up, as CSV",
    )


def pytest_configure(config: pytest.Config) -> None:
    """The user's cache could hide a defect. The processes of pytest-xdist share the folder. A shell
    that starts this in the background ignores Ctrl-C, and so would all that the tests start."""
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if not hasattr(config, "workerinput"):
        os.environ["RELUCTANCE_CACHE"] = tempfile.mkdtemp(prefix="reluctance-tests-")


def pytest_unconfigure(config: pytest.Config) -> None:
    if not hasattr(config, "workerinput"):
        shutil.rmtree(os.environ["RELUCTANCE_CACHE"], ignore_errors=True)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Deals the tests to shards by a hash of their names, so that a new test moves no other. Tests
    marked `together` go by the name of their file: they share a set-up that is dear."""
    if config.getoption("--skipped"):
        _only(set(config.cache.get(SKIPPED, [])), config, items)
    given = config.getoption("--shard")
    shard, _, shards = (int(part) if part.isdecimal() else 0 for part in given.partition("/"))
    if not 1 <= shard <= shards:
        raise pytest.UsageError(f"--shard {given}, need K/N with 1 <= K <= N, as in 2/8")
    dealt_by = {i.nodeid: _file(i) if i.get_closest_marker("together") else i.nodeid for i in items}
    kept = {n for n, name in dealt_by.items() if zlib.crc32(name.encode()) % shards == shard - 1}
    _only(kept, config, items)


def _file(item: pytest.Item) -> str:
    return item.nodeid.partition("::")[0]


def _only(names: set[str], config: pytest.Config, items: list[pytest.Item]) -> None:
    config.hook.pytest_deselected(items=[item for item in items if item.nodeid not in names])
    items[:] = [item for item in items if item.nodeid in names]


def _processor_time() -> float:
    """User and system time of this process and of the children it has waited for [s]."""
    return sum(os.times()[:4])


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    item.stash[START] = _processor_time()
    return (yield)


START = pytest.StashKey[float]()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo) -> Iterator[None]:
    """The report of each phase carries the processor time of that phase."""
    report = yield
    now = _processor_time()
    report.user_properties = [(COST, now - item.stash[START])]
    item.stash[START] = now
    return report


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """The dearest files; and tests whose programs are missing (needs.py)."""
    costs: dict[str, float] = defaultdict(float)
    for reports in terminalreporter.stats.values():
        for report in reports:
            if isinstance(report, pytest.TestReport):
                place = report.nodeid.partition("::")[0]
                name = f"{place}::set-up" if report.when == "setup" else report.nodeid
                costs[name] += dict(report.user_properties).get(COST, 0.0)
    files: dict[str, float] = defaultdict(float)
    for name, cost in costs.items():
        files[name.partition("::")[0]] += cost
    if sum(files.values()) > 60:
        dearest = sorted(files.items(), key=lambda f: -f[1])[:DEAREST]
        shown = ", ".join(f"{Path(name).name} {cost:.0f}" for name, cost in dearest)
        terminalreporter.write_line(
            f"processor time: {sum(files.values()):.0f} s; the dearest files: {shown}"
        )
    if path := terminalreporter.config.getoption("--costs"):
        with path.open("w", newline="") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(("test", COST))
            table.writerows((name, f"{cost:.2f}") for name, cost in sorted(costs.items()))

    skipped = terminalreporter.stats.get("skipped", [])
    if not terminalreporter.config.getoption("--skipped"):
        terminalreporter.config.cache.set(SKIPPED, sorted(report.nodeid for report in skipped))
    reasons = Counter(
        report.longrepr[2].removeprefix("Skipped: ")
        for report in skipped
        if isinstance(report.longrepr, tuple)
    )
    left_out = [f"{count} test(s): {why}" for why, count in sorted(reasons.items())]
    if left_out:
        terminalreporter.write_line(f"skipped: {'; '.join(left_out)} (.ci/run installs them)")
    for report in terminalreporter.stats.get("xfailed", []):
        terminalreporter.write_line(f"known to fail: {report.nodeid} ({report.wasxfail})")
