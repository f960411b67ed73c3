"""The store of a sweep: one SQLite file with the key figures of every run, under its fingerprint.

A row is in the file for good once `add` has returned, whatever happens to the process, the disk or
the power afterwards. Each row has a CRC-32 of all else in it. Any tool that reads SQLite reads the
table `runs`.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from reluctance.base.errors import ParameterError, one_line
from reluctance.base.files import check_ending, kept, write_once
from reluctance.base.key_figures import Kpis

if TYPE_CHECKING:
    from sqlite3 import Connection

ENDINGS = (".sqlite", ".db")
MARK = 0x52454C55  # application_id of our files: RELU
PATIENCE = 60.0  # for another process that writes [s]
AT_ONCE = 500  # keys of one question


@dataclass(frozen=True)
class Row:
    """A run: its figures under border names, or why it has none."""

    key: bytes
    values: Mapping[str, Any]  # what was varied
    figures: Mapping[str, float | None]
    why: str = ""


def check_store(path: Path) -> None:
    """Raises ParameterError where a store could not be: before the work, not after it."""
    check_ending(path, ENDINGS)


class Store:
    """Rows by their keys, in a file that is made where there is none."""

    def __init__(self, path: Path) -> None:
        import sqlite3  # here: a twentieth of the import time of the package

        check_store(path)
        self.path = path
        if not path.exists():
            write_once(path, lambda temporary: temporary.write_bytes(_empty()))
        with self._told("read"):
            self.base: Connection = sqlite3.connect(path, timeout=PATIENCE)
        try:
            self._join()
        except BaseException:
            self.base.close()
            raise

    def _join(self) -> None:
        """Makes sure that the file is a store, with a column for every figure."""
        with self._told("read"):
            if self.base.execute("PRAGMA application_id").fetchone()[0] != MARK:
                raise ParameterError(f"{self.path} is no store of a sweep; choose another --out")
            if not self._missing():
                return
        with self._told("write"), self.base:  # figures that are newer than the file
            self.base.execute("BEGIN IMMEDIATE")  # another process may add them as well
            for column in self._missing():
                self.base.execute(f"ALTER TABLE runs ADD COLUMN {column}")

    def _missing(self) -> list[str]:
        there = {row[1] for row in self.base.execute("PRAGMA table_info(runs)")}
        return [column for name, column in _columns().items() if name not in there]

    def close(self) -> None:
        self.base.close()

    def add(self, rows: Sequence[Row]) -> None:
        """All of the rows, or none."""
        names = list(Kpis.border_names())
        columns = ", ".join(map(_quoted, ["key", "values", "why", "crc", *names]))
        marks = ", ".join("?" * (4 + len(names)))
        found = []
        for row in rows:
            values = json.dumps(row.values, default=str)
            figures = [row.figures.get(name) for name in names]
            crc = _crc(row.key, values, row.why, zip(names, figures, strict=True))
            found.append((row.key, values, row.why, crc, *figures))
        with self._told("write"), self.base:
            self.base.executemany(
                f"INSERT OR REPLACE INTO runs ({columns}) VALUES ({marks})", found
            )
        kept[self.path] += len(found)

    def known(self, keys: Sequence[bytes]) -> Iterator[Row]:
        """The rows of those keys that there are, in no order."""
        names = list(Kpis.border_names())
        columns = ", ".join(map(_quoted, ["key", "values", "why", "crc", *names]))
        for start in range(0, len(keys), AT_ONCE):
            some = keys[start : start + AT_ONCE]
            marks = ", ".join("?" * len(some))
            with self._told("read"):
                found = self.base.execute(
                    f'SELECT {columns} FROM runs WHERE "key" IN ({marks})', some
                ).fetchall()
            for key, values, why, crc, *figures in found:
                if crc != _crc(key, values, why, zip(names, figures, strict=True)):
                    raise ParameterError(
                        f"{self.path} is damaged: the row {key.hex()} does not fit its CRC-32; "
                        "delete the row, or choose another --out"
                    )
                yield Row(key, {}, dict(zip(names, figures, strict=True)), why)

    def __contains__(self, key: bytes) -> bool:
        with self._told("read"):
            return (
                self.base.execute('SELECT 1 FROM runs WHERE "key" = ?', (key,)).fetchone()
                is not None
            )

    @contextmanager
    def _told(self, what: str) -> Iterator[None]:
        """What goes wrong with the file, as one line."""
        import sqlite3

        try:
            yield
        except (sqlite3.Error, UnicodeDecodeError) as fault:
            stays = "; what it has stays, and the same command goes on from there"
            raise ParameterError(
                f"cannot {what} {self.path}: {one_line(fault)}{stays if what == 'write' else ''}"
            ) from None


def _columns() -> dict[str, str]:
    """What may be younger than a store: each column by its name, with its type."""
    return {"crc": '"crc" INTEGER'} | {name: f'"{name}" REAL' for name in Kpis.border_names()}


def _quoted(name: str) -> str:
    return f'"{name}"'


def _crc(key: bytes, values: object, why: object, figures: Iterable[tuple[str, object]]) -> int:
    """Of a row. A figure that there is none of counts as one that is not in the file."""
    there = [
        (name, float(value) if isinstance(value, int | float) else value)
        for name, value in figures
        if value is not None and value == value
    ]
    return zlib.crc32(repr((key, values, why, there)).encode())


def _empty() -> bytes:
    """A store without rows."""
    import sqlite3

    columns = ", ".join(_columns().values())
    base = sqlite3.connect(":memory:")
    base.execute(f"PRAGMA application_id = {MARK}")
    base.execute(
        f'CREATE TABLE runs ("key" BLOB PRIMARY KEY, "values" TEXT, "why" TEXT, {columns})'
        " WITHOUT ROWID"
    )
    content: bytes = base.serialize()
    base.close()
    return content
