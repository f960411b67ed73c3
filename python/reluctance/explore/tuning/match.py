"""Meet a figure with one value: bisection on its logarithm, helped by the secant."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import exp, log

from reluctance.explore.tuning.goal import Target
from reluctance.explore.tuning.trials import Trial

RUNS = 16  # for one match; 5 are usual


@dataclass(frozen=True)
class Lever:
    """The value that a target is met with, > 0."""

    low: float  # ends of its range
    high: float
    slope: float  # rough d log(figure)/d log(value); its sign is relied on

    @property
    def middle(self) -> float:
        """Of the range, on the logarithm."""
        return float((self.low * self.high) ** 0.5)

    def narrowed(self) -> Lever:
        """The half of the range where the figure is higher, on the logarithm."""
        if self.slope < 0:
            return replace(self, high=self.middle)
        return replace(self, low=self.middle)


@dataclass(frozen=True)
class Match:
    """The trial nearest to the target."""

    trial: Trial
    ran_out: bool  # the end of the range came first


def match(
    run: Callable[[float], Trial],
    target: Target,
    lever: Lever,
    start: float,
    *,
    worth: Callable[[Trial], bool] = lambda trial: True,
) -> Match:
    """The trial nearest to a target, over the values of a lever, from a first guess.

    `worth` may stop it after a trial that promises nothing.
    """
    low, high = log(lever.low), log(lever.high)
    x = min(max(log(start), low), high)
    slow: tuple[float, float] | None = None  # (x, off) of the nearest below the target
    fast: tuple[float, float] | None = None
    best: Trial | None = None
    for n in range(RUNS):
        trial = run(float(f"{exp(x):.5g}"))
        y = target.off(trial.figures)
        if best is None or abs(y) < abs(target.off(best.figures)):
            best = trial
        if target.met(trial.figures) or not worth(trial):
            break
        if y > 0:
            fast = (x, y)
        else:
            slow = (x, y)
        if slow is not None and fast is not None:
            if abs(fast[0] - slow[0]) < 1e-3:
                break  # the figure jumps here: the target lies in the gap
            part = slow[1] / (slow[1] - fast[1]) if n % 3 != 2 else 0.5
            x = slow[0] + min(max(part, 0.1), 0.9) * (fast[0] - slow[0])
        else:
            step = -1.2 * y / lever.slope  # a little too far, so that it ends up between
            if abs(step) < 0.02:
                step = 0.02 if step > 0 else -0.02
            if x == (low if step < 0 else high):
                return Match(best, ran_out=True)
            x = min(max(x + step, low), high)
    assert best is not None
    return Match(best, ran_out=False)
