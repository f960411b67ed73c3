"""Figures of a sweep: lines, heat maps, parallel coordinates, the Pareto front of two figures."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from reluctance.base.errors import ParameterError
from reluctance.base.figures import save_figure
from reluctance.base.picture import Picture
from reluctance.base.units import name_and_unit
from reluctance.explore.sweeps.pareto import front
from reluctance.explore.sweeps.swept import Swept, column_of, figure_name
from reluctance.explore.sweeps.vary import key_of

USUAL = ("torque_ripple_pp", "efficiency", "i_rms_A", "f_switch_Hz")
MOST_LINES = 8  # in one panel; more values of a key are better seen as a heat map
MOST_NAMES = 24  # choices on one axis


def plot(
    points: Swept, figures: str | Sequence[str] | None = None, kind: str | None = None
) -> Figure:
    """See `Sweep.plot`."""
    names = [figures] if isinstance(figures, str) else list(figures or _usual(points))
    names = [figure_name(name) for name in names]
    kind = kind or _suits(points)
    if kind not in KINDS:
        raise ParameterError(f"kind = {kind!r}, need one of {', '.join(KINDS)}")
    if all(np.isnan(points.figures[name]).all() for name in names):
        raise ParameterError(f"no point has {' or '.join(names)}; {points.reason()}".rstrip("; "))
    drawn = Picture(6.4, 4.8)
    KINDS[kind](drawn, points, names)
    return drawn


def save_plot(
    points: Swept, path: Path, figures: Sequence[str] | None = None, kind: str | None = None
) -> None:
    """Writes the figure; the ending chooses png, svg, pdf or html."""
    save_figure(plot(points, figures, kind), path, title=f"{points.name}: sweep")


def label(name: str) -> str:
    """A key or figure as a label of an axis, with its unit."""
    plain, unit = name_and_unit(key_of(name))
    text = WORDS.get(name, plain.replace("_", " "))
    return f"{text} ({UNITS_SHOWN.get(unit, unit)})" if unit else text


WORDS = {
    "tau_mean_Nm": "mean torque",
    "torque_ripple_pp": "torque ripple, peak to peak over mean (1)",
    "torque_ripple_rms": "torque ripple, rms over mean (1)",
    "torque_error_rms": "torque error, rms over reference (1)",
    "efficiency": "efficiency (1)",
    "i_rms_A": "rms phase current",
    "i_peak_A": "peak phase current",
    "p_cu_W": "copper loss",
    "f_switch_Hz": "switching frequency",
    "control.theta_on_deg": "turn-on angle, electrical",
    "control.theta_off_deg": "turn-off angle, electrical",
    "converter.u_dc_V": "dc-link voltage",
}
UNITS_SHOWN = {"Nm": "N m", "us": "µs", "deg": "°", "ohm": "Ω", "kgm2": "kg m²", "degC": "°C"}


def _usual(points: Swept) -> list[str]:
    there = [name for name in USUAL if not np.isnan(points.figures[name]).all()]
    return there[:4] or [USUAL[0]]


def _suits(points: Swept) -> str:
    varied = [name for name, column in points.values.items() if len(set(map(str, column))) > 1]
    if not points.grid or len(varied) > 2:
        return "parallel" if len(varied) > 1 else "lines"
    few = len(varied) < 2 or min(len(set(map(str, points.values[v]))) for v in varied) <= MOST_LINES
    return "lines" if few else "heat"


def _panels(drawn: Picture, count: int) -> list[Axes]:
    columns = 1 if count == 1 or drawn.one_column else 2
    rows = -(-count // columns)
    drawn.propose(5.2 * columns + 1, 3.4 * rows + 0.6)
    axes: list[Axes] = list(drawn.subplots(rows, columns, squeeze=False).flat)
    for ax in axes[count:]:
        ax.remove()
    return axes[:count]


def _lines(drawn: Picture, points: Swept, names: list[str]) -> None:
    """Each figure over the key with most values; a line for each combination of the others."""
    varied = [v for v, column in points.values.items() if len(set(map(str, column))) > 1]
    varied = varied or list(points.values)[:1]
    x_name = max(varied, key=lambda v: len(set(map(str, points.values[v]))))
    others = [v for v in varied if v != x_name]
    groups: dict[tuple[Any, ...], list[int]] = {}
    for n in range(len(points)):
        groups.setdefault(tuple(points.values[v][n] for v in others), []).append(n)
    for ax, name in zip(_panels(drawn, len(names)), names, strict=True):
        for group, rows in groups.items():
            x, y = column_of([points.values[x_name][n] for n in rows]), points.figures[name][rows]
            order = np.argsort(x, kind="stable") if x.dtype.kind == "f" else np.arange(len(x))
            text = ", ".join(_named(o, v) for o, v in zip(others, group, strict=True))
            ax.plot(x[order], y[order], ".-", lw=1.2, label=text or None)
        ax.set(xlabel=label(x_name), ylabel=label(name))
        ax.grid(alpha=0.25)
        if others and len(groups) <= MOST_NAMES:
            ax.legend(fontsize=7, ncols=1 + len(groups) // 9)


def _heat(drawn: Picture, points: Swept, names: list[str]) -> None:
    """Each figure over two keys of a grid."""
    varied = [v for v, n in zip(points.values, points.grid, strict=False) if n > 1]
    if len(varied) != 2 or not points.grid:
        raise ParameterError(
            "a heat map needs a grid over two keys; take kind = 'parallel' for others"
        )
    y_name, x_name = varied
    shape = tuple(n for n in points.grid if n > 1)
    x, y = (column_of(_unique(points.values[v])) for v in (x_name, y_name))
    for ax, name in zip(_panels(drawn, len(names)), names, strict=True):
        z = np.ma.masked_invalid(points.figures[name].reshape(shape))
        places = [p if p.dtype.kind == "f" else np.arange(len(p), dtype=float) for p in (x, y)]
        mesh = ax.pcolormesh(*places, z, shading="nearest")
        ax.set_facecolor("0.9")
        drawn.colorbar(mesh, ax=ax, label=label(name))
        ax.set(xlabel=label(x_name), ylabel=label(y_name))
        if x.dtype.kind != "f":
            ax.set_xticks(places[0], x, rotation=30, ha="right", fontsize=7)
        if y.dtype.kind != "f":
            ax.set_yticks(places[1], y, fontsize=7)
    if points.failed:
        drawn.supxlabel("grey: no figure", fontsize=8, color="0.4")


def _parallel(drawn: Picture, points: Swept, names: list[str]) -> None:
    """A line for each point through all keys and figures, coloured by the first figure."""
    varied = [v for v, column in points.values.items() if len(set(map(str, column))) > 1]
    columns = {v: column_of(points.values[v]) for v in varied or points.values}
    columns |= {name: points.figures[name] for name in names}
    drawn.propose(max(7.0, 1.7 * len(columns)), 4.6)
    crowded = drawn.get_size_inches()[0] < len(columns)  # an inch each for the heads [in]
    if crowded:
        drawn.set_size_inches(drawn.get_size_inches()[0], 4.6)
    ax = drawn.subplots()
    scaled, ticks = [], []
    for values in columns.values():
        if values.dtype.kind == "f":
            low, high = np.nanmin(values), np.nanmax(values)
            scaled.append((values - low) / ((high - low) or 1.0))
            ticks.append([f"{low + part * (high - low):.4g}" for part in (0, 0.5, 1)])
        else:
            choices = _unique(values.tolist())
            place = {choice: j / max(len(choices) - 1, 1) for j, choice in enumerate(choices)}
            scaled.append(np.array([place[v] for v in values.tolist()]))
            ticks.append(choices if len(choices) <= MOST_NAMES else [])
    rows = np.array(scaled)  # (n_columns, n_points)
    colour = scaled[-len(names)]
    whole = ~np.isnan(rows).any(axis=0)
    order = np.flatnonzero(whole)[np.argsort(-colour[whole])]  # the least on top
    x = np.arange(len(rows))
    lines = LineCollection(
        [np.column_stack([x, rows[:, n]]) for n in order],
        colors=mpl.colormaps[mpl.rcParams["image.cmap"]](colour[order]),
        lw=0.8,
        alpha=max(0.15, min(0.9, 60 / max(len(order), 1))),
    )
    ax.add_collection(lines)
    for j, (column, texts) in enumerate(zip(columns, ticks, strict=True)):
        ax.axvline(j, color="0.3", lw=0.8)
        ends = np.linspace(0, 1, len(texts)) if len(texts) > 1 else np.zeros(len(texts))
        for height, text in zip(ends.tolist(), texts, strict=True):
            ax.annotate(
                text,
                (j, height),
                xytext=(3, 0),
                textcoords="offset points",
                fontsize=7,
                va="center",
                bbox={"boxstyle": "round,pad=0.1", "fc": "white", "ec": "none", "alpha": 0.7},
            )
        bold = "bold" if column == names[0] else "normal"
        text = textwrap.fill(label(column), 20)
        turned = 90 if crowded else 0
        ax.text(
            *(j, 1.06, text), ha="center", va="bottom", fontsize=8, fontweight=bold, rotation=turned
        )
    ax.set(xlim=(-0.3, len(rows) - 0.4), ylim=(-0.05, 1.05), xticks=[], yticks=[])
    ax.set_frame_on(False)
    drawn.supxlabel(f"a line is a point; colour: {label(names[0])}, dark is low", fontsize=8)


def _pareto(drawn: Picture, points: Swept, names: list[str]) -> None:
    """Two figures against each other, and the points that no other beats in both."""
    if len(names) != 2:
        raise ParameterError(f"a Pareto front needs two figures, not {', '.join(names)}")
    x, y = (points.figures[name] for name in names)
    drawn.propose(6.5, 4.6)
    ax = drawn.subplots()
    ax.plot(x, y, ".", color="0.7", ms=4, label="points")
    kept = front(x, y, most=[name in MOST for name in names])
    ax.plot(x[kept], y[kept], "o-", ms=4, lw=1.2, label="Pareto front")
    ax.set(xlabel=label(names[0]), ylabel=label(names[1]))
    ax.grid(alpha=0.25)
    ax.legend(fontsize=8)


MOST = {"efficiency", "tau_mean_Nm", "p_mech_W", "speed_mean_rpm"}  # figures better when greater
KINDS: dict[str, Callable[[Picture, Swept, list[str]], None]] = {
    "lines": _lines,
    "heat": _heat,
    "parallel": _parallel,
    "pareto": _pareto,
}


def _unique(values: Sequence[Any]) -> list[Any]:
    """Each value once, in the order of its first place."""
    return list(dict.fromkeys(values))


def _named(name: str, value: Any) -> str:
    """A key and its value, as in `i band 0.5 A`."""
    plain, unit = name_and_unit(key_of(name))
    shown = f"{value:.4g}" if isinstance(value, int | float) else str(value)
    return (
        f"{plain.replace('_', ' ')} {shown} {UNITS_SHOWN.get(unit, unit) if unit else ''}".strip()
    )
