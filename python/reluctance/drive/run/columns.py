"""Rows with names: what a run records, as include/srm/sim/recorder.hpp names it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reluctance.base.arrays import FloatArray


@dataclass(frozen=True)
class Rows:
    """Rows of numbers whose columns have names."""

    values: FloatArray  # (n, n_columns)
    names: list[str]

    def __getitem__(self, name: str) -> FloatArray:
        """A column, shape (n,)."""
        return self.values[:, self.names.index(name)]

    def phases(self, name: str) -> FloatArray:
        """The columns of all phases, shape (n_phases, n)."""
        start = f"{name}_"
        columns = [
            j for j, n in enumerate(self.names) if n.startswith(start) and n[len(start) :].isdigit()
        ]
        return np.ascontiguousarray(self.values[:, columns].T)

    def between(self, start: int, end: int) -> Rows:
        """Some of the rows."""
        return Rows(self.values[start:end], self.names)

    def rise(self, name: str) -> float:
        """A column's last value less its first."""
        column = self[name]
        return float(column[-1] - column[0])
