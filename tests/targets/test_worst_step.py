"""The longest control step that a search finds, on the emulated Cortex-M7, protection included.

Replays of one operating point (test_firmware_target.py) do not meet the worst case.
`python bench/worst_step.py` searches for it in a million samples and more, and writes
bench/worst_step.csv. Here is the beginning of that search, and its worst sequence again.
"""

import csv
import sys
from pathlib import Path

import pytest
from firmware_tools import ROOT, needs_target

sys.path.insert(0, str(ROOT / "bench"))
from worst_step import (
    CASES,
    FEW,
    FILE,
    Target,
    as_sequence,
    climb,
    longest,
    operating_points,
    torque_steps,
    worst_random,
)

with FILE.open() as file:
    ROWS = {row["law"]: row for row in csv.DictReader(file)}


@pytest.mark.parametrize("name", CASES)
def test_the_bound_covers_a_million_samples_and_twenty_operating_points(name: str) -> None:
    row, case = ROWS[name], CASES[name]
    assert (row["drive"], row["set"].split()) == (case.example, list(case.overrides))
    assert int(row["random_samples"]) >= 1_000_000
    assert int(row["operating_points"]) >= 20
    found = [int(row[kind]) for kind in ("random", "steps", "points", "climb")]
    assert max(found) == int(row["found"]) <= int(row["bound"]) == case.bound


@needs_target
@pytest.mark.long
@pytest.mark.parametrize("name", CASES)
def test_a_search_finds_no_longer_step_than_the_file_has(name: str, tmp_path: Path) -> None:
    row, drive = {k: int(v) for k, v in ROWS[name].items() if v.isdecimal()}, CASES[name].drive()
    target = Target(drive, tmp_path)
    random, start = worst_random(drive, target, FEW)
    steps = max(int(target.count(samples).max()) for samples in torque_steps(drive, FEW))
    point = int(target.count(next(operating_points(drive))).max())
    found, _ = climb(drive, target, start, generations=10, children=500)
    assert found <= row["bound"]
    assert row["random"] / 4 < random <= row["random"]
    assert row["steps"] / 4 < steps <= row["steps"]
    assert row["points"] / 4 < point <= row["points"]


@needs_target
@pytest.mark.long
@pytest.mark.parametrize("name", CASES)
def test_the_worst_sequence_takes_what_the_file_says(name: str, tmp_path: Path) -> None:
    """Where it does not, the law has changed: `python bench/worst_step.py` again."""
    target = Target(CASES[name].drive(), tmp_path)
    sequence = as_sequence(ROWS[name]["sequence"])
    assert longest(target, sequence[None]).tolist() == [int(ROWS[name]["climb"])]
