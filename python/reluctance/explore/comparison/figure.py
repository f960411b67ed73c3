"""The comparison as a figure: ripple against switching frequency, its price in current, torque."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from reluctance.base.key_figures import definite
from reluctance.base.picture import Picture, styled
from reluctance.drive.laws import table_of
from reluctance.drive.tables.variants import Look
from reluctance.explore.comparison.comparison import Comparison
from reluctance.explore.comparison.contenders import CONTENDERS, contender
from reluctance.explore.comparison.contest import Entry

GREATEST_ERROR = 20.0  # that is drawn: beyond it a law has failed [%]
TRACES = 4  # torques shown
COLUMN_PANEL, COLUMN_TRACE = 3.4, 1.2  # heights in one column of a journal [in]
MARKERS = "osDv^P*X"  # of the variants of a law


Label = tuple[float, float, Entry]  # where it belongs, and whose it is


def plot_front(ax: Axes, found: Comparison) -> Axes:
    """The rms torque error of each law against its switching frequency, and the lower bound."""
    ends: list[Label] = []
    for entry in _drawn(found):
        f = np.array([p.f_switch / 1e3 for p in entry.front])
        error = np.array([100 * p.torque_error_rms for p in entry.front])
        kept = error <= GREATEST_ERROR
        if kept.any():
            look = style(entry.name, best=entry is _best(found))
            ax.plot(f[kept], error[kept], label=entry.name, **look)
            ends.append((f[kept][-1], error[kept][-1], entry))
    f_target = found.f_target / 1e3
    ax.axvline(f_target, color="k", lw=0.8, ls=":")
    ax.set(
        title="Ripple against switching (solid: predictive laws)",
        xscale="log",
        yscale="log",
        xlabel="switching frequency per switch (kHz)",
        ylabel="rms torque error (%)",
    )
    left, right = ax.get_xlim()
    f = np.array([left, right])
    bound = _bound(found) * f_target / f
    ax.set_ylim(bottom=0.7 * bound[-1])
    ax.fill_between(f, bound, 1e-6, color="k", alpha=0.12, lw=0)
    beside_axis = ax.get_yaxis_transform()
    below = "below the lower bound" + ("" if _narrow(ax) else " of `reluctance limit`")
    ax.text(0.02, bound[-1], below, fontsize=8, transform=beside_axis)
    ax.set_xlim(left, right)
    _plain_ticks(ax.xaxis)
    _plain_ticks(ax.yaxis)
    _label(ax, found, ends)
    return ax


def plot_price(ax: Axes, found: Comparison) -> Axes:
    """The rms torque error of each law against its rms current over the limit's."""
    points: list[Label] = []
    for entry in _drawn(found):
        assert entry.kpis is not None
        at = entry.kpis.i_rms / found.bound.i_rms, 100 * definite(entry.kpis.torque_error_rms)
        look = style(entry.name, best=entry is _best(found)) | {"ls": ""}
        ax.plot(*at, label=entry.name, **look, mfc=look["color"] if entry.met else "none")
        points.append((*at, entry))
    ax.axvline(1.0, color="k", lw=0.8, ls=":")
    ax.axhspan(1e-6, _bound(found), color="k", alpha=0.12, lw=0)
    ax.set(
        title=f"Its price, at {found.f_target / 1e3:g} kHz (hollow: at another frequency)",
        yscale="log",
        xlabel="rms current over that of the limit (1)",
        ylabel="rms torque error (%)",
    )
    ax.set_ylim(0.8 * _bound(found), 1.2 * max((y for _, y, _ in points), default=GREATEST_ERROR))
    _plain_ticks(ax.yaxis)
    _label(ax, found, points)
    return ax


def plot_torque(axes: Iterable[Axes], found: Comparison) -> None:
    """The torque error over an electrical period of the best of each kind, smoothest first."""
    for ax, entry in zip(axes, _shown(found), strict=False):
        assert entry.torque is not None
        theta, tau = entry.torque
        error = 100 * (tau / found.bound.tau_ref - 1)
        ax.plot(
            np.degrees(theta), error, color=styled(_look(entry).color), lw=0.7, label=entry.name
        )
        ax.axhline(0, color="k", lw=0.5)
        ax.set_xlim(0, 360)
        ax.set_xticks(range(0, 361, 60))
        name = contender(entry.name).label
        ax.set_title(f"{name}: torque error (%)", loc="left", fontsize=9, pad=3)


def figure(found: Comparison) -> Figure:
    """All three, with their own canvas: no window, no global state."""
    made = Picture(13, 10.5)
    p = found.point
    title = (
        f"{p.machine.name}: {p.converter.u_dc_V:g} V, {p.load.speed_rpm:g} rpm, "
        f"{found.bound.tau_ref:g} N m, {found.f_target / 1e3:g} kHz per switch"
    )
    if left_out := [contender(e.name).label for e in found.entries if not _works(e)]:
        title += (
            f"\nnot drawn, not possible or error above {GREATEST_ERROR:g} %: {', '.join(left_out)}"
        )
    made.suptitle(title)
    n = len(_shown(found))
    if made.one_column:
        made.set_size_inches(made.get_size_inches()[0], 2 * COLUMN_PANEL + n * COLUMN_TRACE)
        ratios = [COLUMN_PANEL] * 2 + [COLUMN_TRACE] * n
        front, price, *traces = made.subplots(2 + n, 1, height_ratios=ratios)
    else:
        halves = made.subfigures(2, 1, squeeze=False, height_ratios=(11, 2 * n + 0.01))[:, 0]
        front, price = halves[0].subplots(1, 2)
        traces = halves[1].subplots(n, 1, squeeze=False)[:, 0] if n else []
    for ax in (plot_front(front, found), plot_price(price, found)):
        ax.grid(which="both", alpha=0.25)
    if n:
        for ax in traces[1:]:
            ax.sharex(traces[0])
            ax.sharey(traces[0])
        for ax in traces[:-1]:
            ax.tick_params(labelbottom=False)
        plot_torque(traces, found)
        traces[-1].set_xlabel("electrical angle (deg)")
    return made


def _drawn(found: Comparison) -> list[Entry]:
    """The laws that work."""
    return [entry for entry in found.entries if _works(entry)]


def _works(entry: Entry) -> bool:
    return entry.kpis is not None and 100 * definite(entry.kpis.torque_error_rms) <= GREATEST_ERROR


def _shown(found: Comparison) -> list[Entry]:
    """The best of each kind, smoothest first."""
    best: dict[str, Entry] = {}
    for entry in sorted(_drawn(found), key=_error):
        best.setdefault(_look(entry).kind, entry)
    return list(best.values())[:TRACES]


def _error(entry: Entry) -> float:
    assert entry.kpis is not None
    return definite(entry.kpis.torque_error_rms)


def _bound(found: Comparison) -> float:
    """The lower bound of the rms error at the target [%]."""
    return 100 * found.floor.bound_rms / found.bound.tau_ref


def _look(entry: Entry) -> Look:
    return table_of(contender(entry.name).law).look


def style(name: str, *, best: bool = False) -> dict[str, Any]:
    """How a contender's line is drawn: colour and line by its law, the marker by the variant."""
    law = contender(name).law
    variants = [other for other, c in CONTENDERS.items() if c.law == law]
    variant = variants.index(name) if name in variants else 0
    look = table_of(law).look
    return {
        "color": styled(look.color),
        "ls": look.line,
        "marker": MARKERS[variant % len(MARKERS)],
        "lw": 3.0 if best else 1.2,
        "ms": 9 if best else 6,
        "zorder": 3 if best else 2,
    }


def _best(found: Comparison) -> Entry | None:
    """The smoothest law at the target."""
    return min((e for e in _drawn(found) if e.met), key=_error, default=None)


def _label(ax: Axes, found: Comparison, ends: list[Label]) -> None:
    """Names right of the axes, each level with its point or as near as the others let it."""
    if not ends:
        return
    size, gap = (7, 0.055) if _narrow(ax) else (9, 0.04)  # [pt]; of the axes' height
    ends = sorted(ends, key=lambda end: end[1])
    points = [(x, y) for x, y, _ in ends]
    level = ax.transAxes.inverted().transform(ax.transData.transform(points))[:, 1]
    rank = gap * np.arange(len(level))
    pushed_up = np.maximum.accumulate(level - rank)
    pushed_down = np.minimum.accumulate((level - rank)[::-1])[::-1]
    heights = np.clip((pushed_up + pushed_down) / 2, 0, 1 - rank[-1]) + rank
    for (x, y, entry), height in zip(ends, heights, strict=True):
        color = styled(_look(entry).color)
        ax.annotate(
            contender(entry.name).label,
            (x, y),
            (1.04, height),
            textcoords="axes fraction",
            va="center",
            fontsize=size,
            fontweight="bold" if entry is _best(found) else "normal",
            color=color,
            arrowprops={"arrowstyle": "-", "color": color, "lw": 0.5, "relpos": (0, 0.5)},
        ).set_in_layout(
            False
        )  # its line ends outside where the limits of the axes are not yet final
        room = ax.text(1.04, 0.5, contender(entry.name).label, fontsize=size, fontweight="bold")
        room.set(transform=ax.transAxes, alpha=0)


def _narrow(ax: Axes) -> bool:
    """Whether the figure is one column of panels."""
    return isinstance(ax.figure, Picture) and ax.figure.one_column


def _plain_ticks(axis: Axis) -> None:
    """1, 2, 5, 10, .. instead of powers of ten, which are too few here."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_formatter(NullFormatter())
