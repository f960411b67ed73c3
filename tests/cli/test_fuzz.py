"""Random drive files and command lines end with 0 or 2, in one line, and in time; see fuzz.py."""

from functools import partial

import fuzz
import pytest


@pytest.fixture(autouse=True)
def _cache(tmp_path, monkeypatch):
    monkeypatch.setenv("RELUCTANCE_CACHE", str(tmp_path))


@pytest.mark.long
def test_random_cases_leave_no_user_stranded():
    """Other seeds than those that were run by hand."""
    failures = fuzz.fuzz(range(10_000_000, 10_000_300))
    assert not failures, "\n".join(f"{seed}: {text[-500:]}" for seed, text in failures.items())


@pytest.mark.long
def test_the_same_holds_for_processes():
    as_process = partial(fuzz.judged, run=fuzz.as_process)
    failures = fuzz.fuzz(range(20_000_000, 20_000_006), as_process)
    assert not failures, failures


def test_random_drive_files_give_a_drive_or_one_line():
    failures = fuzz.fuzz(range(10_000_000, 10_005_000), fuzz.judged_tables)
    assert not failures, "\n".join(f"{seed}: {text[-500:]}" for seed, text in failures.items())


def test_a_traceback_would_be_seen(monkeypatch):
    """The fuzzer itself can fail."""

    def broken(given):
        raise KeyError("x")

    assert "KeyError" in fuzz.judged(1, broken)
    assert "exit code 3" in fuzz.judged(1, lambda given: (3, ""))
    assert "not one line" in fuzz.judged(1, lambda given: (2, "Usage: \n\n"))
    monkeypatch.setattr(fuzz, "drive_from", broken)
    assert any("KeyError" in (fuzz.judged_tables(seed) or "") for seed in range(3))
