"""A limit as files: the profile and the envelope as tables, both as one figure."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from reluctance import _core
from reluctance.limit.envelope import Envelope
from reluctance.limit.magnetics import FloatArray
from reluctance.limit.report import Limit
from reluctance.save import WRITERS, check_ending, write_whole

ENDINGS = {".png", ".svg", ".pdf"}


def save_profile(limit: Limit, path: str | Path) -> None:
    """Writes one electrical period of one phase; the ending chooses csv, npz, parquet or mat."""
    best = limit.least_copper
    table = {
        "theta_e_deg": np.degrees(best.theta_e),
        "i_A": best.i,
        "psi_Wb": best.psi,
        "u_V": best.u,
        "tau_ph_Nm": _phase_torque(limit),
    }
    _save(path, table)


def save_envelope(envelope: Envelope, path: str | Path) -> None:
    """Writes the greatest ripple-free torque over speed; endings as for `save_profile`."""
    table = {
        "speed_rpm": envelope.omega_m * 30 / np.pi,
        "tau_max_Nm": envelope.tau_max,
        "i_rms_A": envelope.i_rms,
        "i_peak_A": envelope.i_peak,
        "p_cu_W": envelope.p_cu,
    }
    _save(path, table)


def plot_currents(ax: Axes, limit: Limit) -> Axes:
    """Current of every phase over the angle of the first."""
    for k in range(limit.drive.machine.n_phases):
        ax.plot(_degrees(limit), _shifted(limit, limit.least_copper.i, k), label="abcdef"[k])
    ax.set(xlabel="electrical angle (deg)", ylabel="current (A)")
    ax.legend(title="phase", loc="upper left", bbox_to_anchor=(1, 1), fontsize=8)
    return ax


def plot_torque(ax: Axes, limit: Limit) -> Axes:
    """Torque of every phase and their sum."""
    tau = _phase_torque(limit)
    shares = [_shifted(limit, tau, k) for k in range(limit.drive.machine.n_phases)]
    for share in shares:
        ax.plot(_degrees(limit), share, lw=0.9)
    ax.plot(_degrees(limit), np.sum(shares, axis=0), "k", lw=1.5, label="sum")
    ax.set(xlabel="electrical angle (deg)", ylabel="torque (N m)")
    ax.legend(loc="upper left", bbox_to_anchor=(1, 1), fontsize=8)
    return ax


def plot_voltage(ax: Axes, limit: Limit) -> Axes:
    """Voltage of the first phase within the dc link, and its flux."""
    best = limit.least_copper
    ax.step(_degrees(limit), best.u, where="post")
    for level in (-best.u_dc, best.u_dc):
        ax.axhline(level, color="k", ls=":", lw=0.8)
    ax.set(xlabel="electrical angle (deg)", ylabel="voltage (V)")
    flux = ax.twinx()
    flux.plot(_degrees(limit), best.psi, "C1")
    flux.set_ylabel("flux linkage (Wb)", color="C1")
    return ax


def plot_envelope(ax: Axes, limit: Limit, envelope: Envelope) -> Axes:
    """Greatest ripple-free torque over speed, and the operating point."""
    ax.plot(envelope.omega_m * 30 / np.pi, envelope.tau_max, marker=".", label="ripple-free up to")
    best = limit.least_copper
    ax.plot(best.omega_m * 30 / np.pi, best.tau_ref, "k*", ms=10, label="operating point")
    ax.set(xlabel="speed (rpm)", ylabel="torque (N m)")
    ax.set_ylim(*((0, None) if best.tau_ref >= 0 else (None, 0)))
    ax.legend(fontsize=8)
    return ax


def figure(limit: Limit, envelope: Envelope) -> Figure:
    """Currents, torques and voltage of the best profile, and the envelope; own canvas."""
    drawn = Figure(figsize=(11, 7), layout="constrained")
    FigureCanvasAgg(drawn)
    currents, torque, voltage, border = drawn.subplots(2, 2).flat
    plot_currents(currents, limit)
    plot_torque(torque, limit)
    plot_voltage(voltage, limit)
    plot_envelope(border, limit, envelope)
    best = limit.least_copper
    what = "without ripple" if limit.ripple_free else "with least ripple"
    drawn.suptitle(
        f"{limit.drive.name}: least copper {what}, {best.tau_ref:.4g} N m at "
        f"{best.omega_m * 30 / np.pi:.5g} rpm, {best.u_dc:g} V"
    )
    return drawn


def save_figure(limit: Limit, envelope: Envelope, path: str | Path) -> None:
    """Writes the figure; the ending chooses png, svg or pdf."""
    path = Path(path)
    check_ending(path, ENDINGS)
    drawn = figure(limit, envelope)
    write_whole(path, lambda temporary: drawn.savefig(temporary, dpi=110))


def _save(path: str | Path, table: dict[str, FloatArray]) -> None:
    path = Path(path)
    write = WRITERS[check_ending(path, WRITERS)]
    write_whole(path, lambda temporary: write(temporary, table))


def _degrees(limit: Limit) -> FloatArray:
    return np.asarray(np.degrees(limit.least_copper.theta_e))


def _shifted(limit: Limit, values: FloatArray, k: int) -> FloatArray:
    return np.roll(values, k * len(values) // limit.drive.machine.n_phases)


def _phase_torque(limit: Limit) -> FloatArray:
    best = limit.least_copper
    return np.asarray(_core.magnetics(limit.drive.machine.magnetics, best.i, best.theta_e)[:, 2])
