"""Trials of a tuning: values, the figures that they give, and how good these are."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from reluctance.drive.drive import Drive
from reluctance.explore.sweeps.sweep import swept
from reluctance.explore.sweeps.swept import start_of
from reluctance.explore.sweeps.vary import whole
from reluctance.explore.tuning.goal import WRONG, Goal

Values = dict[str, Any]


@dataclass(frozen=True)
class Trial:
    """One set of values."""

    values: Values
    figures: dict[str, float]  # means over the operating points; NaN where there is none
    worth: float  # less is better; NaN where it has no figure
    misses: tuple[float, ...]  # of the bounds, see Goal.misses
    why: str  # why it has no figures
    start: str = ""  # why figures of it include the start of a run

    @property
    def kept(self) -> bool:
        """True where all bounds hold."""
        return bool(np.isfinite(self.worth)) and all(miss <= 0 for miss in self.misses)

    @property
    def rank(self) -> tuple[float, float]:
        """First those that keep the bounds, by their worth; then those that miss them by least."""
        if not np.isfinite(self.worth):
            return (WRONG, 0.0)
        miss = sum(max(m, 0.0) for m in self.misses)
        return (miss, self.worth)


class Trials:
    """Runs sets of values at the operating points, and remembers what was tried."""

    def __init__(
        self,
        drive: Drive,
        goal: Goal,
        *,
        vary: Mapping[str, list[Any]] | None = None,
        points: Sequence[Values] = ({},),
        until: float | None = None,
        out: str | Path | None = None,
        jobs: int | None = None,
        budget: int = sys.maxsize,
        progress: Callable[[float], None] | None = None,
    ) -> None:
        self.drive, self.vary, self.goal, self.points = drive, vary or {}, goal, points
        self.until, self.out, self.jobs = until, out, jobs
        self.budget, self.progress = budget, progress
        self.tried: list[Trial] = []
        self.ran = 0
        self._known: dict[tuple[Any, ...], Trial] = {}

    @property
    def left(self) -> int:
        """Trials that may still be made."""
        return self.budget - len(self.tried)

    def run(self, wanted: Sequence[Values]) -> list[Trial]:
        """The trials of these values, as many as the budget allows; known ones cost nothing."""
        new = [v for v in wanted if tuple(v.values()) not in self._known]
        unique = list({tuple(v.values()): v for v in new}.values())[: max(self.left, 0)]
        if unique:
            rows = [v | point for v in unique for point in self.points]
            columns = {name: [row[name] for row in rows] for name in rows[0]}
            found = swept(self.drive, columns, (), until=self.until, out=self.out, jobs=self.jobs)
            self.ran += found.ran
            n_points = len(self.points)
            for n, values in enumerate(unique):
                part = slice(n * n_points, (n + 1) * n_points)
                rows_of = [found.point(j) for j in range(part.start, part.stop)]
                trial = self._trial(values, rows_of, next(filter(None, found.why[part]), ""))
                self._known[tuple(values.values())] = trial
                self.tried.append(trial)
            if self.progress is not None:
                self.progress(len(self.tried) / self.budget)
        return [self._known[key] for v in wanted if (key := tuple(v.values())) in self._known]

    def given(self) -> list[Values]:
        """The values of the drive itself; none where one is left to its law, or out of range."""
        values: Values = {}
        for name, ends in self.vary.items():
            section, *inner = name.split(".")
            value: Any = self.drive.sections().get(section)
            for part in inner:
                value = getattr(value, part, None)
            if name in self.ranges:
                fits = isinstance(value, int | float) and min(ends) <= value <= max(ends)
            else:
                fits = value in ends
            if not fits:
                return []
            values[name] = value
        return [values]

    def as_given(self) -> Trial:
        """The drive itself, whatever its law chooses, at the operating points."""
        same = {"simulation.until_s": self.drive.simulation.until_s}
        drive, goal, points = self.drive, self.goal, self.points
        alone = Trials(drive, goal, points=points, until=self.until, out=self.out, jobs=self.jobs)
        return alone.run([same])[0]

    def best(self) -> Trial:
        return min(self.tried, key=lambda trial: trial.rank)

    def at(self, unit: Sequence[float], choices: Values) -> Values:
        """The values at a place in the unit cube of the ranges, with choices of the others."""
        place = iter(np.clip(np.asarray(unit, float), 0.0, 1.0))
        found = {}
        for name, ends in self.vary.items():
            if name not in self.ranges:
                found[name] = choices[name]
                continue
            value = ends[0] + float(next(place)) * (ends[1] - ends[0])
            found[name] = round(value) if whole(self.drive, name) else float(f"{value:.6g}")
        return found

    def place(self, values: Values) -> list[float]:
        """Where values are in the unit cube of the ranges."""
        return [
            (values[name] - ends[0]) / (ends[1] - ends[0])
            for name, ends in self.vary.items()
            if name in self.ranges
        ]

    @property
    def ranges(self) -> list[str]:
        """Keys with two different numbers: these are ranges. Other values are choices."""
        return [
            name
            for name, v in self.vary.items()
            if len(v) == 2
            and all(isinstance(x, int | float) and not isinstance(x, bool) for x in v)
            and v[0] != v[1]
        ]

    def _trial(self, values: Values, points: list[dict[str, Any]], why: str) -> Trial:
        names = [name for name in points[0] if name not in values and name not in self.points[0]]
        figures = {name: float(np.mean([point[name] for point in points])) for name in names}
        start = next(filter(None, map(start_of, points)), "")
        worth, misses = self.goal.worth(points), tuple(self.goal.misses(points))
        return Trial(values, figures, worth, misses, why, start)
