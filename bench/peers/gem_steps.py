"""Processor time of an environment of gym-electric-motor, per step and per simulated second.

A synchronous reluctance motor with a finite control set, since it has no switched one: three-phase
bridge, 10 us of the solver a step, random actions, no plots.
"""

import json
import time

import gym_electric_motor as gem
import numpy as np

STEPS = 10_000
T_S = 10e-6  # a step [s]
JOB = (
    "a synchronous reluctance motor with constant inductances, random switches every 10 us, "
    "no controller; one solver step each"
)


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
    rate = float(np.max(rates))
    row = {"peer": "gym-electric-motor 3.0.3", "cpu_s_per_s": 1 / (rate * T_S), "job": JOB}
    print(json.dumps(row | {"steps_per_cpu_s": rate}))


if __name__ == "__main__":
    main()
