"""A pumping system as one self-contained page."""

import html
from collections.abc import Callable

from matplotlib.axes import Axes
from matplotlib.figure import Figure

import reluctance.pumping.plots as plots
from reluctance.base.figures import embedded
from reluctance.base.html_page import html_page
from reluctance.base.picture import Picture
from reluctance.pumping.figures import remarks, with_units
from reluctance.pumping.operate import Pumped
from reluctance.pumping.text import rows

Plot = Callable[[Axes, Pumped], Axes]


def figures(found: Pumped) -> dict[str, Figure]:
    """All figures by the name of their file."""
    drawn = {
        "losses": _single(plots.plot_losses, found, (10, 4.5)),
        "day": _day(plots.best_day(found)),
        "water": _single(plots.plot_water, found, (10, 3.5)),
        "array": _single(plots.plot_array, found, (8, 5)),
        "pump": _single(plots.plot_heads, found, (8, 5)),
        "threshold": _single(plots.plot_threshold, found, (8, 4)),
        "efficiency": _single(plots.plot_efficiency, found, (8, 5)),
    }
    if found.storage is not None:
        drawn["tank"] = _single(plots.plot_tank, found, (10, 3.5))
    return drawn


def page(found: Pumped, drawn: dict[str, Figure]) -> str:
    """HTML with the figures in it."""
    table = "".join(
        f"<tr><td>{html.escape(label)}</td><td>{html.escape(value)}</td></tr>"
        for label, value in rows(with_units(found))
    )
    notes = "".join(f"<p>Note: {html.escape(text)}.</p>" for text in remarks(found))
    images = "".join(
        f'<h2>{html.escape(key)}</h2><img alt="{html.escape(key)}" src="{embedded(figure)}">'
        for key, figure in drawn.items()
    )
    indented = "td{white-space:pre-wrap}"  # the parts of a figure stand below it
    body = f"<table>{table}</table>{notes}{images}"
    return html_page(found.system.name, body, style=indented)


def _single(plot: Plot, found: Pumped, size: tuple[float, float]) -> Figure:
    figure = Picture(*size)
    plot(figure.subplots(), found).grid(alpha=0.25)
    return figure


def _day(found: Pumped) -> Figure:
    figure = Picture(10, 9)
    chosen = (plots.plot_irradiance, plots.plot_power, plots.plot_speed, plots.plot_flow)
    for ax, plot in zip(figure.subplots(4, sharex=True), chosen, strict=True):
        plot(ax, found).grid(alpha=0.25)
        ax.label_outer()
    figure.suptitle(f"the day with most water: {found.t[0]:%d %B %Y}")
    return figure
