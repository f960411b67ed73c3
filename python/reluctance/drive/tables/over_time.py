"""A quantity over time, as several tables of a drive file have it."""

from __future__ import annotations

from pydantic import Field, model_validator

from reluctance import _core
from reluctance.base.schema import Section
from reluctance.base.units import to_si


def course(points: tuple[list[float], list[float]]) -> _core.Course:
    """Times [s] and values as the core's part."""
    t, value = points
    return _core.Course(t=t, value=value)


class OverTime(Section):
    """A quantity over time: points joined by lines, held before the first and after the last. Two
    points at the same time make a step."""

    t_s: list[float] = Field(default_factory=list)
    values: list[float] = Field(default_factory=list)  # as many, in the unit that the table says

    @model_validator(mode="after")
    def points_have_rising_times(self) -> OverTime:
        for key, values in self.over_time().items():
            if len(self.t_s) != len(values):
                raise ValueError(f"t_s has {len(self.t_s)} points, {key} {len(values)}")
        if any(b < a for a, b in zip(self.t_s, self.t_s[1:], strict=False)):
            raise ValueError(f"t_s = {self.t_s}, need rising times")
        return self

    def over_time(self) -> dict[str, list[float]]:
        """The lists that have a value for each time."""
        return {"values": self.values}

    def points(self, otherwise: float, unit: str | None = None) -> tuple[list[float], list[float]]:
        """Times [s] and values in SI; the constant where no points are given."""
        if not self.values:
            return [0.0], [otherwise]
        return self.t_s, [to_si(value, unit) for value in self.values]
