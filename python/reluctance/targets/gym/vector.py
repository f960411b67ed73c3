"""Many drives as one environment: the core steps them together, without Python for each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from reluctance.base.errors import ParameterError
from reluctance.drive.drive import Drive
from reluctance.targets.gym.episodes import Action, Prices, Range, Task, episodes
from reluctance.targets.gym.figures import figures
from reluctance.targets.gym.spaces import OFFSET, action_space, checked_action, observation_space

Floats = NDArray[np.float32]
Step = tuple[Floats, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]


class DriveVectorEnv(VectorEnv[Floats, NDArray[Any], NDArray[Any]]):
    """Drives as those of DriveEnv, stepped together. A drive of which the episode has ended begins
    the next one in the following step, and its action there has no effect.

    Parameters
    ----------
    num_envs : int
    drive, task, action, reference, randomise, prices, length
        As of DriveEnv.

    Examples
    --------
    >>> from reluctance.targets.gym import DriveVectorEnv
    >>> many = DriveVectorEnv(64, action="legs")
    >>> observations, _ = many.reset(seed=1)
    >>> observations.shape
    (64, 11)
    """

    metadata: dict[str, Any] = {  # noqa: RUF012  # as the base class has it
        "render_modes": [],
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        num_envs: int = 1,
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
        if num_envs < 1:
            raise ParameterError(f"num_envs = {num_envs}, need >= 1")
        self.episodes = episodes(
            drive,
            task,
            action,
            reference=reference,
            randomise=randomise,
            prices=prices,
            length=length,
        )
        self.num_envs, self.render_mode = num_envs, render_mode
        self.single_action_space = action_space(self.episodes)
        self.single_observation_space = observation_space(self.episodes)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.batch = self.episodes.batch(num_envs)
        self._offset = OFFSET[action]
        self._random: list[np.random.Generator] = []
        self._ended = np.zeros(num_envs, bool)
        self._steps = np.zeros(num_envs, np.int64)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Floats, dict[str, Any]]:
        """Begins an episode of every drive. Of one seed, drive k has seed + k."""
        if seed is not None or not self._random:
            seeds = (
                [None if seed is None else seed + k for k in range(self.num_envs)]
                if seed is None or isinstance(seed, int)
                else list(seed)
            )
            if len(seeds) != self.num_envs:
                raise ParameterError(f"{len(seeds)} seeds for {self.num_envs} drives")
            self._random = [np.random.default_rng(one) for one in seeds]
        for k in range(self.num_envs):
            self._start(k)
        self._ended[:] = False
        observations = self._room()
        self.batch.observe(observations)
        return observations, {}

    def step(self, actions: NDArray[Any]) -> Step:
        """Holds actions for a control period."""
        given = checked_action(actions, self.action_space)
        if self._offset:
            given = given - self._offset
        for k in np.flatnonzero(self._ended):
            self._start(int(k))
        observations, prices = self._room(), np.empty(self.num_envs)
        tripped = np.empty(self.num_envs, bool)
        self._steps[~self._ended] += 1
        self.batch.step(given, self._ended, observations, prices, tripped)
        over = self._steps >= self.episodes.length
        self._ended = tripped | over
        return observations, -prices, tripped, over, self._info()

    def _room(self) -> Floats:
        return np.empty((self.num_envs, self.batch.observed), np.float32)

    def _start(self, k: int) -> None:
        self.batch.start(k, self.episodes.draw(self._random[k]))
        self._steps[k] = 0

    def _info(self) -> dict[str, Any]:
        """The figures of the episodes that end here: arrays, and under `_name` where they hold."""
        ended = np.flatnonzero(self._ended)
        if not len(ended):
            return {}
        info: dict[str, Any] = {}
        for k in ended:
            for name, value in figures(self.episodes, self.batch, int(k)).items():
                info.setdefault(name, np.zeros(self.num_envs))[k] = value
        return info | {f"_{name}": self._ended.copy() for name in info}
