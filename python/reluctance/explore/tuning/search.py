"""The default search, the same however often it is made: Sobol points, then COBYLA from the best.

The first half of the budget fills the ranges evenly, on all cores. The rest refines with linear
models of the figure and the bounds (M. J. D. Powell, 1994), which needs no derivative.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from reluctance.explore.sweeps.vary import samples
from reluctance.explore.tuning.goal import WRONG
from reluctance.explore.tuning.trials import Trial, Trials, Values

FIRST = 0.5  # part of the budget that is spent on Sobol points
STEP = 0.15  # first step of the refinement, in parts of the ranges
LAST = 1e-3  # its last
SEED = 0


class _Spent(Exception):
    """The budget is used up."""


def search(trials: Trials, starts: Sequence[Values] = ()) -> None:
    """Spends the budget of the trials; the starts are among its first half."""
    count = max(int(FIRST * trials.budget) - len(starts), 1)
    columns = samples(trials.drive, trials.vary, count, sobol=True, seed=SEED)
    points = [{name: columns[name][n] for name in columns} for n in range(count)]
    trials.run([*starts, *points])
    start = trials.best()
    if trials.ranges and np.isfinite(start.worth):
        refine(trials, start)


def refine(trials: Trials, start: Trial) -> None:
    """COBYLA in the unit cube of the ranges; choices stay as they are."""
    from scipy.optimize import minimize

    scale = abs(start.worth) or 1.0
    n = len(trials.ranges)

    def trial(x: Sequence[float]) -> Trial:
        values = trials.at(x, start.values)
        found = trials.run([values])
        if not found:
            raise _Spent
        return found[0]

    def worth(x: Sequence[float]) -> float:
        found = trial(x).worth
        return found / scale if np.isfinite(found) else WRONG

    def room(x: Sequence[float]) -> list[float]:
        misses = [-m if np.isfinite(m) else -WRONG for m in trial(x).misses]
        return [*misses, *x, *(1 - np.asarray(x))]

    try:
        minimize(
            worth,
            np.array(trials.place(start.values)),
            method="COBYLA",
            constraints=[{"type": "ineq", "fun": lambda x: np.array(room(x))}],
            options={"rhobeg": STEP, "tol": LAST, "maxiter": 20 * (n + 1) * trials.budget},
        )
    except _Spent:
        pass
