"""The energy loop: flux linkage over current, its area against torque times angle.

Over a whole electrical period the energy that a phase turns into work is the area of its loop,

    int i dpsi = int tau dtheta_m + (W_f at the end - W_f at the start),

which holds for any machine whose flux and torque belong to one co-energy, and is the first check of
waveforms from anywhere (T. J. E. Miller, Switched Reluctance Motors and their Control, 1993).
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from reluctance import _core
from reluctance.base.arrays import FloatArray
from reluctance.base.errors import ParameterError
from reluctance.base.figures import check_figure, save_figure
from reluctance.base.phases import LETTERS, phase_name
from reluctance.base.picture import Picture
from reluctance.drive.run.result import Result

CURVES_DEG = (0.0, 45.0, 90.0, 135.0, 180.0)  # magnetisation curves behind the loop


@dataclass(frozen=True)
class EnergyLoop:
    """One phase over the last whole electrical period of a run."""

    k: int  # phase
    i: FloatArray  # (n,) [A]
    psi: FloatArray  # (n,) [Wb]
    area: float  # int i dpsi, less what the field energy rose by [J]
    work: float  # int tau dtheta_m [J]

    @property
    def difference(self) -> float:
        """(area - work)/work; 0 where there is no work [1]."""
        return (self.area - self.work) / abs(self.work) if self.work != 0 else 0.0

    def with_units(self) -> dict[str, str | float]:
        """As `run --json` has it."""
        return {"phase": LETTERS[self.k], "area_J": self.area, "work_J": self.work}


def energy_loops(result: Result) -> list[EnergyLoop]:
    """The loop of each phase.

    Raises
    ------
    ParameterError
        If the run has no waveforms, or is shorter than an electrical period.
    """
    machine = result.drive.machine
    if result.t.size == 0:
        raise ParameterError("the run has no waveforms; simulate with record = 0")
    angle = result.theta_m * np.sign(result.theta_m[-1] - result.theta_m[0])
    pitch = 2 * np.pi / machine.N_r
    end = pitch * np.floor(angle[-1] / pitch + 1e-6)
    start = end - pitch
    back = np.flatnonzero(np.diff(angle) < 0)
    first = int(back[-1]) + 1 if back.size else 0  # from here on the rotor turns one way
    if start < angle[first] - 1e-6:
        raise ParameterError(
            "the energy loop needs one whole electrical period in one direction; run longer"
        )
    moving = np.append(True, np.diff(angle) > 0)  # events leave several rows at one instant
    moving[:first] = False
    kept = angle[moving]
    inside = np.unique(np.concatenate([[start], kept[(kept > start) & (kept < end)], [end]]))
    theta_m = np.interp(inside, kept, result.theta_m[moving])
    found = []
    for k, current in enumerate(result.i):
        i = np.interp(inside, kept, current[moving])
        theta_e = machine.N_r * theta_m - 2 * np.pi * k / machine.n_phases
        psi, W_c, tau = _core.magnetics(machine.magnetics, i, theta_e)[:, :3].T
        W_f = psi * i - W_c
        supplied = float(np.sum((i[1:] + i[:-1]) / 2 * np.diff(psi)))
        work = float(np.sum((tau[1:] + tau[:-1]) / 2 * np.diff(theta_m)))
        area = supplied - float(W_f[-1] - W_f[0])
        found.append(EnergyLoop(k, i, psi, area, work))
    return found


def plot_energy_loop(ax: Axes, result: Result, loop: EnergyLoop) -> Axes:
    """The loop over the magnetisation curves of the machine."""
    magnetics = result.drive.machine.magnetics
    i = np.linspace(0, 1.05 * float(loop.i.max()), 200)
    for angle in CURVES_DEG:
        psi = _core.magnetics(magnetics, i, np.full_like(i, np.radians(angle)))[:, 0]
        ax.plot(i, psi, color="0.75", lw=0.8)
        ax.annotate(f" {angle:g} deg el.", (i[-1], psi[-1]), fontsize=7, color="0.4", va="center")
    ax.fill(loop.i, loop.psi, alpha=0.15)
    ax.plot(loop.i, loop.psi, lw=1.0)
    ax.set_xlim(right=1.2 * float(loop.i.max()))
    ax.set(xlabel="phase current (A)", ylabel="flux linkage (Wb)")
    ax.set_title(f"{phase_name(loop.k)}: {text(loop)}", fontsize=9)
    ax.grid(alpha=0.3)
    return ax


def text(loop: EnergyLoop) -> str:
    """The numbers in one line."""
    apart = f"apart {abs(loop.difference):.1e}"
    return f"area {loop.area:.5g} J, torque x angle {loop.work:.5g} J, {apart}"


def save_energy_loop(result: Result, path: str | Path) -> list[EnergyLoop]:
    """Draws the loop of phase a; the ending chooses png, svg, pdf or html.

    Returns
    -------
    list of EnergyLoop
        Of all phases.
    """
    path = Path(path)
    check_figure(path)
    loops = energy_loops(result)
    figure = Picture(7.5, 5.5)
    plot_energy_loop(figure.subplots(), result, loops[0])
    save_figure(figure, path, title=f"{result.drive.name}: energy loop")
    return loops
