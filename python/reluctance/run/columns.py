"""Tables of the core by the names of their columns."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Table = dict[str, FloatArray]  # (n,) each; (n_phases, n) where there is a column for each phase


def named(parts: Sequence[FloatArray], columns: Sequence[str]) -> Table:
    """Columns of rows (n, len(columns)) by name; `i_0`, `i_1`, ... are the rows of `i`."""
    lines = np.vstack(parts).T
    table: Table = {}
    groups: dict[str, list[int]] = {}
    for j, column in enumerate(columns):
        name, _, phase = column.rpartition("_")
        if phase.isdigit():
            groups.setdefault(name, []).append(j)
        else:
            table[column] = np.ascontiguousarray(lines[j])
    return table | {name: np.ascontiguousarray(lines[j]) for name, j in groups.items()}
