"""Key figures of the examples before and after the engine by Hermite's rule, from the history.

    python bench/engine_figures.py > bench/engine_figures.csv

Of each example the figure that moved by the largest part of itself, between the tables of results
of two commits: the last before the engine, and the one that made the table anew with it. Numbers
that are rounding (`torque_drift`, values below 1e-9) are left out.
"""

import csv
import io
import math
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
BEFORE, AFTER = "2e1ebbd", "1ba500d"
ROUNDING = 1e-9
COLUMNS = ("example", "figure", "before", "after", "part_moved")

Table = dict[str, dict[str, str]]


def table_at(commit: str) -> Table:
    """The table of results of a commit, by example."""
    command = ["git", "show", f"{commit}:docs/results.csv"]
    text = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    return {row.pop("example"): row for row in csv.DictReader(io.StringIO(text))}


def moved(before: Table, after: Table) -> list[dict[str, str | float]]:
    """A row for each example of both tables."""
    rows: list[dict[str, str | float]] = []
    for example in sorted(before.keys() & after.keys()):
        parts = {}
        for figure in before[example].keys() & after[example].keys() - {"torque_drift"}:
            x, y = (_number(table[example][figure]) for table in (before, after))
            if abs(x) > ROUNDING and not math.isnan(y):
                parts[figure] = (abs(y - x) / abs(x), x, y)
        figure = max(parts, key=lambda name: (parts[name][0], name))
        part, x, y = parts[figure]
        rows.append(dict(zip(COLUMNS, (example, figure, x, y, float(f"{part:.2g}")), strict=True)))
    return rows


def _number(text: str) -> float:
    return float(text) if text else math.nan


if __name__ == "__main__":
    writer = csv.DictWriter(sys.stdout, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(moved(table_at(BEFORE), table_at(AFTER)))
