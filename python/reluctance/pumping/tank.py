"""A tank between pump and demand: level, overflow, water that was missing."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from pydantic import Field, model_validator

from reluctance.base.arrays import FloatArray
from reluctance.base.schema import Section


class Tank(Section):
    """[tank]"""

    volume_m3: float = Field(ge=0)
    start_m3: float | None = Field(None, ge=0)  # by default as much as it ends with

    @model_validator(mode="after")
    def starts_within(self) -> "Tank":
        if self.start_m3 is not None and self.start_m3 > self.volume_m3:
            raise ValueError(
                f"start_m3 = {self.start_m3:g} is above volume_m3 = {self.volume_m3:g}"
            )
        return self


class Demand(Section):
    """[demand]: the same every day, even from one hour to another."""

    m3_per_day: float = Field(gt=0)
    from_h: float = Field(0.0, ge=0, lt=24)  # local time
    to_h: float = Field(24.0, gt=0, le=24)

    @model_validator(mode="after")
    def has_hours(self) -> "Demand":
        if self.from_h >= self.to_h:
            raise ValueError(f"from_h = {self.from_h:g} is not before to_h = {self.to_h:g}")
        return self

    def over(self, t: pd.DatetimeIndex, step: float) -> FloatArray:
        """Water asked for in each interval with these middles [m^3]."""
        half = step / 7200
        middle = np.asarray(t.hour + t.minute / 60 + t.second / 3600)
        covered = np.zeros(len(t))
        for day in (-24.0, 0.0, 24.0):  # an interval around midnight is of two days
            begins, ends = self.from_h + day, self.to_h + day
            both = np.minimum(middle + half, ends) - np.maximum(middle - half, begins)
            covered += np.maximum(both, 0.0)
        return covered * self.m3_per_day / (self.to_h - self.from_h)


@dataclass(frozen=True)
class Storage:
    """Of each interval, at its end [m^3]."""

    start: float  # in the tank before the first interval
    level: FloatArray
    overflow: FloatArray
    missing: FloatArray
    demand: FloatArray

    @property
    def loss_of_load(self) -> float:
        """Part of the demand that was not met [1]."""
        return float(self.missing.sum() / self.demand.sum()) if self.demand.sum() > 0 else 0.0


def store(inflow: FloatArray, demand: FloatArray, tank: Tank) -> Storage:
    """The course of the tank for water in and out per interval [m^3].

    Without `start_m3` the days repeat: the tank starts as full as it ends. Each interval maps the
    level x to clamp(x + change, 0, volume), and a chain of such maps is clamp(x + a, b, c) with a
    the sum of the changes. Its fixed point is therefore the end of one pass: from the full tank
    where a > 0, from the empty one otherwise.
    """
    if tank.start_m3 is not None:
        return _course(inflow, demand, tank.volume_m3, tank.start_m3)
    far = tank.volume_m3 if inflow.sum() > demand.sum() else 0.0
    start = float(_course(inflow, demand, tank.volume_m3, far).level[-1])
    return _course(inflow, demand, tank.volume_m3, start)


def _course(inflow: FloatArray, demand: FloatArray, volume: float, start: float) -> Storage:
    level, levels, changes = start, [], []
    for change in (inflow - demand).tolist():
        wanted = level + change
        level = min(max(wanted, 0.0), volume)
        levels.append(level)
        changes.append(wanted - level)
    past = np.array(changes)  # over the rim, or below the floor
    return Storage(
        start=start,
        level=np.array(levels),
        overflow=np.maximum(past, 0.0),
        missing=np.maximum(-past, 0.0),
        demand=demand,
    )
