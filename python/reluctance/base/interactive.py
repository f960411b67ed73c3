"""A Matplotlib figure as one self-contained page: every line with zoom, pan and the value under the
pointer.

Lines are taken over with their names, colours and steps, those across all of the axes too, and so
are annotations; filled areas and other texts are not. The page needs no other file and no network.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.category import StrCategoryLocator
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Annotation
from matplotlib.ticker import FixedLocator
from numpy.typing import NDArray

from reluctance.base.html_page import html_page

MOST_POINTS = 20_000  # of a line; longer ones keep the extremes of as many intervals
FRAME = 280  # height of what the axes enclose [px]
ALONG: dict[str, Any] = {"left": "left", "center": "center", "right": "right"}
ALONG |= {"bottom": "left", "baseline": "left", "top": "right"}  # of a text that runs upwards
ACROSS: dict[str, Any] = {
    "bottom": "bottom",
    "baseline": "alphabetic",
    "center": "middle",
    "top": "top",
}
ACROSS |= {"left": "top", "right": "bottom"}  # of a text that runs upwards
DASHES = {"-": "solid", "--": "dashed", ":": "dotted", "-.": "dotdash", "None": "solid"}


def page(title: str, figure: Figure, below: str = "") -> str:
    """The page.

    Parameters
    ----------
    title : str
        Plain text.
    figure : Figure
    below : str
        What follows the figure, as HTML.
    """
    from bokeh.embed import components
    from bokeh.layouts import gridplot
    from bokeh.resources import Resources

    shared: dict[Any, Any] = {}
    panels = [_panel(ax, shared) for ax in figure.axes if ax.get_lines()]
    columns = 1 if len(panels) == 1 else 2
    rows = [panels[n : n + columns] for n in range(0, len(panels), columns)]
    grid = gridplot(rows, sizing_mode="stretch_width", merge_tools=False)
    script, body = components(grid)
    library = Resources(mode="inline", components=["bokeh"]).render()
    return html_page(title, f"{body}{script}{below}", head=library)


def _panel(ax: Axes, shared: dict[Any, Any]) -> Any:
    """The lines of some axes. Axes with the same horizontal quantity and limits move together."""
    from bokeh.models import HoverTool, Range1d
    from bokeh.plotting import figure

    def range_of(limits: tuple[float, float]) -> Range1d:
        return Range1d(start=float(limits[0]), end=float(limits[1]))

    x_label, y_label = ax.get_xlabel(), ax.get_ylabel()
    drawn = figure(
        title=ax.get_title() or ax.get_title(loc="left") or None,
        x_axis_label=x_label,
        y_axis_label=y_label,
        x_axis_type="log" if ax.get_xscale() == "log" else "linear",
        y_axis_type="log" if ax.get_yscale() == "log" else "linear",
        x_range=range_of(ax.get_xlim()),
        y_range=range_of(ax.get_ylim()),
        tools="pan,wheel_zoom,box_zoom,reset,save",
        active_scroll="wheel_zoom",
        frame_height=FRAME,
        min_width=300,
    )
    drawn.x_range = shared.setdefault((x_label, *ax.get_xlim()), drawn.x_range)
    for line in ax.get_lines():
        if line.get_transform() == ax.transData:
            _draw(drawn, line)
        elif line.get_transform() == ax.get_xaxis_transform():
            drawn.vspan(x=np.asarray(line.get_xdata())[:1], **_look(line))
        elif line.get_transform() == ax.get_yaxis_transform():
            drawn.hspan(y=np.asarray(line.get_ydata())[:1], **_look(line))
    for text in ax.texts:
        if isinstance(text, Annotation):
            _name(drawn, text)
    tooltips = [("", "$name"), (x_label or "x", "$x{0.0000}"), (y_label or "y", "$y{0.0000}")]
    drawn.add_tools(HoverTool(tooltips=tooltips))
    if drawn.legend:
        drawn.legend.click_policy = "hide"
        drawn.legend.label_text_font_size = "8pt"
        drawn.legend.ncols = 4
        drawn.add_layout(drawn.legend[0], "above")  # within the axes it would cover curves
    _named_ticks(drawn, ax)
    return drawn


def _draw(drawn: Any, line: Line2D) -> None:
    x, y = (np.asarray(line.get_data(orig=False)[k], float) for k in (0, 1))  # names as numbers
    x, y = thinned(x, y)
    look = _look(line)
    if line.get_linestyle() != "None" and len(x) > 1:
        draw = drawn.step if line.get_drawstyle() == "steps-post" else drawn.line
        mode = {"mode": "after"} if line.get_drawstyle() == "steps-post" else {}
        draw(x, y, **mode, **look)
    if line.get_marker() not in ("None", "", None):
        del look["line_dash"], look["line_width"]
        drawn.scatter(x, y, size=7, fill_color=look["line_color"], **look)


def _look(line: Line2D) -> dict[str, Any]:
    name = str(line.get_label())
    named = {"name": ""} if name.startswith("_") else {"name": name, "legend_label": name}
    return {
        "line_color": to_hex(line.get_color()),
        "line_dash": DASHES.get(str(line.get_linestyle()), "solid"),
        "line_width": max(1.2, line.get_linewidth()),
        **named,
    }


def _name(drawn: Any, text: Any) -> None:
    """An Annotation, at a point of the curves or at a part of the height. Another place is left."""
    from bokeh.models.annotations import Label

    coords = text.xycoords
    across, up = (coords, coords) if isinstance(coords, str) else coords
    if across != "data" or up not in ("data", "axes fraction"):
        return
    moved = text.anncoords == "offset points"
    if not moved and text.anncoords != coords:
        return
    x, y = (float(value) for value in text.xy)
    dx, dy = text.xyann if moved else (0.0, 0.0)
    along = [text.get_ha(), text.get_va()]
    if text.get_rotation() == 90:
        along.reverse()
    drawn.add_layout(
        Label(
            x=x,
            y=y if up == "data" else y * FRAME,
            y_units="data" if up == "data" else "screen",
            x_offset=dx,
            y_offset=dy,
            text=text.get_text(),
            angle=math.radians(text.get_rotation()),
            text_align=ALONG[along[0]],
            text_baseline=ACROSS[along[1]],
            text_color=to_hex(text.get_color()),
            text_font_size="8pt",
            background_fill_color=None if text.get_bbox_patch() is None else "white",
        )
    )


def thinned(
    x: NDArray[np.float64], y: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A line with at most MOST_POINTS points: of every interval the least and the greatest value,
    so that no peak is lost."""
    n = len(x)
    if n <= MOST_POINTS:
        return x, y
    edges = np.linspace(0, n, MOST_POINTS // 2 + 1).astype(int)
    kept = {0, n - 1}
    for a, b in pairwise(edges.tolist()):
        kept |= {a + int(np.argmin(y[a:b])), a + int(np.argmax(y[a:b]))}
    rows = np.array(sorted(kept))
    return x[rows], y[rows]


def _named_ticks(drawn: Any, ax: Axes) -> None:
    """Ticks with names, as of leg states and of machines."""
    for axis, shown in ((ax.xaxis, drawn.xaxis), (ax.yaxis, drawn.yaxis)):
        names = [text.get_text() for text in axis.get_ticklabels()]
        if isinstance(axis.get_major_locator(), FixedLocator | StrCategoryLocator) and any(names):
            ticks = [float(tick) for tick in axis.get_ticklocs()]
            shown.ticker = ticks
            shown.major_label_overrides = dict(zip(ticks, names, strict=True))
            shown.major_label_text_font_size = "7pt"
