"""One cache for the whole session, one hypothesis profile, one line on what was skipped."""

import os
import shutil
import tempfile
from collections import Counter

import pytest
from hypothesis import settings

settings.register_profile("no wall clock", deadline=None)
settings.load_profile("no wall clock")


def pytest_configure(config: pytest.Config) -> None:
    """The user's cache could hide a defect. The processes of pytest-xdist share the folder."""
    if not hasattr(config, "workerinput"):
        os.environ["RELUCTANCE_CACHE"] = tempfile.mkdtemp(prefix="reluctance-tests-")


def pytest_unconfigure(config: pytest.Config) -> None:
    if not hasattr(config, "workerinput"):
        shutil.rmtree(os.environ["RELUCTANCE_CACHE"], ignore_errors=True)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Tests whose programs are missing (needs.py)."""
    reasons = Counter(
        report.longrepr[2].removeprefix("Skipped: ")
        for report in terminalreporter.stats.get("skipped", [])
        if isinstance(report.longrepr, tuple)
    )
    left_out = [f"{count} test(s): {why}" for why, count in sorted(reasons.items())]
    if left_out:
        terminalreporter.write_line(f"skipped: {'; '.join(left_out)} (.ci/run installs them)")
