"""One drive as an environment."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from reluctance.drive.drive import Drive
from reluctance.targets.gym.episodes import Action, Prices, Range, Task, episodes
from reluctance.targets.gym.figures import figures
from reluctance.targets.gym.spaces import OFFSET, action_space, checked_action, observation_space

Observation = NDArray[np.float32]


class DriveEnv(gymnasium.Env[Observation, NDArray[Any]]):
    """A drive that is stepped one control period at a time.

    Parameters
    ----------
    drive : Drive or path, optional
        Machine, converter, load, sensors and control period; an example by default.
    task : {"torque", "current", "speed"}
    action : {"currents", "duties", "legs"}
        What an action says of each phase.
    reference : (low, high), optional
        Of which the reference of an episode is drawn, in parts of the greatest torque reference,
        the current limit or the nominal speed.
    randomise : mapping, optional
        Names of numbers of the drive to (low, high) factors on them, drawn for each episode.
    prices : Prices, optional
    length : int, optional
        Control periods of an episode.

    Raises
    ------
    ParameterError
        If an argument cannot be used.

    Examples
    --------
    >>> from reluctance.targets.gym import DriveEnv
    >>> env = DriveEnv(task="torque", action="legs")
    >>> observation, _ = env.reset(seed=1)
    >>> observation.shape, env.action_space
    ((11,), MultiDiscrete([3 3 3]))
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012  # as the base class has it

    def __init__(
        self,
        drive: Drive | str | None = None,
        *,
        task: Task = "torque",
        action: Action = "currents",
        reference: Range | None = None,
        randomise: Mapping[str, Range] | None = None,
        prices: Prices | None = None,
        length: int | None = None,
        render_mode: None = None,
    ) -> None:
        self.episodes = episodes(
            drive,
            task,
            action,
            reference=reference,
            randomise=randomise,
            prices=prices,
            length=length,
        )
        self.render_mode = render_mode
        self.action_space = action_space(self.episodes)
        self.observation_space = observation_space(self.episodes)
        self.batch = self.episodes.batch(1)
        self._offset = OFFSET[action]
        self._observations = np.zeros((1, self.batch.observed), np.float32)
        self._prices, self._tripped = np.zeros(1), np.zeros(1, bool)
        self._waiting = np.zeros(1, bool)
        self._action = np.zeros((1, self.episodes.drive.machine.n_phases))
        self._length, self._steps = self.episodes.length, 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begins an episode with drawn numbers, from zero current."""
        super().reset(seed=seed)
        self.batch.start(0, self.episodes.draw(self.np_random))
        self.batch.observe(self._observations)
        self._steps = 0
        return self._observations[0].copy(), {}

    def step(self, action: NDArray[Any]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Holds an action for a control period. The last `info` of an episode has its figures."""
        self._action[0] = checked_action(action, self.action_space)
        if self._offset:
            self._action -= self._offset
        self.batch.step(
            self._action, self._waiting, self._observations, self._prices, self._tripped
        )
        return self._ended()

    def obey(self, orders: NDArray[np.float64]) -> tuple[Observation, float, bool, bool, Any]:
        """One control period under orders of a control law, the ORDER_COLUMNS of each phase."""
        self.batch.obey(orders, self._observations, self._prices, self._tripped)
        return self._ended()

    def _ended(self) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        self._steps += 1
        tripped, over = bool(self._tripped[0]), self._steps >= self._length
        info = figures(self.episodes, self.batch, 0) if tripped or over else {}
        return self._observations[0].copy(), -float(self._prices[0]), tripped, over, info
