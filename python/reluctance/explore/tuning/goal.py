"""What tuning is for: a figure to make least or greatest, and bounds that others must keep."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import log

import numpy as np

from reluctance.base.errors import ParameterError
from reluctance.explore.sweeps.swept import figure_name

FORM = re.compile(r"\s*(\w+)\s*(<=|>=|<|>)\s*([-+.\deE]+)\s*")
NEVER = 1e-3  # a figure of zero, for logarithms
WRONG = 1e3  # of a trial that gives no figures: worse than any that does


@dataclass(frozen=True)
class Bound:
    """A figure and what it must stay below, or above, in the units of `run --json`."""

    figure: str
    above: bool
    value: float

    def miss(self, figures: Mapping[str, float]) -> float:
        """How far it is missed, in parts of its value; negative where it is kept."""
        apart = figures[self.figure] - self.value
        return (-apart if self.above else apart) / (abs(self.value) or 1.0)

    def __str__(self) -> str:
        return f"{self.figure} {'>' if self.above else '<'} {self.value:g}"


@dataclass(frozen=True)
class Target:
    """A figure and the value that it must have, within a part of it; both positive."""

    figure: str
    value: float
    tolerance: float = 0.02

    def off(self, figures: Mapping[str, float]) -> float:
        """Logarithm of the figure over its target."""
        return log(max(figures[self.figure], NEVER) / self.value)

    def miss(self, figures: Mapping[str, float]) -> float:
        """How far it is missed, in parts of its value; negative where it is met."""
        return abs(figures[self.figure] / self.value - 1) - self.tolerance

    def met(self, figures: Mapping[str, float]) -> bool:
        return self.miss(figures) <= 0

    def __str__(self) -> str:
        return f"{self.figure} = {self.value:g}"


@dataclass(frozen=True)
class Goal:
    """The mean of a figure over the operating points, and bounds that hold at each of them."""

    figure: str
    most: bool
    bounds: tuple[Bound | Target, ...]

    def worth(self, points: Sequence[Mapping[str, float]]) -> float:
        """Less is better; NaN where a point has no such figure."""
        mean = float(np.mean([figures[self.figure] for figures in points]))
        return -mean if self.most else mean

    def misses(self, points: Sequence[Mapping[str, float]]) -> list[float]:
        """Of each bound, at the operating point where it is missed by most."""
        return [max(bound.miss(figures) for figures in points) for bound in self.bounds]

    def __str__(self) -> str:
        kept = f" subject to {' and '.join(map(str, self.bounds))}" if self.bounds else ""
        return f"{'most' if self.most else 'least'} {self.figure}{kept}"


def bound(text: str) -> Bound:
    """A bound from `i_rms_A<50` or `efficiency>0.8`.

    Raises
    ------
    ParameterError
        If it has another form, or the figure is none.
    """
    found = FORM.fullmatch(text)
    try:
        value = float(found[3]) if found else np.nan
    except ValueError:
        value = np.nan
    if found is None or not np.isfinite(value):
        raise ParameterError(f"--keep {text}: need FIGURE<VALUE or FIGURE>VALUE")
    if found[1] == "efficiency" and found[2].startswith(">") and value > 1:
        raise ParameterError(
            f"--keep {text}: need a bound below 1: efficiency is a fraction; 90 % is efficiency>0.9"
        )
    return Bound(figure_name(found[1]), found[2].startswith(">"), value)
