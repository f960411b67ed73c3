"""Environments for learning control, in the form of Gymnasium: one drive, or many at once.

    import gymnasium, reluctance.gym
    env = gymnasium.make("reluctance/Torque-v0")
    many = gymnasium.make_vec("reluctance/Torque-v0", num_envs=256)

docs/gymnasium.md describes actions, observations and prices.
"""

from reluctance.errors import ParameterError

try:
    import gymnasium
except ImportError:
    raise ParameterError("environments need gymnasium; `pip install 'reluctance[gym]'`") from None

from reluctance.gym.env import DriveEnv
from reluctance.gym.episodes import TOLERANCES, Prices
from reluctance.gym.law import LawPolicy, Played, played
from reluctance.gym.spaces import Observed, observed
from reluctance.gym.vector import DriveVectorEnv

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
        entry_point="reluctance.gym:DriveEnv",
        vector_entry_point="reluctance.gym:DriveVectorEnv",
        kwargs={"task": _task},
        order_enforce=False,  # a drive is there from the beginning
        disable_env_checker=True,  # a test runs it; at each step it would cost more than the drive
    )
