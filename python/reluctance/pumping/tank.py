"""A tank between pump and demand: level, overflow, water that was missing."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from pydantic import Field, model_validator

from reluctance.drive.schema import Section
from reluctance.drive.single_diode import FloatArray


class Tank(Section):
    """[tank]"""

    volume_m3: float = Field(ge=0)
    start_m3: float = Field(0.0, ge=0)  # in it at the start

    @model_validator(mode="after")
    def starts_within(self) -> "Tank":
        if self.start_m3 > self.volume_m3:
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
        covered = np.minimum(middle + half, self.to_h) - np.maximum(middle - half, self.from_h)
        return np.asarray(np.maximum(covered, 0.0)) * self.m3_per_day / (self.to_h - self.from_h)


@dataclass(frozen=True)
class Storage:
    """Of each interval, at its end [m^3]."""

    level: FloatArray
    overflow: FloatArray
    missing: FloatArray
    demand: FloatArray

    @property
    def loss_of_load(self) -> float:
        """Part of the demand that was not met [1]."""
        return float(self.missing.sum() / self.demand.sum()) if self.demand.sum() > 0 else 0.0


def store(inflow: FloatArray, demand: FloatArray, tank: Tank) -> Storage:
    """The course of the tank for water in and out per interval [m^3]."""
    level, levels, changes = tank.start_m3, [], []
    for change in (inflow - demand).tolist():
        wanted = level + change
        level = min(max(wanted, 0.0), tank.volume_m3)
        levels.append(level)
        changes.append(wanted - level)
    past = np.array(changes)  # over the rim, or below the floor
    return Storage(
        level=np.array(levels),
        overflow=np.maximum(past, 0.0),
        missing=np.maximum(-past, 0.0),
        demand=demand,
    )
