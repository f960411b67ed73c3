"""Figure of a table of angles: turn-on, turn-off and the tuned figure over speed and torque."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from reluctance.base.figures import save_figure
from reluctance.base.picture import Picture
from reluctance.explore.sweeps.plots import label
from reluctance.explore.tuning.angles import TunedAngles


def figure(found: TunedAngles) -> Figure:
    """A panel each; nodes that miss the torque or a bound are crossed out."""
    rows = [node.row | {found.goal.figure: node.figures.get(found.goal.figure, np.nan)}
            for node in found.nodes]  # fmt: skip
    speeds, torques = (sorted({row[name] for row in rows}) for name in ("speed_rpm", "torque_Nm"))
    drawn = Picture(12, 3.8)
    missed = [(row["speed_rpm"], row["torque_Nm"]) for row in rows if row["note"]]
    panels = {
        "theta_on_deg": "turn-on angle (deg el.)",
        "theta_off_deg": "turn-off angle (deg el.)",
    }
    panels[found.goal.figure] = label(found.goal.figure)
    count = len(panels)
    grid = drawn.subplots(count, 1) if drawn.one_column else drawn.subplots(1, count)
    for ax, (name, title) in zip(grid, panels.items(), strict=True):
        values = np.array([row[name] for row in rows]).reshape(len(speeds), len(torques))
        drawn.colorbar(ax.pcolormesh(speeds, torques, values.T, shading="gouraud"), ax=ax)
        ax.plot(*np.meshgrid(speeds, torques), ".", ms=3, color="w")
        if missed:
            ax.plot(*np.transpose(missed), "x", color="C3", label="missed, see the note")
            ax.legend(fontsize=7)
        ax.set(xlabel="speed (rpm)", ylabel="torque (N m)", title=title)
    drawn.suptitle(f"{found.name}: {found.goal}", fontsize=10)
    return drawn


def save(found: TunedAngles, path: Path) -> None:
    """Writes the figure; the ending chooses png, svg, pdf or html."""
    save_figure(figure(found), path, title=f"{found.name}: angles over speed and torque")
