"""Cells: rows of text in a CSV file, the text export of a field program, a spreadsheet."""

import csv
import re
import warnings
from contextlib import closing
from pathlib import Path
from typing import Any
from zipfile import ZipFile

from reluctance.base.columns import refuse_parted, with_points
from reluctance.base.errors import Note, ParameterError
from reluctance.base.reading import is_number
from reluctance.machine.maps.raw import column, stated_unit

COMMENTS = ("#", "%", "//", "!")
MOST_ROWS, MOST_COLUMNS = 200_000, 1000  # of a spreadsheet
LEAST_ROWS = 3  # of a table on a sheet: names or an axis, and two more
MOST_HEAD = 60  # lines above the names of the columns
MOST_UNPACKED = 50_000_000  # bytes: the size of a spreadsheet says little, for it is packed


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
    rows = _table([cells(line, separator) for line in data])
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


def _table(rows: list[list[str]]) -> list[list[str]]:
    """Without what stands above the table: titles, the date, a note. A row of a table has two cells
    that are filled; names of at least three quantities have nothing above them that is data."""
    head = next((k for k, row in enumerate(rows) if sum(map(bool, row)) > 1), 0)
    named = [k for k, row in enumerate(rows[:MOST_HEAD]) if sum(map(_known, row)) >= 3]
    return rows[max([head, *named[:1]]) :]


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


def sheet_rows(path: Path) -> list[list[str]]:
    """Rows of the first sheet of an .xlsx file that has a table, without empty ones.

    Raises
    ------
    ParameterError
        If openpyxl is not installed, or the file is not such a file.
    """
    try:
        from openpyxl import load_workbook
    except ImportError:
        raise ParameterError(
            ".xlsx needs openpyxl; `pip install 'reluctance[xlsx]'`, or save the sheet as CSV"
        ) from None
    with ZipFile(path) as archive:
        unpacked = sum(part.file_size for part in archive.infolist())
    if unpacked > MOST_UNPACKED:
        raise ParameterError(
            f"the file has {unpacked / 1e6:.0f} MB unpacked, need at most {MOST_UNPACKED / 1e6:g} "
            "MB; put the map alone on a sheet, or save it as CSV"
        )
    with closing(load_workbook(path, read_only=True, data_only=True)) as book:
        for sheet in book.worksheets:
            found = _table(_filled_rows(sheet))
            width = max(map(len, found), default=0)
            found = [row + [""] * (width - len(row)) for row in found]
            filled = [n for n in range(width) if any(row[n] for row in found)]
            if len(found) >= LEAST_ROWS and len(filled) > 1:
                if sheet.title != book.worksheets[0].title:
                    told = f"{path}: sheet `{sheet.title}` is read, the first one with a table"
                    warnings.warn(told, Note, stacklevel=2)
                if not all(row[n] for row in found for n in filled):
                    _check_formulas(path, sheet)
                return [[row[n] for n in filled] for row in found]
    raise ParameterError("no sheet has a table; put the map on the first one")


def _check_formulas(path: Path, sheet: Any) -> None:
    """Raises ParameterError at the first formula whose value the file lacks."""
    from openpyxl import load_workbook

    with closing(load_workbook(path, read_only=True)) as book:
        formulas = book[sheet.title].iter_rows()
        for values, row in zip(sheet.iter_rows(values_only=True), formulas, strict=False):
            for value, cell in zip(values, row, strict=False):
                if value is None and str(cell.value).startswith("="):
                    raise ParameterError(
                        f"cell {cell.coordinate} of sheet `{sheet.title}` is a formula without its "
                        "value, which the program that wrote the file did not compute; open it in "
                        "a spreadsheet program and save it, or write numbers"
                    )


def _filled_rows(sheet: Any) -> list[list[str]]:
    sheet.reset_dimensions()  # which the file states, and may state wrongly
    found = []
    for number, values in enumerate(sheet.iter_rows(values_only=True)):
        row = ["" if v is None else str(v).strip() for v in values]
        if number >= MOST_ROWS or any(row[MOST_COLUMNS:]):
            raise ParameterError(
                f"the sheet has cells beyond {MOST_ROWS} rows or {MOST_COLUMNS} columns; a map has "
                "some hundred samples: put it alone on the first sheet"
            )
        if any(row):
            found.append(row)
    return found


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
