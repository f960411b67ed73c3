"""A limit as files: the profile and the envelope as tables, both as one figure."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reluctance.base import figures
from reluctance.base.arrays import FloatArray
from reluctance.base.phases import COLOURS, LETTERS, phase_name
from reluctance.base.picture import Picture, styled
from reluctance.base.table_file import write_table
from reluctance.base.units import from_si
from reluctance.explore.limits.report import Limit
from reluctance.machine.optimum.envelope import Envelope


def save_profile(limit: Limit, path: str | Path) -> None:
    """Writes one electrical period of one phase; the ending chooses csv, npz, parquet or mat. Where
    the profiles of the phases differ, all of them, each over its own angle: i_a_A, i_b_A, ..."""
    best = limit.least_copper
    table = {"theta_e_deg": np.degrees(best.theta_e)}
    quantities = {"i": best.i, "psi": best.psi, "u": best.u, "tau_ph": _phase_torque(limit)}
    units = {"i": "A", "psi": "Wb", "u": "V", "tau_ph": "Nm"}
    for name, values in quantities.items():
        for k, row in enumerate(np.atleast_2d(values)):
            of = f"{name}_{LETTERS[k]}" if values.ndim > 1 else name
            table[f"{of}_{units[name]}"] = row
    _save(path, table)


def save_envelope(envelope: Envelope, path: str | Path) -> None:
    """Writes the greatest ripple-free torque over speed; endings as for `save_profile`."""
    table = {
        "speed_rpm": from_si(envelope.omega_m, "rpm"),
        "tau_max_Nm": envelope.tau_max,
        "i_rms_A": envelope.i_rms,
        "i_peak_A": envelope.i_peak,
        "p_cu_W": envelope.p_cu,
    }
    _save(path, table)


def plot_currents(ax: Axes, limit: Limit) -> Axes:
    """Current of every phase over the angle of the first."""
    _plot_phases(ax, limit, limit.least_copper.i)
    best, i_max = limit.least_copper, limit.drive.machine.i_max_A
    ax.set(
        title=f"{best.i_rms:.4g} A rms, {best.i_peak:.4g} A peak of {i_max:g} A allowed",
        ylabel="current (A)",
    )
    return ax


def plot_torque(ax: Axes, limit: Limit) -> Axes:
    """Torque of every phase and their sum."""
    best, tau = limit.least_copper, _phase_torque(limit)
    _plot_phases(ax, limit, tau)
    n_phases, coupling = limit.drive.machine.n_phases, limit.drive.machine.coupling
    total = np.sum([_shifted(limit, tau, k) for k in range(n_phases)], axis=0)
    if coupling is not None:
        i = np.stack([_shifted(limit, best.i, k) for k in range(n_phases)], axis=-1)
        pairs = coupling.tau(i, best.theta_e)
        ax.plot(*_closed(limit, pairs), "k", lw=1, ls="-.", label="pairs")
        total = total + pairs
    ax.plot(*_closed(limit, total), "k", lw=2, label="sum")
    ax.axhline(best.tau_ref, color="k", lw=0.8, ls=":", label="reference")
    error = f"error {best.tau_error_max:.3g} N m at most, {best.tau_error_rms:.3g} rms"
    ax.set(title="no ripple" if limit.ripple_free else error, ylabel="torque (N m)")
    return ax


def plot_voltage(ax: Axes, limit: Limit) -> Axes:
    """Voltage of the first phase within the dc link, and its flux; both zeros at one height."""
    best = limit.least_copper
    u, psi = (_shifted(limit, values, 0) for values in (best.u, best.psi))
    ax.step(*_closed(limit, u), where="post", color=styled(COLOURS[0], 0))
    ax.axhspan(-best.u_dc, best.u_dc, color="k", alpha=0.06, lw=0)
    ax.set(title="phase a: voltage, within the dc link's, and flux linkage", ylabel="voltage (V)")
    ax.yaxis.label.set_color(styled(COLOURS[0], 0))
    ax.set_ylim(-1.1 * best.u_dc, 1.1 * best.u_dc)
    flux = ax.twinx()
    flux.plot(*_closed(limit, psi), color="k", ls="--")
    flux.set_ylabel("flux linkage, dashed (Wb)", loc="top")
    top = 1.1 * float(psi.max()) or 1.0
    flux.set_yticks([tick for tick in flux.get_yticks() if tick >= 0])
    flux.set_ylim(-top, top)
    return ax


def plot_envelope(ax: Axes, limit: Limit, envelope: Envelope) -> Axes:
    """Greatest ripple-free torque over speed, and the operating point."""
    best = limit.least_copper
    rpm = from_si(envelope.omega_m, "rpm")
    ax.fill_between(rpm, envelope.tau_max, color=styled(COLOURS[0], 0), alpha=0.15, lw=0)
    ax.plot(
        rpm,
        envelope.tau_max,
        marker=".",
        color=styled(COLOURS[0], 0),
        label="greatest without ripple",
    )
    ax.plot(from_si(best.omega_m, "rpm"), best.tau_ref, "k*", ms=12, label="operating point")
    ax.set(
        title=f"{limit.tau_max:.4g} N m without ripple at this speed",
        xlabel="speed (rpm)",
        ylabel="torque (N m)",
    )
    ax.margins(x=0)
    ax.set_ylim(*((0, None) if best.tau_ref >= 0 else (None, 0)))
    return ax


def figure(limit: Limit, envelope: Envelope) -> Figure:
    """Currents, torques and voltage of the best profile, and the envelope; own canvas."""
    drawn = Picture(12, 8)
    currents, torque, voltage, border = drawn.subplots(2, 2).flat
    plot_currents(currents, limit)
    plot_torque(torque, limit)
    plot_voltage(voltage, limit)
    for ax in (currents, torque, voltage):
        ax.set(xlim=(0, 360), xticks=range(0, 361, 60))
        ax.set_xlabel("electrical angle of phase a (deg): 0 unaligned, 180 aligned")
    plot_envelope(border, limit, envelope)
    for ax in (currents, torque, voltage, border):
        ax.grid(alpha=0.25)
    pairs = [ax.get_legend_handles_labels() for ax in (torque, border)]
    drawn.legend_below(*([*one, *other] for one, other in zip(*pairs, strict=True)))
    best = limit.least_copper
    what = "without ripple" if limit.ripple_free else "with least ripple"
    drawn.suptitle(
        f"{limit.drive.name}: minimum copper loss {what}, {best.tau_ref:.4g} N m at "
        f"{from_si(best.omega_m, 'rpm'):.5g} rpm, {best.u_dc:g} V",
    )
    return drawn


def save_figure(limit: Limit, envelope: Envelope, path: str | Path) -> None:
    """Writes the figure; the ending chooses png, svg, pdf or html."""
    figures.save_figure(figure(limit, envelope), Path(path), title=limit.drive.name)


def _save(path: str | Path, table: dict[str, FloatArray]) -> None:
    write_table(Path(path), table)


def _plot_phases(ax: Axes, limit: Limit, values: FloatArray) -> None:
    for k in range(limit.drive.machine.n_phases):
        name = phase_name(k)
        ax.plot(
            *_closed(limit, _shifted(limit, values, k)), color=styled(COLOURS[k], k), label=name
        )


def _closed(limit: Limit, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Angle [deg] and values with the first point once more at the end of the period."""
    return np.append(np.degrees(limit.least_copper.theta_e), 360.0), np.append(values, values[0])


def _shifted(limit: Limit, values: FloatArray, k: int) -> FloatArray:
    """What phase k does, over the angle of the first."""
    own = np.atleast_2d(values)
    return np.roll(own[k % len(own)], k * own.shape[1] // limit.drive.machine.n_phases)


def _phase_torque(limit: Limit) -> FloatArray:
    """Of each phase alone."""
    best = limit.least_copper
    return limit.drive.machine.tau(best.i, best.theta_e)
