"""Steps per second of processor time of an environment of gym-electric-motor.

A synchronous reluctance motor with a finite control set, since it has no switched one: three-phase
bridge, 10 us of the solver a step, random actions, no plots.
"""

import json
import time

import gym_electric_motor as gem
import numpy as np

STEPS = 10_000


def main() -> None:
    env = gem.make("Finite-CC-SynRM-v0", visualization=None)
    env.action_space.seed(0)
    rates = []
    for _ in range(3):
        env.reset(seed=0)
        actions = [env.action_space.sample() for _ in range(STEPS)]
        start = time.process_time()
        for action in actions:
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()
        rates.append(STEPS / (time.process_time() - start))
    print(json.dumps({"steps_per_cpu_s": float(np.max(rates))}))


if __name__ == "__main__":
    main()
