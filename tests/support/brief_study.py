"""A study of the source paper that takes a second: few angles, few settings, coarse profiles."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache

import pytest

from reluctance.drive.laws.guided import Guided
from reluctance.paper import points, response, study, sweeps

VOLTAGE_STEP = 50.0  # of the controller's least voltage [V]
GRID = study.Grid(
    u_dc=(200.0, 240.0),
    angle_step_deg=10.0,
    settings={"N_p": [1, 3], "N_c": [1, 2], "r_w": [0.05, 5.0]},
)


@dataclass(frozen=True)
class Brief:
    """A study, and what its progress was told."""

    found: study.Study
    shares: list[float]


@contextmanager
def coarse() -> Iterator[None]:
    """Reference profiles of few torques, a bound of few steps."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Guided, "guide_levels", 4)
        patch.setattr(response, "DT", 1e-5)
        patch.setattr(points, "PUMP_UNTIL", 0.3)
        patch.setattr(sweeps, "FINE_DEG", 10.0)
        patch.setattr(sweeps, "VOLTAGE_STEP", VOLTAGE_STEP)
        yield


@cache
def brief() -> Brief:
    """Its numbers are near those of the report, and every relation between them holds."""
    shares: list[float] = []
    with coarse():
        return Brief(study.study(GRID, progress=shares.append), shares)
