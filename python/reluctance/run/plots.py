"""Figures of a run. Each function draws on Axes that it is given and returns them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from reluctance.figures import save_figure
from reluctance.run.result import Result
from reluctance.units import from_si

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
    rows = {name: getattr(result, name)[kept] for name in ("t", "omega_m", "tau", "tau_ref")}
    phases = {name: getattr(result, name)[:, kept] for name in ("i", "i_ref", "leg", "tau_ph")}
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
    ax.plot(result.t * 1e3, from_si(result.omega_m, "rpm"), lw=1.2, label="speed")
    if result.drive.reference.kind == "speed":
        times, speeds = result.drive.reference.course
        asked = from_si(np.interp(result.t, times, speeds), "rpm")
        ax.plot(result.t * 1e3, asked, "k--", lw=0.8, label="reference")
        _legend_above(ax)
    ax.set(xlabel="time (ms)", ylabel="speed (rpm)")
    return ax


def plot_phase_torques(ax: Axes, result: Result) -> Axes:
    """Torque of each phase over time."""
    for k, tau in enumerate(result.tau_ph):
        ax.plot(result.t * 1e3, tau, lw=0.8, label=f"phase {'abcdef'[k]}")
    ax.set(xlabel="time (ms)", ylabel="torque of the phases (N m)")
    _legend_above(ax)
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
        level = 3 * (n_phases - 1 - k) + leg + 1
        ax.step(result.t * 1e3, level, where="post", lw=0.6, label=f"phase {'abcdef'[k]}")
    heights = [3 * (n_phases - 1 - k) + state for k in range(n_phases) for state in range(3)]
    names = [f"{'abcdef'[k]} {LEG_NAMES[state]}" for k in range(n_phases) for state in range(3)]
    ax.set_yticks(heights, names, fontsize=7)
    ax.set(xlabel="time (ms)", ylabel="leg state")
    return ax


def overview(result: Result, *, last_periods: float = 2.0) -> Figure:
    """Torque and speed of the whole run; currents and legs of its last electrical periods. Where
    the speed is held, the torques of the phases take its place.

    Returns
    -------
    Figure
        With its own canvas: no window, no global state.
    """
    figure = Figure(figsize=(11, 8), layout="constrained")
    FigureCanvasAgg(figure)
    torque, speed, currents, legs = figure.subplots(2, 2).flat
    plot_torque(torque, result).set_title("whole run", loc="left")
    period = 2 * np.pi / result.drive.machine.N_r / max(abs(result.kpis.speed_mean), 1e-9)
    start = max(result.t[-1] - last_periods * period, 0.0)
    late = [(currents, plot_currents), (legs, plot_legs)]
    if np.ptp(result.omega_m) > 0:
        plot_speed(speed, result).set_title("whole run", loc="left")
    else:  # a held speed would fill a panel with a constant
        late.append((speed, plot_phase_torques))
    for ax, plot in late:
        shown = f"last {last_periods:g} periods" if start > 0 else "whole run"
        plot(ax, _last(result, start)).set_title(shown, loc="left")
        ax.set_xlim(start * 1e3, result.t[-1] * 1e3)
    figure.suptitle(result.drive.name, parse_math=False)
    return figure


def save_plot(result: Result, path: str | Path) -> None:
    """Writes the overview; the ending chooses png, svg, pdf or html. The page has zoom over the
    whole run, and the key figures."""
    path = Path(path)
    whole = path.suffix.lower() == ".html"
    drawn = overview(result, last_periods=np.inf if whole else 2.0)
    save_figure(drawn, path, title=result.drive.name, below=result.kpis._repr_html_())
