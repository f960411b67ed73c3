"""The figures of the report: the paper's Fig. 7 and Fig. 8 and what it does not show."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import reluctance.paper.printed as printed
from reluctance.base import picture
from reluctance.base.key_figures import definite
from reluctance.base.units import from_si
from reluctance.drive.run import plots
from reluctance.paper.points import Runs, le_huy
from reluctance.paper.response import LEVEL
from reluctance.paper.study import Study
from reluctance.paper.sweeps import Response

MODEL, PAPER = "C0", "C3"


@dataclass(frozen=True)
class Picture:
    """One figure file, with the caption that the report gives it."""

    name: str  # of the file, without its ending
    title: str
    caption: str
    draw: Callable[[Study], Figure]


def blank(rows: int, columns: int, *, size: tuple[float, float]) -> tuple[Figure, list[list[Axes]]]:
    """A figure with its own canvas and its axes, row by row."""
    figure = picture.Picture(*size)
    axes = figure.subplots(rows, columns, squeeze=False)
    for ax in axes.flat:
        ax.grid(alpha=0.3)
    return figure, [list(row) for row in axes]


def torque(found: Study) -> Figure:
    """Torque after a step of its reference, whole and zoomed."""
    figure, axes = blank(2, 2, size=(11, 7))
    for (whole, zoom), r in zip(axes, (found.rated_response, found.half_response), strict=True):
        ms, tau, level = r.start.t * 1e3, r.start.tau, LEVEL * r.point.tau_ref
        reached = r.reached[r.own].min() * 1e3
        for ax in (whole, zoom):
            ax.plot(ms, tau, color=MODEL, lw=0.9, label="torque")
            ax.axhline(r.point.tau_ref, color="k", ls="--", lw=0.8, label="reference")
            ax.set(xlabel="time (ms)", ylabel="torque (N m)", ylim=(0, 1.15 * r.point.tau_ref))
        zoom.axhline(level, color="gray", ls=":", lw=0.9, label="95 % of the reference")
        zoom.plot(reached, level, "o", color=MODEL, label=f"reached at {reached:.2f} ms")
        zoom.axvline(
            r.point.response * 1e3,
            color=PAPER,
            lw=0.9,
            label=f"the paper: {r.point.response * 1e3:g} ms",
        )
        whole.set(xlim=(0, 40), title=f"{r.point.tau_ref} N m at {r.point.speed_rpm:g} rpm")
        zoom.set(xlim=(0, 2), title=f"its first 2 ms, from {r.theta_start_deg:g} deg")
        whole.legend(loc="lower right")
        zoom.legend(loc="lower right")
    return figure


def speed(found: Study) -> Figure:
    """Speed from standstill, and its ripple at the end."""
    figure, axes = blank(2, 2, size=(11, 6.5))
    for column, runs in enumerate((found.rated, found.half)):
        whole, end = axes[0][column], axes[1][column]
        t, rpm = runs.pump.t, from_si(runs.pump.omega_m, "rpm")
        target = runs.point.speed_rpm
        for ax in (whole, end):
            ax.plot(t, rpm, color=MODEL, lw=1.2, label="speed")
            ax.axhline(target, color="k", ls="--", lw=0.8, label="reference")
            ax.set(xlabel="time (s)", ylabel="speed (rpm)")
        whole.set(
            xlim=(0, runs.pump.drive.simulation.until_s),
            ylim=(0, None),
            title=f"from standstill to {target:g} rpm",
        )
        swing = max(np.ptp(rpm[t > t[-1] - 0.05]), 0.01)
        end.set(
            xlim=(t[-1] - 0.05, t[-1]),
            ylim=(target - 1.5 * swing, target + 1.5 * swing),
            title="its last 50 ms",
        )
        end.ticklabel_format(useOffset=False)
        whole.legend(loc="lower right")
    return figure


def phases(found: Study) -> Figure:
    """Torque, phase currents with their references, and leg states over two electrical periods."""
    figure, axes = blank(3, 2, size=(13, 10))
    for column, runs in enumerate((found.rated, found.half)):
        result = runs.locked
        period = 2 * np.pi / result.drive.machine.N_r / result.drive.omega_nominal
        for row, plot in enumerate((plots.plot_torque, plots.plot_currents, plots.plot_legs)):
            ax = plot(axes[row][column], result)
            ax.set_xlim((result.t[-1] - 2 * period) * 1e3, result.t[-1] * 1e3)
        axes[0][column].set_ylim(0, 1.15 * runs.point.tau_ref)
        axes[0][column].set_title(_where(runs), loc="left", pad=21)  # above the legend
        axes[1][column].set_ylim(0, 1.3 * result.kpis.i_peak)
    return figure


def regulator(found: Study) -> Figure:
    """The largest current, its reference and all leg states over the last half millisecond."""
    figure, axes = blank(2, 2, size=(13, 7.5))
    for column, runs in enumerate((found.rated, found.half)):
        result = runs.locked
        for row, plot in enumerate((plots.plot_currents, plots.plot_legs)):
            ax = plot(axes[row][column], result)
            ax.set_xlim((result.t[-1] - 0.5e-3) * 1e3, result.t[-1] * 1e3)
        window = result.i[:, result.t > result.t[-1] - 0.5e-3]
        largest = window[window[:, -1].argmax()]
        axes[0][column].set_ylim(largest.min() - 3, largest.max() + 5)
        axes[0][column].set_title(_where(runs), loc="left", pad=21)  # above the legend
    return figure


def settings(found: Study) -> Figure:
    """What N_p, N_c and r_w do to ripple, error, current, switching frequency."""
    labels = {
        "N_p": "prediction horizon $N_p$ (samples)",
        "N_c": "control horizon $N_c$ (samples), $N_p$ = 4",
        "r_w": "weight $r_w$ (N² m²/A²)",
    }
    figure, axes = blank(4, 3, size=(12, 10))
    for column, (name, label) in enumerate(labels.items()):
        row = [s for s in found.settings if s.name == name]
        x = [s.value for s in row]
        quantities = (
            (
                "torque ripple\npeak to peak (%)",
                [definite(s.kpis.torque_ripple_pp) * 100 for s in row],
            ),
            ("torque error\nrms (%)", [definite(s.kpis.torque_error_rms) * 100 for s in row]),
            ("phase current\nrms (A)", [s.kpis.i_rms for s in row]),
            (
                "switching frequency\nper switch (kHz)",
                [s.kpis.f_switch / 1e3 for s in row],
            ),
        )
        for line, (ylabel, y) in enumerate(quantities):
            ax = axes[line][column]
            ax.plot(x, y, "o-", color=MODEL)
            ax.axvline(getattr(printed, name.upper()), color=PAPER, ls="--", lw=0.9)
            ax.set(ylabel=ylabel, ylim=(0, 1.15 * max(y)))
            if name == "r_w":
                ax.set_xscale("log")
            else:
                ax.set_xticks([int(value) for value in x])
        axes[-1][column].set_xlabel(label)
    axes[0][0].plot([], [], color=PAPER, ls="--", lw=0.9, label="the paper's setting")
    axes[0][0].legend(loc="lower right")
    return figure


def response(found: Study) -> Figure:
    """Response time over dc-link voltage and over rotor angle."""
    figure, axes = blank(2, 2, size=(12, 8.5))
    for row, r in zip(axes, (found.rated_response, found.half_response), strict=True):
        over_voltage(row[0], r)
        over_angle(row[1], r)
        row[0].set_title(f"{r.point.tau_ref} N m at {r.point.speed_rpm:g} rpm")
        row[1].set_title(f"the same, {r.u_dc[r.own]:g} V")
    return figure


def over_voltage(ax: Axes, r: Response) -> Axes:
    """Best and worst rotor angle: bound and controller."""
    ax.fill_between(
        r.u_dc,
        r.bound.min(axis=1) * 1e3,
        r.bound.max(axis=1) * 1e3,
        color="gray",
        alpha=0.25,
        label="physical bound, best to worst angle",
    )
    ax.plot(r.u_dc, r.reached.min(axis=1) * 1e3, "o-", color=MODEL, label="controller, best angle")
    ax.plot(r.u_dc, _worst(r) * 1e3, "o--", color=MODEL, label="controller, worst angle")
    ax.axhline(
        r.point.response * 1e3,
        color=PAPER,
        lw=0.9,
        label=f"the paper: {r.point.response * 1e3:g} ms",
    )
    ax.plot(
        r.u_least, r.point.response * 1e3, "k*", ms=10, label=f"possible from {r.u_least:.0f} V"
    )
    ax.set(xlabel="dc-link voltage (V)", ylabel="response time (ms)", xscale="log", yscale="log")
    ax.set_xticks(volts := [150, 200, 300, 400, 600, 800], [f"{u}" for u in volts])
    ax.set_xticks([], minor=True)
    ticks = [0.1, 0.2, 0.5, 1, 2, 4]
    ax.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    ax.set_yticks([], minor=True)
    ax.legend(loc="upper right", fontsize=8)
    return ax


def over_angle(ax: Axes, r: Response) -> Axes:
    """At the drive's own voltage."""
    ax.plot(r.theta_deg, r.bound[r.own] * 1e3, color="gray", lw=2, label="physical bound")
    ax.plot(r.theta_deg, r.reached[r.own] * 1e3, "o-", ms=3, color=MODEL, label="controller")
    ax.axhline(r.point.response * 1e3, color=PAPER, lw=0.9, label="the paper")
    ax.set(
        xlabel="rotor angle at the start (deg, mechanical, 0: phase a unaligned)",
        ylabel="response time (ms)",
        xlim=(0, 30),
        ylim=(0, None),
    )
    ax.legend(loc="upper left", fontsize=8)
    return ax


def model(found: Study) -> Figure:
    """Position function and torque of one phase, as printed and mended."""
    figure, ((shape, torque_ax),) = blank(1, 2, size=(11, 4.2))
    machine = found.rated.locked.drive.machine
    m = le_huy(machine)
    theta = np.linspace(0, np.pi / 2, 361)
    deg = np.degrees(theta)
    x = np.minimum(theta, np.pi / 2 - theta) / np.pi
    shape.plot(deg, [printed.position(a) for a in theta], color=PAPER, label="as printed")
    shape.plot(deg, 128 * x**3 - 48 * x**2 + 1, color=MODEL, label="mended")
    shape.set(xlabel="rotor angle from alignment (deg)", ylabel="position function f (1)")
    shape.legend()
    half = theta[theta <= np.pi / 4]
    for i, style in ((20.0, ":"), (50.0, "-"), (90.0, "--")):
        as_printed = [printed.torque(i, a, L_sat=m.L_sat, A=m.A, B=m.B) for a in half]
        mended = machine.tau(i, np.pi - machine.N_r * half)
        torque_ax.plot(np.degrees(half), as_printed, style, color=PAPER, label=f"printed, {i:g} A")
        torque_ax.plot(np.degrees(half), mended, style, color=MODEL, label=f"mended, {i:g} A")
    torque_ax.set(xlabel="rotor angle from alignment (deg)", ylabel="torque of one phase (N m)")
    torque_ax.legend(fontsize=8)
    return figure


def limits(found: Study) -> Figure:
    """The controller's phase current beside the physical limit's, over one electrical period."""
    figure, (row,) = blank(1, 2, size=(11, 4.2))
    for ax, runs in zip(row, (found.rated, found.half), strict=True):
        result, n = runs.locked, runs.locked.t.size
        last = slice(n - n // 4, n)
        theta_e = np.degrees(result.drive.machine.N_r * result.theta_m[last] % (2 * np.pi))
        ax.plot(theta_e, result.i[0][last], ".", ms=1, color=MODEL)
        ax.plot([], [], color=MODEL, label="phase a, simulated")
        ax.plot(np.degrees(runs.best.theta_e), runs.best.i, "k", lw=1, label="minimum copper loss")
        ax.set(
            xlabel="electrical angle (deg, 0 unaligned, 180 aligned)",
            ylabel="phase current (A)",
            title=_where(runs),
            xlim=(0, 360),
        )
        ax.legend()
    return figure


def _where(runs: Runs) -> str:
    return f"{runs.point.tau_ref} N m at {runs.point.speed_rpm:g} rpm, 240 V"


def _worst(r: Response) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Slowest response over the angles; a gap where some angle is not reached in time."""
    worst = r.reached.max(axis=1)
    return np.where(np.isinf(worst), np.nan, worst)


PICTURES = (
    Picture(
        "fig7_torque",
        "Torque after a step (the paper's Fig. 7)",
        "Torque from zero current at held speed, 240 V, from the rotor angle at which the "
        "controller is fastest. Right: the transient. The paper's response time needs more "
        "voltage than 240 V.",
        torque,
    ),
    Picture(
        "fig8_speed",
        "Speed from standstill (the paper's Fig. 8)",
        "Speed loop closed, pump on the shaft, torque reference at most 45 N m. Below: the last "
        "50 ms, magnified.",
        speed,
    ),
    Picture(
        "phases",
        "Torque, phase currents and leg states",
        "The last two electrical periods in steady state, speed held. Each phase is magnetized "
        "before its poles overlap and demagnetized before they part.",
        phases,
    ),
    Picture(
        "regulator",
        "Current references and the regulator, magnified",
        "The last half millisecond of the figure above. Solid: the current of the phase that "
        "carries most; dashed: the reference that the predictive controller sets every 20 us and "
        "the hysteresis regulator follows within 1 A.",
        regulator,
    ),
    Picture(
        "limit",
        "Phase current beside the physical limit",
        "Black: the ripple-free current of minimum copper loss at 240 V. No controller "
        "can hold this torque without ripple and heat the windings less.",
        limits,
    ),
    Picture(
        "settings",
        "Influence of the horizons and the weight",
        "Rated torque, 1500 rpm, 240 V, 20 us. One setting is varied, the others are the paper's.",
        settings,
    ),
    Picture(
        "response",
        "Response time over dc-link voltage and rotor angle",
        "From zero current to 95 % of the reference, speed held. The bound gives every phase that "
        "helps full voltage from the start; no controller can be below it. The controller follows "
        "currents of minimum copper loss: where only one phase can help it is on the bound, where "
        "a second could it is slower.",
        response,
    ),
    Picture(
        "model",
        "The machine model as printed and mended",
        "Left: the sign of one term of f. Right: the place of one bracket in the torque equation; "
        "by symmetry the torque at alignment (0 deg) and unaligned (45 deg) must be zero.",
        model,
    ),
)
