"""The spaces of actions and observations: what each number means, and its bounds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium import spaces

from reluctance.base.errors import ParameterError
from reluctance.targets.gym.episodes import Episodes

MOST = 2.0  # observations are held within this many times what counts as one (environment.hpp)


@dataclass(frozen=True)
class Observed:
    """A number of an observation."""

    name: str
    one: float  # the quantity at which the number is 1
    unit: str  # of that quantity
    least: float
    most: float


def observed(episodes: Episodes) -> list[Observed]:
    """The numbers of an observation, in their order."""
    drive = episodes.drive
    phases = range(drive.machine.n_phases)
    i_max, omega = drive.machine.i_max_A, drive.omega_nominal
    least = {"legs": -1.0, "duties": -1.0, "currents": 0.0}[episodes.action]
    found = [
        *(Observed(f"i_{k}", i_max, "A", -MOST, MOST) for k in phases),
        Observed("cos_theta_e", 1.0, "", -1.0, 1.0),
        Observed("sin_theta_e", 1.0, "", -1.0, 1.0),
        Observed("omega_m", omega, "rad/s", -MOST, MOST),
        Observed("u_dc", drive.converter.u_dc_V, "V", -MOST, MOST),
        *(Observed(f"last_{k}", 1.0, "", least, 1.0) for k in phases),
    ]
    if episodes.task == "current":
        return [*found, *(Observed(f"i_ref_{k}", i_max, "A", -MOST, MOST) for k in phases)]
    if episodes.task == "speed":
        return [*found, Observed("omega_ref", omega, "rad/s", -MOST, MOST)]
    return [*found, Observed("tau_ref", episodes.drive.tau_max, "N.m", -MOST, MOST)]


def observation_space(episodes: Episodes) -> Any:
    of = observed(episodes)
    return spaces.Box(
        np.array([o.least for o in of], np.float32),
        np.array([o.most for o in of], np.float32),
        dtype=np.float32,
    )


def action_space(episodes: Episodes) -> Any:
    n_phases = episodes.drive.machine.n_phases
    if episodes.action == "legs":
        return spaces.MultiDiscrete([3] * n_phases)  # demagnetize, freewheel, magnetize
    least = -1.0 if episodes.action == "duties" else 0.0
    return spaces.Box(least, 1.0, (n_phases,), np.float32)


def checked_action(action: object, space: Any) -> Any:
    """An action as numbers, if it is one of the space.

    Raises
    ------
    ParameterError
        If its shape is another, or a number is none or out of range.
    """
    try:
        given = np.asarray(action, np.float64)
    except (TypeError, ValueError):
        raise ParameterError(f"action {action!r}, need numbers of shape {space.shape}") from None
    if given.shape != space.shape:
        raise ParameterError(f"action of shape {given.shape}, need {space.shape}")
    legs = isinstance(space, spaces.MultiDiscrete)
    low, high = (0, space.nvec - 1) if legs else (space.low, space.high)
    if not np.all((given >= low) & (given <= high)):  # false for NaN too
        raise ParameterError(
            f"action {given.tolist()}, need numbers from {np.min(low):g} to {np.max(high):g}; clip "
            "it"
        )
    return given


OFFSET = {"legs": 1.0, "duties": 0.0, "currents": 0.0}  # of an action, to the core's number
