"""The search over two values, coarse to fine: a grid over the unit square, then a compass search
from its best place with a step that halves. It needs no derivative and no model."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from reluctance.base.errors import ParameterError
from reluctance.explore.tuning.goal import WRONG
from reluctance.explore.tuning.trials import Trials

GRID = 5  # places a side of the coarse grid
LAST_STEP = 1 / 100  # of the unit square, about 1 deg
COMPASS = ((1, 0), (-1, 0), (0, 1), (0, -1))

Rank = TypeVar("Rank", float, tuple[float, float])


def compass(rank: Callable[[float, float], Rank], more: Callable[[], bool]) -> None:
    """Asks `rank`, of which less is better, for places of the unit square until the steps are small
    or there are no more runs. `rank` remembers what it found."""
    cells = [(j + 0.5) / GRID for j in range(GRID)]
    at = min(((x, y) for x in cells for y in cells), key=lambda p: rank(*p))
    step = 0.5 / GRID
    while step >= LAST_STEP and more():
        around = [(at[0] + dx * step, at[1] + dy * step) for dx, dy in COMPASS]
        inside = [p for p in around if 0 <= p[0] <= 1 and 0 <= p[1] <= 1]
        nearest = min(inside, key=lambda p: rank(*p))
        if rank(*nearest) < rank(*at):
            at = nearest
        else:
            step /= 2


def search(trials: Trials) -> None:
    """Spends the budget of the trials on two ranges.

    Raises
    ------
    ParameterError
        If something else is varied.
    """
    if len(trials.ranges) != 2 or len(trials.vary) != 2:
        raise ParameterError(
            f"method = 'compass' takes two ranges, not {len(trials.vary)} keys; use 'cobyla'"
        )
    known: dict[tuple[float, float], tuple[float, float]] = {}

    def rank(x: float, y: float) -> tuple[float, float]:
        if (x, y) not in known:
            found = trials.run([trials.at([x, y], {})])
            known[x, y] = found[0].rank if found else (2 * WRONG, 0.0)
        return known[x, y]

    compass(rank, lambda: trials.left > 0)
