"""The points of a sweep as columns: the values that were varied, and the key figures there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reluctance.base.arrays import FloatArray
from reluctance.base.errors import ParameterError
from reluctance.base.key_figures import Kpis, start_included
from reluctance.base.schema import did_you_mean
from reluctance.base.units import to_si


@dataclass(frozen=True, repr=False)
class Swept:
    """Key figures over the values that were varied.

    Attributes
    ----------
    name : str
        Of the drive.
    values : dict of str to list
        What was varied: for each key its value at every point.
    figures : dict of str to ndarray, shape (n_points,)
        Key figures under the names of `run --json`, with their units; NaN where there is none.
    why : list of str
        Why a point has no figures; empty where it has.
    grid : tuple of int
        Values of each key where the points are a grid, the last key fastest; else empty.
    """

    name: str
    values: dict[str, list[Any]]
    figures: dict[str, FloatArray]
    why: list[str]
    grid: tuple[int, ...]

    def __len__(self) -> int:
        return len(self.why)

    @property
    def failed(self) -> int:
        """Points without figures."""
        return sum(map(bool, self.why))

    def figure(self, name: str) -> FloatArray:
        """A key figure at every point, shape (n_points,).

        Raises
        ------
        ParameterError
            If there is none of that name.
        """
        return self.figures[figure_name(name)]

    def reason(self) -> str:
        """Why the first point that failed did."""
        return next(filter(None, self.why), "")

    def columns(self) -> dict[str, NDArray[Any]]:
        """Everything as columns: values, figures, and `why`."""
        return {
            **{name: column_of(column) for name, column in self.values.items()},
            **self.figures,
            "why": np.array(self.why, dtype=str),
        }


def figure_name(name: str) -> str:
    """The border name of a key figure, which may be given without its unit.

    Raises
    ------
    ParameterError
        If there is none.
    """
    known = Kpis.border_names()
    for border, figure in known.items():
        if name in (border, figure.name):
            return border
    raise ParameterError(f"no key figure `{name}`{did_you_mean(name, known)}")


def start_of(point: Mapping[str, Any]) -> str:
    """Why the figures of a point include the start of its run; empty where they do not, or where
    there are none."""
    return start_included(point["periods"], to_si(point["speed_mean_rpm"], "rpm"))


def column_of(values: Sequence[Any]) -> NDArray[Any]:
    """Values as numbers if all are, else as text."""
    if all(isinstance(v, int | float) and not isinstance(v, bool) for v in values):
        return np.array(values, dtype=float)
    return np.array([str(v) for v in values], dtype=str)
