"""A course over time from a CSV file: a torque, a speed or a head of a drive file."""

from __future__ import annotations

import csv
from itertools import islice
from pathlib import Path

from reluctance.columns import is_number
from reluctance.errors import ParameterError

MOST_POINTS = 100_000  # of a course: a run looks them up at each step


def read_course(path: Path, key: str) -> tuple[list[float], list[float]]:
    """Times [s] and values in the unit of the key.

    Raises
    ------
    ParameterError
        If the file cannot be read as columns `t_s` and `key`, or two columns without names.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.reader(line for line in file if not line.startswith("#"))
            filled = filter(None, reader)
            rows = list(islice(filled, MOST_POINTS + 1))  # with the names of the columns
            more = sum(1 for _ in filled)
    except (OSError, UnicodeDecodeError) as fault:
        raise ParameterError(
            f"cannot read {path}: {fault}; {key} takes a number or a CSV file"
        ) from None
    head = [cell.strip() for cell in rows[0]] if rows else []
    places = (0, 1)
    if head and not is_number(head[0]):
        if "t_s" not in head or key not in head:
            raise ParameterError(f"{path}: columns {', '.join(head)}; need t_s and {key}")
        places, rows = (head.index("t_s"), head.index(key)), rows[1:]
    try:
        found = [[float(row[place]) for row in rows] for place in places]
    except (ValueError, IndexError):
        raise ParameterError(
            f"{path} is not a table of numbers with columns t_s and {key}"
        ) from None
    if not found[0]:
        raise ParameterError(f"{path} has no rows; need columns t_s and {key}")
    if len(found[0]) + more > MOST_POINTS:
        raise ParameterError(
            f"{path} has {len(found[0]) + more} rows, need at most {MOST_POINTS}; keep every n-th "
            "row: values between two rows lie on a straight line"
        )
    return found[0], found[1]
