"""Control laws of drive files as policies: what a learned policy has to beat."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reluctance import _core
from reluctance.drive.drive import Drive
from reluctance.targets.gym.env import DriveEnv


class LawPolicy:
    """The control law of a drive: its orders at each sample, in an environment of its own drive or
    of another with the same machine and control period.

    Parameters
    ----------
    drive : Drive
    """

    def __init__(self, drive: Drive) -> None:
        self.drive = drive
        self.reset()

    def reset(self) -> None:
        """Forgets the last episode."""
        self._controller = self.drive.controller()

    def orders(self, env: DriveEnv) -> NDArray[np.float64]:
        """From the last sample of an environment."""
        *i, theta_e, omega_m, u_dc, i_source, reference = env.batch.sample(0)
        y = _core.Measurement(i=i, theta_e=theta_e, omega_m=omega_m, u_dc=u_dc, i_source=i_source)
        row = _core.step(self._controller, y, reference)
        return np.asarray(row[:-1]).reshape(1, -1)


@dataclass(frozen=True)
class Played:
    """Means over episodes."""

    reward: float  # of a control period
    torque_error_rms: float  # over the greatest torque reference; root of the mean square [1]
    p_cu: float  # [W]
    f_switch: float  # per switch [Hz]
    tripped: int  # episodes that ended early


def played(env: DriveEnv, policy: LawPolicy, seeds: Sequence[int]) -> Played:
    """Episodes of an environment under a control law, one for each seed."""
    rewards, infos, trips = [], [], 0
    for seed in seeds:
        env.reset(seed=seed)
        policy.reset()
        total, steps, ended = 0.0, 0, False
        while not ended:
            _, reward, tripped, over, info = env.obey(policy.orders(env))
            total, steps, ended = total + reward, steps + 1, tripped or over
        rewards.append(total / steps)
        infos.append(info)
        trips += tripped
    return summary(rewards, infos, trips)


def summary(rewards: Sequence[float], infos: Sequence[dict[str, float]], trips: int) -> Played:
    """Of episodes of equal length."""

    def mean(name: str) -> float:
        return float(np.mean([info[name] for info in infos]))

    error = np.sqrt(np.mean([info["torque_error_rms"] ** 2 for info in infos]))
    return Played(float(np.mean(rewards)), float(error), mean("p_cu"), mean("f_switch"), trips)
