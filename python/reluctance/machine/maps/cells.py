"""Cells: rows of text in a CSV file or the text export of a field program."""

import csv
import re

from reluctance.base.columns import refuse_parted, with_points
from reluctance.base.errors import ParameterError
from reluctance.base.reading import is_number
from reluctance.base.sheet import below_titles
from reluctance.machine.maps.raw import column, stated_unit

COMMENTS = ("#", "%", "//", "!")
MOST_HEAD = 60  # lines above the names of the columns


def any_rows(text: str) -> list[list[str]]:
    """Rows of cells as they are, of any length: of a file with lines above its table.

    Raises
    ------
    ParameterError
        If there are none.
    """
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    data = [line for line in lines if not line.startswith(COMMENTS)]
    if not data:
        raise ParameterError("the file has no data; export it again")
    separator = next((s for s in ";\t," if s in data[-1]), None)
    return [cells(line, separator) for line in with_points(data, separator)]


def text_rows(text: str) -> list[list[str]]:
    """Rows of cells. A comment above the numbers that names the columns becomes the first row.

    Raises
    ------
    ParameterError
        If there are no data, or rows differ in length.
    """
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    data = [line for line in lines if not line.startswith(COMMENTS)]
    if not data:
        raise ParameterError("the file has no data; export the map again")
    separator = next((s for s in ";\t," if s in data[-1]), None)
    data = with_points(data, separator)
    rows = map_rows([cells(line, separator) for line in data])
    head = _named_by_comment(lines, separator) if all(map(is_number, rows[0])) else None
    rows = rows if head is None or len(head) != len(rows[0]) else [head, *rows]
    if separator == ",":
        refuse_parted(rows)
    for number, row in enumerate(rows, 1):
        if len(row) != len(rows[0]):
            raise ParameterError(
                f"row {number} of the table has {len(row)} cells, need {len(rows[0])} as in the "
                "first; fill or remove the row"
            )
    return rows


def map_rows(rows: list[list[str]]) -> list[list[str]]:
    """The rows of a map, without what stands above them: names of at least three quantities have
    nothing above them that is data."""
    rows = below_titles(rows)
    named = [k for k, row in enumerate(rows[:MOST_HEAD]) if sum(map(_known, row)) >= 3]
    return rows[named[0] if named else 0 :]


def with_units(
    rows: list[list[str]], names: dict[str, str]
) -> tuple[list[list[str]], dict[str, str]]:
    """Rows whose second one has the units of the columns, which then stand with their names; and
    `names` for the new ones."""
    if len(rows) < 3 or any(map(is_number, rows[0])):
        return rows, names
    units = [cell.strip("[]() ") for cell in rows[1]]
    if any(map(is_number, units)) or sum(map(stated_unit, units)) < 2:
        return rows, names
    head = [
        f"{name} [{unit}]" if stated_unit(unit) else name
        for name, unit in zip(rows[0], units, strict=True)
    ]
    new = dict(zip(rows[0], head, strict=True))
    return [head, *rows[2:]], {quantity: new.get(name, name) for quantity, name in names.items()}


def cells(line: str, separator: str | None) -> list[str]:
    """The cells of a line; a separator within quotes is none."""
    if separator is None:
        return [c.strip('"') for c in re.findall(r'"[^"]*"|\S+', line)]
    parts = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    return [part.strip() for part in parts]


def _named_by_comment(lines: list[str], separator: str | None) -> list[str] | None:
    """The last comment above the data that names at least three columns."""
    for line in reversed(lines):
        if line.startswith(COMMENTS):
            head = cells(line.lstrip("#%/! "), separator)
            if sum(_known(cell) for cell in head) >= 3:
                return head
    return None


def _known(cell: str) -> bool:
    try:
        return column(cell) is not None
    except ParameterError:
        return False
