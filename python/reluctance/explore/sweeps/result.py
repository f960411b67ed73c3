"""What a sweep gave, and ways to look at it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from reluctance.base.errors import ParameterError
from reluctance.base.table_file import write_table
from reluctance.explore.sweeps.swept import Swept

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False)
class Sweep(Swept):
    """What a sweep gave: its points, as `Swept` names them, and where they came from.

    Attributes
    ----------
    ran : int
        Runs made now.
    known : int
        Points that the store had.
    """

    ran: int
    known: int

    def __repr__(self) -> str:
        return f"Sweep({self.name}: {len(self)} points over {', '.join(self.values)})"

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
        import reluctance.explore.sweeps.plots as plots  # Matplotlib loads when it is used

        return plots.plot(self, figures, kind)
