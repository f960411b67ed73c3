"""A course over time from a file: a torque, a speed or a head of a drive file."""

from __future__ import annotations

from pathlib import Path

from reluctance.base.errors import ParameterError
from reluctance.base.reading import is_number, numbers, place_of, read_rows, reading

MOST_POINTS = 100_000  # of a course: a run looks them up at each step


def read_course(path: Path, key: str) -> tuple[list[float], list[float]]:
    """Times [s] and values in the unit of the key.

    Raises
    ------
    ParameterError
        If the file cannot be read as columns `t_s` and `key`, or two columns without names.
    """
    with reading(path, f"columns t_s and {key}", f"{key} takes a number, or a CSV or .xlsx file"):
        rows = read_rows(path)
        places = 0, 1
        if not is_number(rows[0][0]):
            head, rows = rows[0], rows[1:]
            if "t_s" not in head or key not in head:
                raise ParameterError(f"columns {', '.join(head)}; need t_s and {key}")
            places = place_of(head, "t_s"), place_of(head, key)
        if not 1 <= len(rows) <= MOST_POINTS:
            raise ParameterError(
                f"{len(rows)} rows of t_s and {key}, need 1 to {MOST_POINTS}; keep every n-th row: "
                "values between two rows lie on a straight line"
            )
        t, values = (numbers(rows, k, n) for k, n in zip(places, ("t_s", key), strict=True))
    return t.tolist(), values.tolist()
