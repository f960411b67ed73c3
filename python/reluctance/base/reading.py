"""Reading a user's file: the one border where whatever goes wrong with it becomes one line."""

import csv
import warnings
from codecs import BOM_UTF8, BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from reluctance.base.arrays import FloatArray
from reluctance.base.columns import point_hint, refuse_parted, with_points
from reluctance.base.errors import Note, ParameterError, named
from reluctance.base.files import note_input
from reluctance.base.sheet import below_titles, sheet_rows

MOST_BYTES = 50_000_000  # of a table of numbers as text
MOST = 1e15  # of a number in a file, either sign: no column of a drive comes near
ENCODINGS = {BOM_UTF8: "utf-8-sig", BOM_UTF16_LE: "utf-16", BOM_UTF16_BE: "utf-16"}
NOT_TEXT = bytes({*range(32)} - {*b"\t\n\v\f\r\x1a\x1b"})


@contextmanager
def reading(path: Path, kind: str, remedy: str = "") -> Iterator[None]:
    """Around a reader: any exception becomes one line with the file's name, kind and remedy.

    Parameters
    ----------
    path : Path
    kind : str
        What the file should be, as in `a pump curve`.
    remedy : str
        What to do where it is none.

    Raises
    ------
    ParameterError
        For every exception that the reader raises, of whichever kind.
    """
    note_input(path)
    todo = f"; {remedy}" if remedy else ""
    try:
        with named(path):
            yield
    except (ParameterError, Note):  # a note is raised where warnings are made errors
        raise
    except FileNotFoundError:
        raise ParameterError(f"cannot read {path}: no such file; check the path") from None
    except OSError as fault:
        raise ParameterError(f"cannot read {path}: {fault.strerror or fault}{todo}") from None
    except MemoryError:
        raise ParameterError(f"{path} takes more memory than there is{todo}") from None
    except Exception as fault:  # readers below raise of every kind on damaged files
        raise ParameterError(
            f"{path} cannot be read as {kind} ({type(fault).__name__}: {fault}){todo}"
        ) from fault


def read_text(path: Path, *, most_bytes: int = MOST_BYTES) -> str:
    """A text in UTF-8, in UTF-16 with its mark, or else in Latin-1, which a Note then says.

    Raises
    ------
    ParameterError
        If the file has more bytes, or is no text.
    OSError
        If it cannot be read.
    """
    with path.open("rb") as file:
        data = file.read(most_bytes + 1)
    if len(data) > most_bytes:
        raise ParameterError(
            f"the file has {path.stat().st_size / 1e6:.0f} MB, need at most {most_bytes / 1e6:g} "
            "MB; keep every n-th row"
        )
    encoding = next((e for mark, e in ENCODINGS.items() if data.startswith(mark)), "utf-8")
    if encoding != "utf-16" and len(data.translate(None, NOT_TEXT)) < len(data):
        raise ParameterError("the file is not text; export it as CSV in UTF-8")
    try:
        return data.decode(encoding)
    except UnicodeDecodeError:
        if encoding != "utf-8":
            raise ParameterError("the file is not text; export it as CSV in UTF-8") from None
    warnings.warn(f"{path} is not in UTF-8; it was read as Latin-1", Note, stacklevel=3)
    return data.decode("latin-1")


def read_rows(path: Path, *, most_bytes: int = MOST_BYTES) -> list[list[str]]:
    """The rows of a CSV file or an .xlsx sheet, its cells without blanks around them; without empty
    lines and lines that begin with #. In text, commas, semicolons, tabs or, between numbers, blanks
    stand between the cells; a decimal comma is a point where it cannot be one of those.

    Raises
    ------
    ParameterError
        If there are none, and as `read_text`.
    """
    if path.suffix.lower() == ".xlsx":
        return sheet_rows(path, without_comments)
    text = read_text(path, most_bytes=most_bytes).splitlines()
    lines = [line for line in text if line.strip() and not line.startswith("#")]
    if not lines:
        raise ParameterError("the file has no rows")
    if not any(mark in line for line in lines for mark in ",;\t"):
        parted = [line.split() for line in lines]  # a cell that is missing would move the others
        alike = len(parted[-1]) > 1 and len({len(row) for row in parted}) == 1
        if alike and all(map(is_number, parted[-1])):
            return parted
    usual = [mark for mark in ";\t" if sum(mark in line for line in lines) > len(lines) / 2]
    separator = usual[0] if usual else ","  # a line above the names may have none
    found = csv.reader(with_points(lines, separator), delimiter=separator)
    rows = [[cell.strip() for cell in row] for row in found]
    if separator == ",":
        first = next((k for k, row in enumerate(rows) if all(map(is_number, row))), 0)
        refuse_parted(rows[max(first - 1, 0) :])
    return rows


def without_comments(rows: list[list[str]]) -> list[list[str]]:
    """The rows of a sheet below its titles that do not begin with #."""
    return below_titles([row for row in rows if not row[0].startswith("#")])


def place_of(names: Sequence[str], name: str) -> int:
    """Where a column stands, from 0.

    Raises
    ------
    ParameterError
        If it stands there twice. That it is missing, the caller has asked.
    """
    if names.count(name) > 1:
        raise ParameterError(f"column `{name}` stands there {names.count(name)} times; keep one")
    return names.index(name)


def is_number(cell: str) -> bool:
    """True of a cell that is a number, finite or not; the head of a column is none."""
    try:
        float(cell)
    except ValueError:
        return False
    return True


def numbers(
    rows: Sequence[Sequence[str]], place: int, name: str, *, first: int = 1, part: str = "the row"
) -> FloatArray:
    """A column of finite numbers, shape (len(rows),).

    Parameters
    ----------
    rows : sequence of sequences of str
    place : int
        Of the column, from 0.
    name : str
        Of the column, for errors.
    first : int
        Number of the first row, for errors.
    part : str
        What may be removed where a cell is none, for errors.

    Raises
    ------
    ParameterError
        With the row and its cell, if a cell is missing, no number, or not finite.
    """
    try:
        values = np.array([float(row[place]) for row in rows], dtype=np.float64)
    except (ValueError, IndexError):
        values = np.full(len(rows), np.nan)
    if (np.abs(values) <= MOST).all():  # false for NaN
        return values
    for number, row in enumerate(rows, first):
        cell = row[place] if place < len(row) else ""
        if not is_number(cell):
            raise ParameterError(
                f"data row {number}, {name}: `{cell[:30]}` is not a number; "
                + (point_hint(cell) or f"fill the cell or remove {part}")
            )
        if not abs(float(cell)) <= MOST:
            raise ParameterError(
                f"data row {number}, {name}: `{cell[:30]}` is not a finite number "
                f"below {MOST:g}; mend the cell or remove {part}"
            )
    raise AssertionError("a cell is no number, and none is found")
