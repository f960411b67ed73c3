"""The figure that every module draws on: with its own canvas, visible in any notebook."""

from __future__ import annotations

from typing import Any

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec

from reluctance.figures import EMBEDDED, drawn, width_in

# A panel with tick labels, axis label and a legend of three names is legible from here on, by eye
# on the overview of `paper_rated` [in].
PANEL_WIDTH, PANEL_HEIGHT = 2.3, 1.7


class Picture(Figure):
    """No window and no global state. A notebook shows it without magic.

    `figure.figsize` of Matplotlib, where it is not the default, or the width of `figures.look` goes
    before the size that a module proposes. Panels that would be too narrow for their labels are put
    below each other when the figure is saved, and the figure grows in height.
    """

    def __init__(self, width: float, height: float) -> None:
        super().__init__(layout="constrained")
        FigureCanvasAgg(self)
        self.propose(width, height)

    def propose(self, width: float, height: float) -> None:
        """A size [in], unless the user has chosen one."""
        usual = list(mpl.rcParamsDefault["figure.figsize"])
        chosen = list(mpl.rcParams["figure.figsize"])
        if (narrow := width_in.get()) is not None:
            self.set_size_inches(narrow, height * narrow / width)
        elif chosen != usual:
            self.set_size_inches(*chosen)
        else:
            self.set_size_inches(width, height)

    def savefig(self, fname: Any, **options: Any) -> None:
        """As Matplotlib does, with TrueType fonts and with all labels inside."""
        self._stack_narrow_panels()
        if width_in.get() is not None:
            self.suptitle("")  # a paper has a caption
        with mpl.rc_context(EMBEDDED):
            super().savefig(fname, **options)

    def _repr_png_(self) -> bytes:
        return drawn(self, ".png")

    def _stack_narrow_panels(self) -> None:
        """One column of panels where the columns would be narrower than their labels allow."""
        specs = [(ax, spec) for ax in self.axes if (spec := ax.get_subplotspec()) is not None]
        if not specs or self.subfigs:
            return
        grid = specs[0][1].get_gridspec()
        width, height = self.get_size_inches()
        rows = grid.nrows
        if grid.ncols > 1 and width / grid.ncols < PANEL_WIDTH:
            rows = len(specs)
            height *= rows / grid.nrows
            column = GridSpec(rows, 1, figure=self)
            for n, (ax, _) in enumerate(specs):
                ax.set_subplotspec(column[n])
        if rows > 1:
            self.set_size_inches(width, max(height, rows * PANEL_HEIGHT))
