"""A spreadsheet as rows of text."""

import warnings
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any
from zipfile import ZipFile

from reluctance.base.errors import Note, ParameterError

MOST_ROWS, MOST_COLUMNS = 200_000, 1000
LEAST_ROWS = 3  # of a table: names or an axis, and two more
MOST_UNPACKED = 50_000_000  # bytes: the size of the file says little, for it is packed


def below_titles(rows: list[list[str]]) -> list[list[str]]:
    """Rows without a title, a date or a note above them: a row of a table has two filled cells."""
    return rows[next((k for k, row in enumerate(rows) if sum(map(bool, row)) > 1), 0) :]


def sheet_rows(
    path: Path, table: Callable[[list[list[str]]], list[list[str]]] = below_titles
) -> list[list[str]]:
    """Rows of the first visible sheet of an .xlsx file that has a table, without empty ones.

    Parameters
    ----------
    path : Path
    table : function
        Which of the filled rows of a sheet are its table.

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
            "MB; put the table alone on a sheet, or save it as CSV"
        )
    with closing(load_workbook(path, read_only=True, data_only=True)) as book:
        shown = [sheet for sheet in book.worksheets if sheet.sheet_state == "visible"]
        for sheet in shown:
            found = table(_filled_rows(sheet))
            width = max(map(len, found), default=0)
            found = [row + [""] * (width - len(row)) for row in found]
            filled = [n for n in range(width) if any(row[n] for row in found)]
            if len(found) >= LEAST_ROWS and len(filled) > 1:
                if sheet.title != shown[0].title:
                    told = f"{path}: sheet `{sheet.title}` is read, the first one with a table"
                    warnings.warn(told, Note, stacklevel=2)
                if not all(row[n] for row in found for n in filled):
                    _check_formulas(path, sheet)
                return [[row[n] for n in filled] for row in found]
    raise ParameterError("no sheet has a table; put it on the first one")


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
                f"the sheet has cells beyond {MOST_ROWS} rows or {MOST_COLUMNS} columns: put the "
                "table alone on the first sheet"
            )
        if any(row):
            found.append(row)
    return found
