"""The comparison as a figure: ripple against switching frequency, its price in current, torque."""

from __future__ import annotations

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from reluctance.compare.comparison import Comparison

MARKERS = "osD^v<>PX*hd"


def plot_front(ax: Axes, found: Comparison) -> Axes:
    """The rms torque error of each law against its switching frequency."""
    for j, entry in enumerate(found.entries):
        if entry.front:
            f = [p.f_switch / 1e3 for p in entry.front]
            error = [100 * p.torque_error_rms for p in entry.front]
            ax.plot(f, error, marker=_marker(j), color=_color(j), lw=1, ms=5, label=entry.name)
    ax.axvline(found.f_target / 1e3, color="k", lw=0.6, ls=":")
    ax.set(
        xscale="log",
        yscale="log",
        xlabel="switching frequency per switch (kHz)",
        ylabel="rms torque error (%)",
    )
    _plain_ticks(ax.xaxis)
    _plain_ticks(ax.yaxis)
    ax.set_ylim(top=min(ax.get_ylim()[1], 20.0))  # beyond it a law has failed
    return ax


def plot_price(ax: Axes, found: Comparison) -> Axes:
    """The rms torque error of each law against its rms current over the limit's."""
    for j, entry in enumerate(found.entries):
        if entry.kpis is not None:
            ax.plot(
                entry.kpis.i_rms / found.bound.i_rms,
                100 * entry.kpis.torque_error_rms,
                _marker(j),
                color=_color(j),
                mfc=_color(j) if entry.met else "none",
                label=entry.name,
            )
    ax.axvline(1.0, color="k", lw=0.6, ls=":")
    ax.set(yscale="log", xlabel="rms current over the limit's (1)", ylabel="rms torque error (%)")
    _plain_ticks(ax.yaxis)
    return ax


def plot_strokes(ax: Axes, found: Comparison) -> Axes:
    """The torque of each law over one stroke, one above the other."""
    tau_ref = found.bound.tau_ref
    shown = [(j, e) for j, e in enumerate(found.entries) if e.stroke is not None]
    for level, (j, entry) in enumerate(reversed(shown)):
        assert entry.stroke is not None
        theta, tau = entry.stroke
        ax.axhline(level, color="k", lw=0.4)
        ax.plot(np.degrees(theta), level + 10 * (tau / tau_ref - 1), color=_color(j), lw=0.7)
    ax.set_yticks(range(len(shown)), [e.name for _, e in reversed(shown)], fontsize=7)
    ax.set(
        xlabel="electrical angle in the stroke (deg)",
        ylabel="torque error, 10 % a division",
        ylim=(-0.9, len(shown) + 0.4),
    )
    return ax


def figure(found: Comparison) -> Figure:
    """All three, with their own canvas: no window, no global state."""
    made = Figure(figsize=(15, 6), layout="constrained")
    FigureCanvasAgg(made)
    front, price, strokes = made.subplots(1, 3)
    for ax in (plot_front(front, found), plot_price(price, found)):
        ax.grid(which="both", alpha=0.3)
    plot_strokes(strokes, found)
    handles, labels = front.get_legend_handles_labels()
    made.legend(handles, labels, loc="outside lower center", ncols=7, fontsize=8)
    p = found.point
    made.suptitle(
        f"{p.machine.name}: {p.converter.u_dc_V:g} V, {p.load.speed_rpm:g} rpm, "
        f"{found.bound.tau_ref:g} N m, {found.f_target / 1e3:g} kHz per switch"
    )
    return made


def _plain_ticks(axis: Axis) -> None:
    """1, 2, 5, 10, .. instead of powers of ten, which are too few here."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_formatter(NullFormatter())


def _marker(j: int) -> str:
    return MARKERS[j % len(MARKERS)]


def _color(j: int) -> tuple[float, float, float, float]:
    return colormaps["tab20"](0.999 * ((2 * j) % 20 + j // 10) / 20)
