"""Environments for learning control, in the form of Gymnasium: one drive, or many at once.

    import gymnasium, reluctance.targets.gym
    env = gymnasium.make("reluctance/Torque-v0")
    many = gymnasium.make_vec("reluctance/Torque-v0", num_envs=256)

docs/gymnasium.md describes actions, observations and prices.
"""

from reluctance.base.errors import ParameterError

try:
    import gymnasium
except ImportError:
    raise ParameterError("environments need gymnasium; `pip install 'reluctance[gym]'`") from None

from reluctance.targets.gym.env import DriveEnv
from reluctance.targets.gym.episodes import TOLERANCES, Prices
from reluctance.targets.gym.law import LawPolicy, Played, played
from reluctance.targets.gym.spaces import Observed, observed
from reluctance.targets.gym.vector import DriveVectorEnv

__all__ = [
    "TOLERANCES",
    "DriveEnv",
    "DriveVectorEnv",
    "LawPolicy",
    "Observed",
    "Played",
    "Prices",
    "observed",
    "played",
]

for _task in ("torque", "current", "speed"):
    gymnasium.register(
        f"reluctance/{_task.capitalize()}-v0",
        entry_point="reluctance.targets.gym:DriveEnv",
        vector_entry_point="reluctance.targets.gym:DriveVectorEnv",
        kwargs={"task": _task},
        order_enforce=False,  # a drive is there from the beginning
        disable_env_checker=True,  # a test runs it; at each step it would cost more than the drive
    )
