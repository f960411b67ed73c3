"""What a tuning tried: its trade-off between the figure and the first bound, and its progress."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from reluctance.base.figures import save_figure
from reluctance.base.picture import Picture
from reluctance.explore.sweeps.pareto import front
from reluctance.explore.sweeps.plots import label
from reluctance.explore.tuning.goal import Bound
from reluctance.explore.tuning.tune import Tuned


def figure(found: Tuned) -> Figure:
    """Left: the figure over trials, with the best so far. Right: over the figure of the first
    bound, or over the first value that was varied."""
    drawn = Picture(10, 4.2)
    trials, trade = drawn.subplots(1, 2)
    goal = found.goal
    y = np.array([t.figures[goal.figure] for t in found.tried])
    kept = np.array([t.kept for t in found.tried])
    n = np.arange(1, len(y) + 1)
    order = [min(found.tried[:m], key=lambda t: t.rank) for m in n]
    for ax, x in ((trials, n), (trade, _across(found))):
        ax.plot(x[kept], y[kept], ".", color="C0", label="keeps the bounds")
        ax.plot(x[~kept], y[~kept], "x", ms=4, color="0.6", label="does not")
        ax.set_ylabel(label(goal.figure))
        ax.grid(alpha=0.25)
    trials.step(n, [t.figures[goal.figure] for t in order], where="post", color="C1", label="best")
    trials.set_xlabel("trial")
    best = found.tried.index(found.best)
    if goal.bounds:
        first = goal.bounds[0]
        trade.axvline(first.value, color="k", lw=0.8, ls="--", label=str(first))
        trade.set_xlabel(label(first.figure))
        rows = front(_across(found), y, [isinstance(first, Bound) and first.above, goal.most])
        trade.plot(_across(found)[rows], y[rows], "-", lw=1, color="C2", label="Pareto front")
    else:
        trade.set_xlabel(label(next(iter(found.best.values))))
    trade.plot(_across(found)[best], y[best], "*", ms=12, color="C3", label="chosen")
    inside = y[np.isfinite(y)]
    low, high = float(inside.min()), float(np.percentile(inside, 90))
    for ax in (trials, trade):
        ax.set_ylim(low - 0.05 * (high - low or 1), high + 0.1 * (high - low or 1))
        ax.legend(fontsize=7)
    drawn.suptitle(f"{found.drive.name}: {goal}", fontsize=10)
    return drawn


def save(found: Tuned, path: Path) -> None:
    """Writes the figure; the ending chooses png, svg, pdf or html."""
    save_figure(figure(found), path, title=f"{found.drive.name}: tuning")


def _across(found: Tuned) -> np.ndarray:
    if found.goal.bounds:
        name = found.goal.bounds[0].figure
        return np.array([t.figures[name] for t in found.tried])
    first = next(iter(found.best.values))
    column = [t.values[first] for t in found.tried]
    choices = list(dict.fromkeys(map(str, column)))
    numbers = all(isinstance(v, int | float) for v in column)
    return np.array([v if numbers else choices.index(str(v)) for v in column], dtype=float)
