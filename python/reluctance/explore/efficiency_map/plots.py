"""Figures of an efficiency map: contours of efficiency, losses by kind, ripple and rms current."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from reluctance.base.arrays import FloatArray
from reluctance.base.figures import save_figure
from reluctance.base.picture import Picture, styled
from reluctance.base.units import from_si
from reluctance.explore.efficiency_map.cycle import Cycle
from reluctance.explore.efficiency_map.map import LOSSES, EfficiencyMap
from reluctance.machine.optimum import Envelope

FINE = 160  # points a side of what is drawn
NEGLIGIBLE = 1e-6  # part of all losses: a kind below it has no panel
LEVELS = (  # of efficiency
    *(0.2, 0.3, 0.4, 0.5, 0.6, 0.65, 0.7, 0.75, 0.8, 0.82, 0.84, 0.86, 0.88),
    *(0.9, 0.91, 0.92, 0.93, 0.94, 0.95, 0.96, 0.97, 0.98, 0.99),
)

RIPPLES = (
    *(0.001, 0.002, 0.005, 0.01, 0.015, 0.02, 0.03, 0.05, 0.07),
    *(0.1, 0.15, 0.2, 0.3, 0.5, 0.7, 1, 2, 5),
)


def figure(
    found: EfficiencyMap,
    *,
    envelope: Envelope | None = None,
    cycle: Cycle | None = None,
    braking: EfficiencyMap | None = None,
) -> Figure:
    """The panels of a map, or of those of motoring and braking together.

    Parameters
    ----------
    envelope : the greatest torque without ripple of any controller, drawn as a line.
    cycle : its points are drawn on the efficiency.
    """
    maps = [found] if braking is None else [found, braking]
    kinds = [
        kind
        for kind in LOSSES
        if kind in found.kinds_per_torque
        and np.nanmax(found.kinds_per_torque[kind]) > NEGLIGIBLE * np.nanmax(found.loss_per_torque)
    ]
    panels = ["efficiency", "loss", *(kinds if len(kinds) > 1 else [])]
    panels += ["torque_ripple_rms", "i_rms_A"]
    columns = 2 if len(panels) <= 4 else 3
    rows = -(-len(panels) // columns)
    drawn = Picture(5.0 * columns, 3.9 * rows)
    axes = drawn.subplots(rows, columns, squeeze=False).ravel()
    for ax in axes[len(panels) :]:
        ax.remove()
    for ax, panel in zip(axes, panels, strict=False):
        _panel(ax, maps, panel)
        for border in maps:
            ax.plot(
                *_edge(border), color="k", lw=1.2, label="greatest torque held, of those asked for"
            )
        if envelope is not None:
            rpm = from_si(envelope.omega_m, "rpm")
            above = float(np.min(envelope.tau_max)) > 1.05 * float(np.abs(found.tau).max())
            name = "greatest without ripple, any law" + (
                " (above the torques shown)" if above else ""
            )
            ax.plot(rpm, envelope.tau_max, "k--", lw=1, label=name)
        if cycle is not None and panel == "efficiency":
            rpm = from_si(cycle.omega, "rpm")
            ax.plot(rpm, cycle.tau, ".", ms=3, color=styled("crimson"), label="drive cycle")
        ax.set(xlabel="speed (rpm)", ylabel="torque (N m)")
        ax.set_xlim(0, from_si(float(found.omega[-1]), "rpm"))
        top = 1.05 * float(np.abs(found.tau).max())
        low = 0.0 if braking is None else -1.05 * float(np.abs(braking.tau).max())
        ax.set_ylim(*((low, top) if found.tau[0] > 0 else (-top, 0.0)))
    handles, names = axes[0].get_legend_handles_labels()
    once = dict(zip(names, handles, strict=True))
    drawn.legend_below(once.values(), once.keys())
    drawn.suptitle(f"{found.drive.name}, {found.u_dc:g} V")
    return drawn


def save(
    found: EfficiencyMap,
    path: Path,
    *,
    envelope: Envelope | None = None,
    cycle: Cycle | None = None,
    braking: EfficiencyMap | None = None,
) -> None:
    """Writes the figure; the ending chooses png, svg, pdf or html."""
    drawn = figure(found, envelope=envelope, cycle=cycle, braking=braking)
    save_figure(drawn, path, title=f"{found.drive.name}: efficiency map")


def _panel(ax: Axes, maps: list[EfficiencyMap], panel: str) -> None:
    """Filled contours with their values on lines."""
    parts = [part for found in maps if (part := _fine(found, panel))[2].count()]
    title, unit = _title(panel)
    ax.set_title(f"{title} ({unit})", fontsize=10)
    if not parts:  # as the efficiency where shaft and dc link both feed the losses
        return
    values = np.concatenate([z.compressed() for _, _, z in parts])
    low, high = (float(x) for x in np.percentile(values, [1, 99]))
    if unit == "%":
        chosen = LEVELS if panel == "efficiency" else RIPPLES
        within = [level for level in chosen if low < level < high]
        spread = np.linspace(0, len(within) - 1, min(len(within), 9)).round().astype(int)
        levels = [within[n] for n in spread]
    else:
        levels = [x for x in MaxNLocator(9).tick_values(low, high) if low < x < high]
    if len(levels) < 2:
        levels = np.linspace(low, high + 1e-9 * (1 + abs(high)), 5)[1:-1].tolist()
    norm = BoundaryNorm(levels, 256, extend="both")  # as many colours as bands, however wide
    for omega, tau, z in parts:
        rpm = from_si(omega, "rpm")
        ax.contourf(rpm, tau, z, levels=levels, norm=norm, extend="both", alpha=0.85)
        lines = ax.contour(rpm, tau, z, levels=levels, colors="k", linewidths=0.5)
        ax.clabel(lines, fmt=_percent if unit == "%" else "%g", fontsize=7)


def _fine(found: EfficiencyMap, panel: str) -> tuple[FloatArray, FloatArray, np.ma.MaskedArray]:
    """Speed, torque and value on a fine mesh, masked where the drive does not hold the torque."""
    omega, tau = np.meshgrid(
        np.linspace(found.omega[0], found.omega[-1], FINE),
        np.linspace(found.tau[0], found.tau[-1], FINE),
    )
    if panel == "efficiency":
        z = found.efficiency(omega, tau)
    elif panel == "loss":
        z = found.loss(omega, tau)
    elif panel in found.kinds_per_torque:
        z = found.loss(omega, tau, panel)
    else:
        z = found.figure(panel, omega, tau)
    hidden = ~found.holds(omega, tau) | ~np.isfinite(z)
    return omega, tau, np.ma.array(z, mask=hidden)


def _edge(found: EfficiencyMap) -> tuple[FloatArray, FloatArray]:
    return from_si(found.omega, "rpm"), found.tau_max


def _percent(part: float) -> str:
    return f"{100 * part:.3g}"


def _title(panel: str) -> tuple[str, str]:
    if panel in LOSSES:
        return f"loss: {LOSSES[panel]}", "W"
    return {
        "efficiency": ("efficiency", "%"),
        "loss": ("all losses", "W"),
        "torque_ripple_rms": ("torque ripple, rms over mean", "%"),
        "i_rms_A": ("rms phase current", "A"),
    }[panel]
