"""The work of a sweep: each point becomes a drive, and is run if the store has no row of it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

from reluctance.base.errors import ParameterError
from reluctance.base.key_figures import Kpis
from reluctance.drive.drive import Drive
from reluctance.drive.run.simulate import checked
from reluctance.explore.sweeps.fingerprint import fingerprint
from reluctance.explore.sweeps.store import Row, Store
from reluctance.explore.sweeps.vary import Columns

COMMIT_EVERY = 0.5  # at most so much work is lost with the process [s]

Numbered = Iterator[tuple[int, Drive]]
Runner = Callable[[Numbered], Iterator[tuple[int, Kpis | ParameterError]]]


class Points:
    """The points of a sweep on their way into the store."""

    def __init__(self, drive: Drive, columns: Columns, store: Store, until: float | None) -> None:
        self.drive, self.columns, self.store, self.until = drive, columns, store, until
        self.count = len(next(iter(columns.values())))
        self.keys: list[bytes] = [b""] * self.count  # b"": no drive could be made
        self.why: dict[int, str] = {}  # of those without a drive
        self.known = self.ran = self.asked = 0
        self._begun: set[bytes] = set()

    def values(self, n: int) -> dict[str, Any]:
        return {name: column[n] for name, column in self.columns.items()}

    def work(self, runner: Runner, progress: Callable[[float], None] | None) -> None:
        """Runs what the store does not have. What has ended is in the store within half a second,
        and when this is left, however it is."""
        pending: list[Row] = []
        last = time.monotonic()
        try:
            for n, found in runner(self._new()):
                pending.append(self._row(n, found))
                self.ran += 1
                if time.monotonic() - last > COMMIT_EVERY:
                    self.store.add(pending)
                    pending, last = [], time.monotonic()
                if progress is not None:
                    progress((self.asked - len(self._begun) + self.ran) / self.count)
        finally:
            if pending:
                self.store.add(pending)

    def _new(self) -> Numbered:
        """Drives that have not been run, by their numbers."""
        for n in range(self.count):
            self.asked += 1
            try:
                drive = self.drive.with_values(self.values(n))
                key = fingerprint(drive, checked(drive, self.until, None))
            except (ParameterError, OSError) as fault:
                self.why[n] = str(fault)
                continue
            self.keys[n] = key
            if key in self._begun:
                continue
            if key in self.store:
                self.known += 1
                continue
            self._begun.add(key)
            yield n, drive

    def _row(self, n: int, found: Kpis | ParameterError) -> Row:
        if isinstance(found, ParameterError):
            return Row(self.keys[n], self.values(n), {}, str(found) or "no reason given")
        return Row(self.keys[n], self.values(n), found.with_units())
