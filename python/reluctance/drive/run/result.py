"""The result of a run: its record, and ways to look at it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from reluctance.base.errors import ParameterError
from reluctance.base.table_file import write_table
from reluctance.drive.run.record import Record

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False)
class Result(Record):
    """Waveforms and key figures of a run, under the names of `Record`, and ways to look at them."""

    def __repr__(self) -> str:
        k = self.kpis
        ripple = "" if k.torque_ripple_pp is None else f", ripple {k.torque_ripple_pp:.2%}"
        return (
            f"Result({self.drive.name}: {k.tau_mean:.4g} N m{ripple}, "
            f"{k.f_switch / 1e3:.4g} kHz; {self.t.size} rows of waveforms)"
        )

    def _repr_html_(self) -> str:
        """The key figures, for notebooks."""
        return f"<p>{self.drive.name}</p>{self.kpis._repr_html_()}"

    def plot(self, path: str | Path | None = None) -> Figure:
        """An overview of the last electrical periods; a Matplotlib figure that belongs to the
        caller. With a path it is written there as well; the ending chooses png, svg, pdf or html.

        Raises
        ------
        ParameterError
            If the run kept no waveforms, or the ending is unknown.
        """
        from reluctance.base.figures import check_figure
        from reluctance.drive.run.plots import overview, save_plot  # Matplotlib: when it is used

        if self.t.size == 0:
            raise ParameterError("the run has no waveforms; simulate with record = 0")
        if path is not None:
            check_figure(Path(path))
            save_plot(self, path)
        return overview(self)

    def to_dataframe(self) -> Any:
        """The waveforms as a pandas table, columns as in a waveform file: `t_s`, `speed_rpm`, ...

        Raises
        ------
        ParameterError
            If pandas is not installed.
        """
        try:
            import pandas  # type: ignore[import-untyped,import-not-found,unused-ignore]
        except ImportError:
            raise ParameterError(
                "to_dataframe() needs pandas; `pip install pandas`, or use the arrays of the result"
            ) from None
        return pandas.DataFrame(self.columns())

    def save(self, path: str | Path) -> None:
        """Writes the waveforms; the ending chooses csv, npz, parquet or mat.

        Raises
        ------
        ParameterError
            If the ending is unknown, the folder is missing, or parquet support is not installed.
        """
        write_table(Path(path), self.columns())
