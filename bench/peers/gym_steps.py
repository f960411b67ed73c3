"""Steps of the environments per second of processor time on one core, and of a peer, in one run.

    python bench/peers/gym_steps.py [FOLDER] > bench/peers/gym_steps.csv

A step of ours is one control period of 20 us of one drive. Time within `step` alone is counted,
without the policy; the best of five passes stands, since other work on the computer only adds to
it. Legs are those of a current regulator, so that about half of the phases carry current, or drawn
at random, so that nearly all do. The peer has no switched-reluctance motor: it steps a synchronous
reluctance motor with random switches, 10 us a step. It is installed in FOLDER, by default a
temporary one.
"""

from __future__ import annotations

import csv
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from run import environment, measured

from reluctance.targets.gym import DriveEnv, DriveVectorEnv

PASSES = 5
STEPS = 300_000  # of drives in a pass

Policy = Callable[[NDArray[np.float32], np.random.Generator], NDArray[Any]]


def random(seen: NDArray[np.float32], rng: np.random.Generator) -> NDArray[Any]:
    return rng.integers(0, 3, (len(seen), 3))


def hysteresis(seen: NDArray[np.float32], rng: np.random.Generator) -> NDArray[Any]:
    theta = np.arctan2(seen[:, 4], seen[:, 3])[:, None] - 2 * np.pi * np.arange(3) / 3
    inside = (theta % (2 * np.pi)) < 2.5
    return np.where(inside, np.where(seen[:, :3] < 0.2, 2, 1), 0)


def currents(seen: NDArray[np.float32], rng: np.random.Generator) -> NDArray[Any]:
    theta = np.arctan2(seen[:, 4], seen[:, 3])[:, None] - 2 * np.pi * np.arange(3) / 3
    return np.where((theta % (2 * np.pi)) < 2.5, 0.2, 0.0)


def duties(seen: NDArray[np.float32], rng: np.random.Generator) -> NDArray[Any]:
    theta = np.arctan2(seen[:, 4], seen[:, 3])[:, None] - 2 * np.pi * np.arange(3) / 3
    inside = (theta % (2 * np.pi)) < 2.5
    return np.where(inside, np.clip(10 * (0.2 - seen[:, :3]), 0, 1), -1.0)


def single(action: str, policy: Policy) -> float:
    """Steps per second of one environment."""
    env, rng, best = DriveEnv(action=action), np.random.default_rng(0), 0.0  # type: ignore[arg-type]
    for _ in range(PASSES):
        seen, _ = env.reset(seed=0)
        spent, steps = 0.0, 20_000
        for _ in range(steps // 1000):
            chosen = [policy(seen[None], rng)[0] for _ in range(1000)]
            start = time.process_time()
            for one in chosen:
                seen, _, tripped, over, _ = env.step(one)
                if tripped or over:
                    seen, _ = env.reset()
            spent += time.process_time() - start
        best = max(best, steps / spent)
    return best


def many(count: int, action: str, policy: Policy) -> float:
    """The same of many at once."""
    envs = DriveVectorEnv(count, action=action)  # type: ignore[arg-type]
    rng, best = np.random.default_rng(0), 0.0
    for _ in range(PASSES):
        seen, _ = envs.reset(seed=0)
        spent, rounds = 0.0, max(STEPS // count, 3)
        for _ in range(rounds):
            chosen = policy(seen, rng)
            start = time.process_time()
            seen, *_ = envs.step(chosen)
            spent += time.process_time() - start
        best = max(best, rounds * count / spent)
    return best


def peer(folder: Path) -> float:
    """Steps per second of gym-electric-motor."""
    script, needs = "gem_steps.py", ["gym-electric-motor==3.0.3"]
    (found,) = measured(environment(folder, script, "python3.11", needs), script)
    return float(str(found["steps_per_cpu_s"]))


def main(folder: Path) -> None:
    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow(["case", "steps_per_cpu_s"])

    def tell(case: str, rate: float) -> None:
        writer.writerow([case, f"{float(f'{rate:.3g}'):.0f}"])
        sys.stdout.flush()

    for action, policy in (("legs", hysteresis), ("currents", currents)):
        tell(f"1 drive, {action}", single(action, policy))
    for count, action, policy in (
        (16, "legs", hysteresis),
        (256, "legs", hysteresis),
        (4096, "legs", hysteresis),
        (4096, "legs", random),
        (4096, "duties", duties),
        (4096, "currents", currents),
    ):
        drawn = " at random" if policy is random else ""
        tell(f"{count} drives, {action}{drawn}", many(count, action, policy))
    tell("gym-electric-motor 3.0.3", peer(folder))


if __name__ == "__main__":
    if len(sys.argv) > 1:
        main(Path(sys.argv[1]).absolute())
    else:
        with tempfile.TemporaryDirectory() as place:
            main(Path(place))
