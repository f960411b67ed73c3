"""Figures of a run. Each function draws on Axes that it is given and returns them."""

import base64
import html
import io
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from reluctance.files import check_ending, write_whole
from reluctance.run.result import Result
from reluctance.units import from_si

ENDINGS = {".png", ".svg", ".html"}
LEG_NAMES = ("demagnetize", "freewheel", "magnetize")


def _legend_above(ax: Axes) -> None:
    """Outside, at the right: the waveforms fill the axes."""
    ax.legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        ncols=3,
        fontsize=8,
        frameon=False,
        borderaxespad=0.1,
    )


def _last(result: Result, start: float) -> Result:
    """The waveforms from `start` [s] on."""
    kept = result.t >= start
    rows = {name: getattr(result, name)[kept] for name in ("t", "tau", "tau_ref")}
    phases = {name: getattr(result, name)[:, kept] for name in ("i", "i_ref", "leg")}
    return replace(result, **rows, **phases)


def plot_torque(ax: Axes, result: Result) -> Axes:
    """Torque and its reference over time."""
    ax.plot(result.t * 1e3, result.tau, lw=0.8, label="torque")
    if np.any(result.tau_ref):
        ax.plot(result.t * 1e3, result.tau_ref, "k--", lw=0.8, label="reference")
    ax.set(xlabel="time (ms)", ylabel="torque (N m)")
    _legend_above(ax)
    return ax


def plot_speed(ax: Axes, result: Result) -> Axes:
    """Speed over time."""
    ax.plot(result.t * 1e3, from_si(result.omega_m, "rpm"), lw=1.2)
    ax.set(xlabel="time (ms)", ylabel="speed (rpm)")
    return ax


def plot_currents(ax: Axes, result: Result) -> Axes:
    """Phase currents, and dashed the references of laws that have them."""
    for k, i in enumerate(result.i):
        (line,) = ax.plot(result.t * 1e3, i, lw=0.8, label=f"phase {'abcdef'[k]}")
        if np.any(result.i_ref[k]):
            ax.step(
                result.t * 1e3, result.i_ref[k], "--", where="post", lw=0.7, color=line.get_color()
            )
    ax.set(xlabel="time (ms)", ylabel="current (A)")
    _legend_above(ax)
    return ax


def plot_legs(ax: Axes, result: Result) -> Axes:
    """Leg states, one band per phase."""
    n_phases = len(result.leg)
    for k, leg in enumerate(result.leg):
        ax.step(result.t * 1e3, 3 * (n_phases - 1 - k) + leg + 1, where="post", lw=0.6)
    heights = [3 * (n_phases - 1 - k) + state for k in range(n_phases) for state in range(3)]
    names = [f"{'abcdef'[k]} {LEG_NAMES[state]}" for k in range(n_phases) for state in range(3)]
    ax.set_yticks(heights, names, fontsize=7)
    ax.set(xlabel="time (ms)", ylabel="leg state")
    return ax


def overview(result: Result, *, last_periods: float = 2.0) -> Figure:
    """Torque and speed of the whole run; currents and legs of its last electrical periods.

    Returns
    -------
    Figure
        With its own canvas: no window, no global state.
    """
    figure = Figure(figsize=(11, 8), layout="constrained")
    FigureCanvasAgg(figure)
    torque, speed, currents, legs = figure.subplots(2, 2).flat
    plot_torque(torque, result).set_title("whole run", loc="left")
    plot_speed(speed, result).set_title("whole run", loc="left")
    period = 2 * np.pi / result.drive.machine.N_r / max(abs(result.kpis.speed_mean), 1e-9)
    start = max(result.t[-1] - last_periods * period, 0.0)
    for ax, plot in ((currents, plot_currents), (legs, plot_legs)):
        plot(ax, _last(result, start)).set_title(f"last {last_periods:g} periods", loc="left")
        ax.set_xlim(start * 1e3, result.t[-1] * 1e3)
    figure.suptitle(result.drive.name)
    return figure


def save_plot(result: Result, path: str | Path) -> None:
    """Writes the overview; the ending chooses png, svg or html (with the key figures)."""
    path = Path(path)
    ending = check_ending(path, ENDINGS)
    figure = overview(result)
    if ending == ".html":
        write_whole(path, lambda p: _write_text(p, page(result, figure)))
    else:
        save_figure(figure, path)


def save_figure(figure: Figure, path: Path) -> None:
    """Writes a png or svg, the same bytes for the same figure."""
    metadata = _metadata(path.suffix.lower())
    with mpl.rc_context({"svg.hashsalt": "reluctance"}):
        write_whole(path, lambda p: figure.savefig(p, dpi=110, metadata=metadata))


def _metadata(ending: str) -> dict[str, str | None]:
    return {"Date": None} if ending == ".svg" else {"Software": None}


def _write_text(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


def embedded(figure: Figure) -> str:
    """The figure as the source of an <img>, so that a page needs no other file."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=110, metadata={"Software": None})
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")


def page(result: Result, figure: Figure) -> str:
    """One self-contained page: key figures and the overview."""
    name = html.escape(result.drive.name)
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{name}</title>'
        "<style>body{font-family:sans-serif;margin:2em;max-width:70em}"
        "td{padding:.1em 1em .1em 0;font-variant-numeric:tabular-nums}img{max-width:100%}</style>"
        f'<h1>{name}</h1><img alt="waveforms" src="{embedded(figure)}">'
        f"{result.kpis._repr_html_()}</html>\n"
    )
