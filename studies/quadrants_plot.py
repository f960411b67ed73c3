"""Figure of studies/quadrants.py: the ripple of every run, and where the mean is not held."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure


class Run(Protocol):
    """What the figure shows of a row."""

    @property
    def machine(self) -> str: ...
    @property
    def law(self) -> str: ...
    @property
    def speed_part(self) -> float: ...
    @property
    def ripple_rms(self) -> float: ...
    @property
    def holds(self) -> int: ...


def plot(rows: Sequence[Run]) -> Figure:
    """The ripple of every run; a cross where the mean is past its bound."""
    machines, laws = (list(dict.fromkeys(getattr(r, k) for r in rows)) for k in ("machine", "law"))
    figure = Figure(figsize=(11, 0.5 + 0.36 * len(laws) * len(machines)), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(len(machines), 1, squeeze=False)[:, 0]
    for ax, machine in zip(axes, machines, strict=True):
        mine = [r for r in rows if r.machine == machine]
        ripple = np.array([[100 * r.ripple_rms for r in mine if r.law == law] for law in laws])
        missed = np.array([[not r.holds for r in mine if r.law == law] for law in laws])
        image = ax.pcolormesh(ripple, norm=LogNorm(0.2, 100), cmap="viridis_r", edgecolors="w")
        y, x = np.nonzero(missed)
        ax.plot(x + 0.5, y + 0.5, "x", color="crimson", ms=5)
        ax.set_yticks(np.arange(len(laws)) + 0.5, laws)
        speeds = dict.fromkeys(r.speed_part for r in mine)
        labels = [f"{speed:g}" for _ in range(2) for speed in speeds]
        ax.set_xticks(np.arange(len(labels)) * 3 + 1.5, labels)
        ax.axvline(len(labels) * 1.5, color="k")
        ax.set_title(f"{machine}: motoring (left), braking (right)", fontsize=9)
        ax.invert_yaxis()
    axes[-1].set_xlabel("speed over base speed; at each 20, 50 and 80 % of the limit's torque")
    figure.colorbar(image, ax=axes, label="rms torque ripple (%)")
    return figure
