"""The four figures of a machine: magnetisation, torque, incremental inductance, co-energy."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from reluctance import _core
from reluctance.machine.maps.table import FluxTable

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ANGLES = (0.0, 45.0, 90.0, 135.0, 180.0)  # deg el.
LEVELS = (0.1, 0.25, 0.5, 0.75, 1.0)  # of the last current


def plot_magnetisation(
    machine: _core.FluxMap, table: FluxTable | None = None, *, axes: Axes | None = None
) -> Axes:
    """Flux linkage over current at five angles, with the samples of the table as dots."""
    axes = _axes(axes)
    i = np.linspace(0, machine.i_last, 200)
    for n, angle in enumerate(ANGLES):
        psi = _core.magnetics(machine, i, np.full_like(i, np.radians(angle)))[:, 0]
        axes.plot(i, psi, color=_colour(n), label=f"{angle:g} deg el.")
        if table is not None:
            column = int(np.abs(table.theta_e - np.radians(angle)).argmin())
            if abs(table.theta_e[column] - np.radians(angle)) < 1e-3:
                axes.plot(table.i, table.psi[:, column], ".", color=_colour(n), ms=4)
    return _finished(axes, "Magnetisation curves", "current (A)", "flux linkage (Wb)")


def plot_torque(
    machine: _core.FluxMap, table: FluxTable | None = None, *, axes: Axes | None = None
) -> Axes:
    """Torque over angle at five currents, with the torque of the table as dots."""
    axes = _axes(axes)
    _against_angle(axes, machine, 2)
    if table is not None and table.tau is not None:
        for n, i in enumerate(_levels(machine)):
            row = int(np.abs(table.i - i).argmin())
            if abs(table.i[row] - i) < 1e-3 * machine.i_last:
                axes.plot(np.degrees(table.theta_e), table.tau[row], ".", color=_colour(n), ms=4)
    return _finished(axes, "Static torque of one phase", "electrical angle (deg)", "torque (N m)")


def plot_inductance(machine: _core.FluxMap, *, axes: Axes | None = None) -> Axes:
    """Incremental inductance over angle at five currents, logarithmic."""
    axes = _axes(axes)
    _against_angle(axes, machine, 3, factor=1e3)
    axes.set_yscale("log")
    label = "incremental inductance (mH)"
    return _finished(axes, "Incremental inductance", "electrical angle (deg)", label)


def plot_coenergy(machine: _core.FluxMap, *, axes: Axes | None = None) -> Axes:
    """Co-energy over angle at five currents."""
    axes = _axes(axes)
    _against_angle(axes, machine, 1)
    return _finished(axes, "Co-energy of one phase", "electrical angle (deg)", "co-energy (J)")


def _against_angle(axes: Axes, machine: _core.FluxMap, column: int, *, factor: float = 1.0) -> None:
    theta_e = np.linspace(0, 2 * np.pi, 361)
    for n, i in enumerate(_levels(machine)):
        values = _core.magnetics(machine, np.full_like(theta_e, i), theta_e)[:, column]
        axes.plot(np.degrees(theta_e), factor * values, color=_colour(n), label=f"{i:.4g} A")
    axes.set_xticks(range(0, 361, 60))


def _levels(machine: _core.FluxMap) -> list[float]:
    return [share * machine.i_last for share in LEVELS]


def _colour(n: int) -> tuple[float, float, float, float]:
    import matplotlib.pyplot as plt

    return plt.get_cmap()(n / 5)


def _axes(axes: Axes | None) -> Axes:
    import matplotlib.pyplot as plt  # here, because it is slow to import

    return plt.subplots(layout="constrained")[1] if axes is None else axes


def _finished(axes: Axes, title: str, x: str, y: str) -> Axes:
    axes.set(title=title, xlabel=x, ylabel=y)
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small")
    return axes
