"""What a sweep found: its points, their key figures, and ways to look at them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from reluctance.drive.schema import did_you_mean
from reluctance.errors import ParameterError
from reluctance.files import write_table
from reluctance.run import Kpis

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, repr=False)
class Sweep:
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
    ran : int
        Runs made now.
    known : int
        Points that the store had.
    """

    name: str
    values: dict[str, list[Any]]
    figures: dict[str, FloatArray]
    why: list[str]
    grid: tuple[int, ...]
    ran: int
    known: int

    def __len__(self) -> int:
        return len(self.why)

    @property
    def failed(self) -> int:
        """Points without figures."""
        return sum(map(bool, self.why))

    def __repr__(self) -> str:
        return f"Sweep({self.name}: {len(self)} points over {', '.join(self.values)})"

    def figure(self, name: str) -> FloatArray:
        """A key figure at every point, shape (n_points,).

        Raises
        ------
        ParameterError
            If there is none of that name.
        """
        return self.figures[figure_name(name)]

    def best(self, name: str, *, most: bool = False) -> dict[str, Any]:
        """Values and figures of the point where a figure is least, or most.

        Raises
        ------
        ParameterError
            If no point has this figure.
        """
        figure = self.figure(name)
        if np.isnan(figure).all():
            raise ParameterError(f"no point has {name}; first reason: {self.reason() or 'none'}")
        n = int(np.nanargmax(figure) if most else np.nanargmin(figure))
        return self.point(n)

    def point(self, n: int) -> dict[str, Any]:
        """Values and figures of point n."""
        figures = {name: float(column[n]) for name, column in self.figures.items()}
        return {name: column[n] for name, column in self.values.items()} | figures

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

    def to_dataframe(self) -> Any:
        """The columns as a pandas table."""
        try:
            import pandas
        except ImportError:
            raise ParameterError(
                "to_dataframe() needs pandas; `pip install pandas`, or use `columns()`"
            ) from None
        return pandas.DataFrame(self.columns())

    def save(self, path: str | Path) -> None:
        """Writes the columns; the ending chooses csv, npz, parquet or mat."""
        write_table(Path(path), self.columns())

    def plot(self, figures: str | Sequence[str] | None = None, kind: str | None = None) -> Figure:
        """A figure of the sweep; it belongs to the caller.

        Parameters
        ----------
        figures : str or list of str, optional
            Key figures to show; by default ripple, efficiency and rms current, as far as there are.
        kind : str, optional
            "lines", "heat", "parallel" or "pareto"; by default what suits what was varied.
        """
        from reluctance.sweep.plots import plot  # Matplotlib loads when it is used

        return plot(self, figures, kind)


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


def column_of(values: Sequence[Any]) -> NDArray[Any]:
    """Values as numbers if all are, else as text."""
    if all(isinstance(v, int | float) and not isinstance(v, bool) for v in values):
        return np.array(values, dtype=float)
    return np.array([str(v) for v in values], dtype=str)
