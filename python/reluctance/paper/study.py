"""All that the report needs, computed once: runs, sweeps, limits."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from reluctance.paper.points import HALF, RATED, Runs, run_point
from reluctance.paper.sweeps import Response, Setting, response, settings


@dataclass(frozen=True)
class Grid:
    """How fine the sweeps are."""

    u_dc: tuple[float, ...] = (150.0, 240.0, 350.0, 540.0, 800.0)  # [V]
    angle_step_deg: float = 1.0  # start angles, mechanical, over one stroke
    settings: dict[str, list[float]] = field(
        default_factory=lambda: {
            "N_p": [1, 2, 3, 4, 6, 8, 10],
            "N_c": [1, 2, 3, 4],
            "r_w": [0.0005, 0.005, 0.05, 0.5, 5.0, 50.0],
        }
    )


FULL = Grid()


@dataclass(frozen=True)
class Study:
    """Everything that was computed."""

    rated: Runs
    half: Runs
    rated_response: Response
    half_response: Response
    settings: list[Setting]  # at the rated point


def study(
    grid: Grid | None = None, *, progress: Callable[[float], None] = lambda share: None
) -> Study:
    """Runs everything. `progress` is told the share that is done."""
    grid = FULL if grid is None else grid
    u_dc = np.array(grid.u_dc)
    theta_deg = np.arange(0.0, 30.0, grid.angle_step_deg)
    rated = run_point(RATED)
    progress(0.1)
    half = run_point(HALF)
    progress(0.2)
    rated_response = response(RATED, u_dc=u_dc, theta_deg=theta_deg)
    progress(0.5)
    half_response = response(HALF, u_dc=u_dc, theta_deg=theta_deg)
    progress(0.7)
    found = settings(RATED, grid.settings, rated_response.theta_start_deg)
    progress(0.75)
    return Study(rated, half, rated_response, half_response, found)
