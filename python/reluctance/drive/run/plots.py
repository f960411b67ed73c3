"""Figures of a run. Each function draws on Axes that it is given and returns them."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reluctance.base.arrays import FloatArray
from reluctance.base.figures import save_figure
from reluctance.base.phases import GREEN, RED, phase_name
from reluctance.base.picture import Picture, styled
from reluctance.base.units import from_si
from reluctance.drive.run.record import Record
from reluctance.plant.solar.single_diode import Diode, current, power_point

SHORT = 0.02  # of a run: a state that is too short for its name
LONG = 5.0  # run that is drawn in seconds [s]
LEG_STATES = "magnetize / freewheel / demagnetize"  # from top to bottom


def _legend_above(ax: Axes, **title: Any) -> None:
    """Outside, at the right: the waveforms fill the axes. Of a title alone, where there is one."""
    ax.legend(
        **({"handles": []} | title if title else {}),
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        ncols=3,
        fontsize=8,
        frameon=False,
        borderaxespad=0.1,
    )


def per_second(result: Record) -> float:
    """Marks of the time axis in a second: milliseconds, of long runs seconds."""
    return 1.0 if result.t[-1] >= LONG else 1e3


def clock(result: Record) -> FloatArray:
    """Times as they are drawn."""
    return np.asarray(result.t * per_second(result))


def time_label(result: Record) -> str:
    return "time (s)" if per_second(result) == 1.0 else "time (ms)"


def mark_events(ax: Axes, result: Record) -> Axes:
    """The states that a supervised drive has entered and the faults that have begun, as lines with
    their names."""
    events = result.events or []
    ends = [*(event.t for event in events[1:]), np.inf][: len(events)]
    for event, end in zip(events, ends, strict=True):
        ax.axvline(event.t * per_second(result), color="0.6", lw=0.7, ls=":", zorder=0)
        if end - event.t < SHORT * result.t[-1]:
            continue  # its name would lie below the next one
        at = (event.t * per_second(result), 0.02)
        ax.annotate(
            event.mode, at, xycoords=("data", "axes fraction"), fontsize=7, rotation=90, color="0.3"
        )
    for t, fault in result.faults:
        ax.axvline(t * per_second(result), color=styled(RED, 1), lw=0.9, zorder=0)
        ax.annotate(
            str(fault),
            (t * per_second(result), 0.5),
            xycoords=("data", "axes fraction"),
            fontsize=7,
            rotation=90,
            va="center",
            ha="right",
            color=styled(RED, 1),
            bbox={"fc": "white", "ec": "none", "pad": 0.5},  # over the curve, and readable
        )
    return ax


def plot_torque(ax: Axes, result: Record) -> Axes:
    """Torque and its reference over time."""
    ax.plot(clock(result), result.tau, lw=0.8, label="torque")
    if np.any(result.tau_ref):
        ax.plot(clock(result), result.tau_ref, "k--", lw=0.8, label="reference")
    ax.set(xlabel=time_label(result), ylabel="torque (N m)")
    _legend_above(ax)
    return ax


def plot_speed(ax: Axes, result: Record) -> Axes:
    """Speed over time, and at the right the flow of a pump."""
    ax.plot(clock(result), from_si(result.omega_m, "rpm"), lw=1.2, label="speed")
    if result.drive.reference.kind == "speed":
        times, speeds = result.drive.reference.course
        asked = from_si(np.interp(result.t, times, speeds), "rpm")
        ax.plot(clock(result), asked, "k--", lw=0.8, label="reference")
        _legend_above(ax)
    if result.drive.load.pump is not None:
        beside = ax.twinx()
        plot_flow(beside, result).set_xlabel("")
    ax.set(xlabel=time_label(result), ylabel="speed (rpm)")
    return ax


def plot_phase_torques(ax: Axes, result: Record) -> Axes:
    """Torque of each phase over time."""
    for k, tau in enumerate(result.tau_ph):
        ax.plot(clock(result), tau, lw=0.8, label=phase_name(k))
    ax.set(xlabel=time_label(result), ylabel="torque of the phases (N m)")
    _legend_above(ax)
    return ax


def plot_currents(ax: Axes, result: Record) -> Axes:
    """Phase currents, and dashed the references of laws that have them."""
    for k, i in enumerate(result.i):
        (line,) = ax.plot(clock(result), i, lw=0.8, label=phase_name(k))
        if np.any(result.i_ref[k]):
            ax.step(
                clock(result), result.i_ref[k], "--", where="post", lw=0.7, color=line.get_color()
            )
    ax.set(xlabel=time_label(result), ylabel="current (A)")
    _legend_above(ax)
    return ax


def plot_legs(ax: Axes, result: Record) -> Axes:
    """Leg states, one band per phase."""
    middles = 3 * np.arange(len(result.leg))[::-1]
    for k, (middle, leg) in enumerate(zip(middles, result.leg, strict=True)):
        ax.step(clock(result), middle + leg, where="post", lw=0.6, label=phase_name(k))
    ax.set_yticks(middles, [phase_name(k) for k in range(len(middles))])
    ax.set_yticks([middle + state for middle in middles for state in (-1, 1)], minor=True)
    ax.set(xlabel=time_label(result), ylabel="leg state")
    _legend_above(ax, title=LEG_STATES, title_fontsize=7)
    return ax


def plot_link(ax: Axes, result: Record) -> Axes:
    """Dc-link voltage over time, and the voltage of the array's maximum power point."""
    best = power_point(_diode(result))
    ax.plot(clock(result), result.u_dc, lw=0.8, label="dc link")
    ax.plot(clock(result), best.u, "k--", lw=0.8, label="maximum power point")
    ax.set(xlabel=time_label(result), ylabel="voltage (V)")
    _legend_above(ax)
    return ax


def plot_power(ax: Axes, result: Record) -> Axes:
    """Power of the array over time, against what it could give; its current follows from the
    voltage, by its curve."""
    diode = _diode(result)
    behind = result.u_dc + result.drive.source.blocking_diode_V
    power = result.u_dc * np.maximum(current(diode, behind), 0.0)
    ax.plot(clock(result), power, lw=0.8, label="from the array")
    ax.plot(clock(result), power_point(diode).p, "k--", lw=0.8, label="available")
    ax.set(xlabel=time_label(result), ylabel="power (W)")
    _legend_above(ax)
    return ax


def plot_flow(ax: Axes, result: Record) -> Axes:
    """Flow of the pump over time."""
    ax.plot(clock(result), from_si(result.Q, "m3ph"), lw=1.0, color=styled(GREEN, 2), label="flow")
    ax.yaxis.label.set_color(styled(GREEN, 2))
    ax.set(xlabel=time_label(result), ylabel="flow (m³/h)")
    return ax


def _diode(result: Record) -> Diode:
    """The array's curve at the instants of the run."""
    source = result.drive.source
    G = np.interp(result.t, source.t_s, source.poa_global_Wpm2 or [])
    return source.diode(G, np.interp(result.t, source.t_s, source.temp_cell_degC or []))


def overview(result: Record, *, last_periods: float = 2.0) -> Figure:
    """Torque and speed of the whole run; currents and legs of its last electrical periods, or of
    those about a trip. Where the speed is held, the torques of the phases take its place; on an
    array dc-link voltage and power are between them.

    Returns
    -------
    Figure
        With its own canvas: no window, no global state.
    """
    on_array = result.drive.source.kind == "pv"
    figure = Picture(11, 11.5 if on_array else 8)
    torque, speed, *more, currents, legs = figure.subplots(3 if on_array else 2, 2).flat
    if on_array:
        plot_link(more[0], result).set_title("whole run", loc="left")
        plot_power(more[1], result).set_title("whole run", loc="left")
    mark_events(plot_torque(torque, result), result).set_title("whole run", loc="left")
    period = 2 * np.pi / result.drive.machine.N_r / max(abs(result.kpis.speed_mean), 1e-9)
    end, t_trip = float(result.t[-1]), result.kpis.t_trip
    if t_trip is not None:
        end = min(end, t_trip + period / 2)
    start = max(end - last_periods * period, 0.0)
    if start == 0:
        end = float(result.t[-1])
    late = [(currents, plot_currents), (legs, plot_legs)]
    if np.ptp(result.omega_m) > 0:
        mark_events(plot_speed(speed, result), result).set_title("whole run", loc="left")
    else:  # a held speed would fill a panel with a constant
        late.append((speed, plot_phase_torques))
    for ax, plot in late:
        shown = "whole run"
        if start > 0:
            where = "last" if end == result.t[-1] else "about the trip:"
            shown = f"{where} {last_periods:g} periods"
        plot(ax, result.since(start)).set_title(shown, loc="left")
        ax.set_xlim(start * per_second(result), end * per_second(result))
        ax.ticklabel_format(axis="x", useOffset=False)
    figure.suptitle(result.drive.name)
    return figure


def save_plot(result: Record, path: str | Path) -> None:
    """Writes the overview; the ending chooses png, svg, pdf or html. The page has zoom over the
    whole run, and the key figures."""
    path = Path(path)
    whole = path.suffix.lower() == ".html"
    drawn = overview(result, last_periods=np.inf if whole else 2.0)
    save_figure(drawn, path, title=result.drive.name, below=result.kpis._repr_html_())
