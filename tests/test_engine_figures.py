"""The figures before and after the engine are those of the history, and moved as the page says."""

import csv
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "bench"))
from engine_figures import AFTER, BEFORE, moved, table_at  # noqa: E402

MOVED = {"paper_pump", "fan", "hysteresis_200A"}  # by more than 1e-4: docs/reference/theory.md


def shown() -> dict[str, dict[str, str]]:
    with (ROOT / "bench" / "engine_figures.csv").open(encoding="utf-8") as file:
        return {row["example"]: row for row in csv.DictReader(file)}


def test_the_file_is_what_the_history_gives() -> None:
    for commit in (BEFORE, AFTER):
        known = ["git", "cat-file", "-e", f"{commit}^{{commit}}"]
        if subprocess.run(known, cwd=ROOT, capture_output=True).returncode:
            assert "CI" not in os.environ, f"need the history with {commit}: clone without --depth"
            pytest.skip("needs the history")
    found = moved(table_at(BEFORE), table_at(AFTER))
    assert {row["example"]: {k: str(v) for k, v in row.items()} for row in found} == shown()


def test_three_examples_moved_by_more_than_the_page_allows_the_others() -> None:
    assert {name for name, row in shown().items() if float(row["part_moved"]) > 1e-4} == MOVED


def test_the_figure_that_moved_most_is_found_and_rounding_is_none() -> None:
    before = {"a": {"x": "2", "y": "1e-12", "torque_drift": "1", "z": ""}, "gone": {"x": "1"}}
    after = {"a": {"x": "2.5", "y": "1", "torque_drift": "9", "z": "3"}, "new": {"x": "1"}}
    (row,) = moved(before, after)
    assert (row["example"], row["figure"], row["part_moved"]) == ("a", "x", 0.25)
