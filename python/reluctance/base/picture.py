"""The figure that every module draws on: with its own canvas, visible in any notebook."""

from __future__ import annotations

import textwrap
import warnings
from collections.abc import Iterable, Sequence
from typing import Any

import matplotlib as mpl
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec, SubplotSpec
from matplotlib.text import Text

from reluctance.base.figures import EMBEDDED, drawn, width_in

# A panel with tick labels, axis label and a legend of three names is legible from here on, by eye
# on the overview of `paper_rated` [in].
PANEL_WIDTH, PANEL_HEIGHT = 2.3, 1.7
LEAST_AXES = 0.85  # height of axes that are still read, by eye [in]
PASSES = 5  # of layout and wrapping; two settle all figures of the tests
LUMINANCE = (0.2126, 0.7152, 0.0722)  # of red, green and blue, Rec. ITU-R BT.709


class Picture(Figure):
    """No window and no global state. A notebook shows it without magic.

    `figure.figsize` of Matplotlib, where it is not the default, or the width of `figures.look` goes
    before the size that a module proposes. When the figure is saved, panels that would be too
    narrow for their labels are put below each other, texts that are too long for their axes are
    wrapped, and the figure grows in height as far as that takes.
    """

    def __init__(self, width: float, height: float) -> None:
        super().__init__(layout="constrained")
        FigureCanvasAgg(self)
        self._below: tuple[list[Artist], list[str]] = ([], [])
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

    @property
    def one_column(self) -> bool:
        """Whether two panels side by side would be too narrow."""
        return bool(self.get_size_inches()[0] < 2 * PANEL_WIDTH)

    def legend_below(self, handles: Iterable[Artist], names: Iterable[str]) -> None:
        """A legend below all panels, in as many columns as the width allows."""
        self._below = (list(handles), list(names))
        self._draw_legend(len(self._below[1]))

    def _draw_legend(self, columns: int) -> None:
        for legend in self.legends:
            legend.remove()
        size = min(8.0, mpl.rcParams["font.size"])
        self.legend(*self._below, ncols=columns, loc="outside lower center", fontsize=size)

    def suptitle(self, t: str, **options: Any) -> Text:
        """As Matplotlib does; the signs of a formula in a name are only signs."""
        return super().suptitle(t, **{"parse_math": False} | options)

    def savefig(self, fname: Any, **options: Any) -> None:
        """As Matplotlib does, with TrueType fonts and with all labels inside."""
        self._stack_narrow_panels()
        if width_in.get() is not None:
            self.suptitle("")  # a paper has a caption
        with mpl.rc_context(EMBEDDED):
            self._fit()
            super().savefig(fname, **options)

    def _repr_png_(self) -> bytes:
        return drawn(self, ".png")

    def _stack_narrow_panels(self) -> None:
        """One column of panels where the columns would be narrower than their labels allow. Axes
        over each other, as of two scales, are one panel."""
        panels: dict[SubplotSpec, list[Axes]] = {}
        for ax in self.axes:
            if (spec := ax.get_subplotspec()) is not None:
                panels.setdefault(spec, []).append(ax)
        if not panels or self.subfigs:
            return
        grid = next(iter(panels)).get_gridspec()
        width, height = self.get_size_inches()
        rows = grid.nrows
        if grid.ncols > 1 and width / grid.ncols < PANEL_WIDTH:
            rows = len(panels)
            height *= rows / grid.nrows
            column = GridSpec(rows, 1, figure=self)
            for n, axes in enumerate(panels.values()):
                for ax in axes:
                    ax.set_subplotspec(column[n])
        if rows > 1:
            self.set_size_inches(width, max(height, rows * PANEL_HEIGHT))

    def _fit(self) -> None:
        """Wraps and moves texts until each has its place."""
        for _ in range(PASSES):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of a layout that is not the last
                self.draw_without_rendering()
            shown = [ax for ax in self.axes if ax.get_visible()]
            rows = max((spec.get_gridspec().nrows for spec in _specs(shown)), default=1)
            most = self.get_window_extent().height / rows  # where a layout has failed
            moved = [_wrapped(ax, LEAST_AXES * self.dpi, most) | _raised(ax) for ax in shown]
            if (below := getattr(self, "_supxlabel", None)) is not None:
                moved.append(_wrap(below, self.get_window_extent().width))
            if not any([*moved, self._legend_fits(), self._grown(shown, rows)]):
                return

    def _legend_fits(self) -> bool:
        """Fewer columns of the legend below, and then lines of its names; True where it changed."""
        handles, names = self._below
        if not names:
            return False
        (legend,) = self.legends
        columns, room = legend._ncols, self.get_window_extent().width  # type: ignore[attr-defined]
        if legend.get_window_extent().width <= room:
            return False
        if columns == 1:
            most = max(len(line) for name in names for line in name.splitlines())
            self._below = (handles, [textwrap.fill(name, int(0.75 * most)) for name in names])
        self._draw_legend(max(columns - 1, 1))
        return True

    def _grown(self, shown: Sequence[Axes], rows: int) -> bool:
        """More height where texts have left too little for the axes."""
        if not shown or width_in.get() is None:
            return False
        heights = [ax.get_window_extent().height / self.dpi for ax in shown]
        lacks = LEAST_AXES - min(heights)
        if lacks < 0.02:
            return False
        width, height = self.get_size_inches()
        self.set_size_inches(width, height + rows * lacks)
        return True


def _specs(shown: Sequence[Axes]) -> list[SubplotSpec]:
    return [spec for ax in shown if (spec := ax.get_subplotspec()) is not None]


def _wrapped(ax: Axes, least: float, most: float) -> bool:
    """Titles and labels of axes in as many lines as their width and height ask for; the height
    counts as at least and at most so much [px]. True where that changed one."""
    box = ax.get_window_extent()
    titles = [ax.title, ax._left_title, ax._right_title]  # type: ignore[attr-defined]
    height = min(max(box.height, least), most)
    changed = [_wrap(text, 1.05 * box.width) for text in (*titles, ax.xaxis.label)]
    return any([*changed, _wrap(ax.yaxis.label, 1.05 * height)])


def _wrap(text: Text, room: float) -> bool:
    """A text in lines that are no longer than a room [px]; True where that changed it."""
    words = text.get_text()
    if not words.strip() or "$" in words:
        return False
    box = text.get_window_extent()
    long = box.height if text.get_rotation() in (90.0, 270.0) else box.width
    if long <= room:
        return False
    longest = max(map(len, words.splitlines()))
    lines = textwrap.wrap(
        " ".join(words.split()), max(int(longest * room / long), 4), break_long_words=False
    )
    if "\n".join(lines) == words:
        return False
    text.set_text("\n".join(lines))
    return True


def _raised(ax: Axes) -> bool:
    """Moves the title at the left above a legend that it runs into; True where it did."""
    title, legend = ax._left_title, ax.get_legend()  # type: ignore[attr-defined]
    if legend is None or not title.get_text():
        return False
    box = legend.get_window_extent()
    if not title.get_window_extent().overlaps(box):
        return False
    above = box.y1 - ax.get_window_extent().y1
    ax.set_title(title.get_text(), loc="left", pad=72 * above / ax.figure.dpi)
    return True


def styled(colour: str, place: int | None = None) -> str:
    """A colour of our own as the style in use has it: of a style with colours of its own the one at
    this place of its cycle, and of a grey style at least the grey of this lightness."""
    cycle = mpl.rcParams["axes.prop_cycle"].by_key().get("color", [])
    if not cycle or cycle == mpl.rcParamsDefault["axes.prop_cycle"].by_key()["color"]:
        return colour
    if place is not None:
        return str(cycle[place % len(cycle)])
    if all(len(set(to_rgb(other))) == 1 for other in cycle):
        grey = sum(part * by for part, by in zip(to_rgb(colour), LUMINANCE, strict=True))
        return f"{grey:.3f}"
    return colour
