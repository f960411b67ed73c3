"""Question: can a small policy, learned in minutes, follow a torque as well as our laws do?

    python studies/gym_policy.py [--learn]

Plays the control laws of the examples and a learned policy in the same episodes of the environment
reluctance/Torque-v0, all at the same control period, and writes docs/gymnasium/policies.csv.
`--learn` learns the policy anew (docs/gymnasium/policy.json) by an evolution strategy that adapts
the covariance of its members: N. Hansen, The CMA evolution strategy: a tutorial, arXiv:1604.00772.

The policy gives the current reference of a phase from its electrical angle and the torque
reference: two Fourier series, one times the root of the reference, one times the reference. All
phases share it. It sees neither current nor speed.
"""

from __future__ import annotations

import argparse
import csv
import json
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import reluctance as rl
from reluctance.targets.gym import DriveEnv, DriveVectorEnv, LawPolicy, Played, played
from reluctance.targets.gym.law import summary

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "docs" / "gymnasium"
EXAMPLE = ROOT / "examples" / "sharing_cubic.toml"
JUDGED = range(1000, 1016)  # seeds of the episodes in the table; learning never sees them
T_S_US = 20.0
LAWS: dict[str, tuple[str, dict[str, Any]]] = {  # example, and what it changes
    "pwm_current": ("pwm_current", {}),
    "torque_sharing, cubic": ("sharing_cubic", {}),
    "torque_sharing, optimal": ("sharing_cubic", {"control.sharing": "optimal"}),
    "ditc": ("ditc", {}),
    "deadbeat": ("deadbeat", {}),
    "paper_mpc": ("paper_rated", {}),
    "finite_set_mpc": ("finite_set_mpc", {}),
    "edge_mpc": ("edge_mpc_fpga", {}),
}
HARMONICS = 6
MEMBERS, EPISODES = 32, 12  # of a generation; of each member
GENERATIONS, SIGMA = 200, 0.03
LENGTH = 600  # control periods of an episode while learning


def features(observations: NDArray[np.float32], n_phases: int) -> NDArray[np.float64]:
    """Of each phase: (episodes, n_phases, 2 (2 HARMONICS + 1))."""
    z = observations[:, n_phases] + 1j * observations[:, n_phases + 1]
    shift = np.exp(-2j * np.pi * np.arange(n_phases) / n_phases)
    powers = (z[:, None] * shift)[..., None] ** np.arange(HARMONICS + 1)
    series = np.concatenate([powers.real, powers.imag[..., 1:]], axis=-1)
    tau = np.maximum(observations[:, -1], 0.0)[:, None, None]
    return np.concatenate([np.sqrt(tau) * series, tau * series], axis=-1)


def actions(weights: NDArray[np.float64], observed: NDArray[np.float64]) -> NDArray[np.float64]:
    """Current references over the limit; weights (members, numbers), members in equal parts of the
    rows."""
    members = len(weights)
    rows = observed.reshape(members, -1, observed.shape[-1])
    return np.clip(rows @ weights[:, :, None], 0.0, 1.0).reshape(observed.shape[:2])


def returns(many: DriveVectorEnv, weights: NDArray[np.float64], seeds: list[int]) -> Any:
    """Mean reward of each member over the same episodes."""
    n_phases = many.episodes.drive.machine.n_phases
    observations, _ = many.reset(seed=seeds * len(weights))
    sums, alive = np.zeros(many.num_envs), np.ones(many.num_envs, bool)
    for _ in range(many.episodes.length):
        chosen = actions(weights, features(observations, n_phases))
        observations, rewards, tripped, _, _ = many.step(chosen)
        sums += np.where(alive, rewards, 0.0)
        alive &= ~tripped
    return sums.reshape(len(weights), -1).mean(axis=1) / many.episodes.length


def flat_pulse() -> NDArray[np.float64]:
    """Where learning begins: half of the current limit from 0 to 150 degrees at full torque."""
    theta = np.radians(np.arange(0.5, 360))
    j = np.arange(1, HARMONICS + 1)[:, None]
    pulse = np.where(theta < np.radians(150), 0.5, 0.0)
    series = [
        [pulse.mean()],
        *(2 * (pulse * wave(j * theta)).mean(axis=1) for wave in (np.cos, np.sin)),
    ]
    return np.concatenate([*series, np.zeros(2 * HARMONICS + 1)])


class Strategy:
    """Where members are drawn; eq. numbers of the tutorial."""

    def __init__(self, centre: NDArray[np.float64], sigma: float) -> None:
        n = len(centre)
        self.centre, self.sigma, self.C = centre, sigma, np.eye(n)
        self.path_c, self.path_s, self.generation = np.zeros(n), np.zeros(n), 0
        raw = np.log(MEMBERS / 2 + 0.5) - np.log(np.arange(1, MEMBERS // 2 + 1))
        self.w = raw / raw.sum()
        mu = 1 / (self.w**2).sum()
        self.c_s = (mu + 2) / (n + mu + 5)
        self.d_s = 1 + 2 * max(0.0, np.sqrt((mu - 1) / (n + 1)) - 1) + self.c_s
        self.c_c = (4 + mu / n) / (n + 4 + 2 * mu / n)
        self.c_1 = 2 / ((n + 1.3) ** 2 + mu)
        self.c_mu = min(1 - self.c_1, 2 * (mu - 2 + 1 / mu) / ((n + 2) ** 2 + mu))
        self.mu, self.norm = mu, np.sqrt(n) * (1 - 1 / (4 * n) + 1 / (21 * n**2))

    def members(self, rng: np.random.Generator) -> NDArray[np.float64]:
        scale, self.axes = np.linalg.eigh(self.C)
        self.root = np.sqrt(np.maximum(scale, 1e-20))
        y = (rng.standard_normal((MEMBERS, len(self.centre))) * self.root) @ self.axes.T
        return self.centre + self.sigma * np.asarray(y)

    def learn(self, members: NDArray[np.float64], found: NDArray[np.float64]) -> None:
        """Eqs. 41 to 47 without negative weights."""
        self.generation += 1
        best = members[np.argsort(-found)[: len(self.w)]]
        y = (best - self.centre) / self.sigma
        step = self.w @ y
        self.centre = self.centre + self.sigma * step
        whitened = self.axes @ ((self.axes.T @ step) / self.root)
        self.path_s = (1 - self.c_s) * self.path_s + np.sqrt(
            self.c_s * (2 - self.c_s) * self.mu
        ) * whitened
        length = np.linalg.norm(self.path_s)
        settled = np.sqrt(1 - (1 - self.c_s) ** (2 * self.generation))
        h = 1.0 if length / settled < (1.4 + 2 / (len(step) + 1)) * self.norm else 0.0
        gain = h * np.sqrt(self.c_c * (2 - self.c_c) * self.mu)
        self.path_c = (1 - self.c_c) * self.path_c + gain * step
        kept = 1 - self.c_1 - self.c_mu + (1 - h) * self.c_1 * self.c_c * (2 - self.c_c)
        self.C = (
            kept * self.C
            + self.c_1 * np.outer(self.path_c, self.path_c)
            + self.c_mu * (y.T * self.w) @ y
        )
        self.sigma *= float(np.exp(self.c_s / self.d_s * (length / self.norm - 1)))


def learn(drive: rl.Drive) -> tuple[NDArray[np.float64], dict[str, Any]]:
    """Weights, and what they cost to find."""
    many = DriveVectorEnv(MEMBERS * EPISODES, drive, action="currents", length=LENGTH)
    rng, strategy = np.random.default_rng(0), Strategy(flat_pulse(), SIGMA)
    start = time.process_time()
    for n in range(1, GENERATIONS + 1):
        members = strategy.members(rng)
        seeds = [int(s) for s in rng.integers(1 << 30, size=EPISODES)]
        found = returns(many, members, seeds)
        strategy.learn(members, found)
        if n % 10 == 0:
            print(f"generation {n}: mean reward {found.mean():.6f}", flush=True)
    cost = {
        "cpu_s": round(time.process_time() - start, 1),
        "steps": GENERATIONS * MEMBERS * EPISODES * LENGTH,
        "generations": GENERATIONS,
    }
    return strategy.centre, cost


def learned(env: DriveEnv, weights: NDArray[np.float64], seeds: range) -> Played:
    """Episodes under the policy."""
    rewards, infos, trips = [], [], 0
    for seed in seeds:
        observation, _ = env.reset(seed=seed)
        total, steps, ended = 0.0, 0, False
        while not ended:
            observed = features(observation[None], env.episodes.drive.machine.n_phases)
            observation, reward, tripped, over, info = env.step(actions(weights[None], observed)[0])
            total, steps, ended = total + reward, steps + 1, tripped or over
        rewards.append(total / steps)
        infos.append(info)
        trips += tripped
    return summary(rewards, infos, trips)


def law_drive(name: str) -> rl.Drive:
    """The drive of a law of the table, at the common control period."""
    example, changes = LAWS[name]
    drive = rl.load(ROOT / "examples" / f"{example}.toml")
    return drive.with_values({"control.T_s_us": T_S_US, **changes})


def environment() -> DriveEnv:
    """Where all policies are judged."""
    return DriveEnv(rl.load(EXAMPLE), task="torque", action="currents")


def saved() -> NDArray[np.float64]:
    """The weights of the policy that was learned."""
    return np.array(json.loads((FOLDER / "policy.json").read_text())["weights"])


def row(name: str, one: Played) -> list[str]:
    return [
        name,
        f"{1e3 * one.reward:.3f}",
        f"{100 * one.torque_error_rms:.2f}",
        f"{one.p_cu:.0f}",
        f"{one.f_switch / 1e3:.2f}",
        str(one.tripped),
    ]


HEAD = ["policy", "reward_1e-3", "torque_error_rms_pct", "p_cu_W", "f_switch_kHz", "tripped"]


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--learn", action="store_true")
    FOLDER.mkdir(exist_ok=True)
    if parser.parse_args().learn:
        weights, cost = learn(rl.load(EXAMPLE))
        found = {"weights": [round(float(w), 6) for w in weights]}
        (FOLDER / "policy.json").write_text(json.dumps(found, indent=1) + "\n")
        lines = [["policy", *cost], ["learned", *map(str, cost.values())]]
        write(FOLDER / "learning.csv", lines)
    env = environment()
    rows = []
    for name in LAWS:
        rows.append(row(name, played(env, LawPolicy(law_drive(name)), JUDGED)))
        print(*rows[-1], flush=True)
    rows.append(row("learned, Fourier series of the angle", learned(env, saved(), JUDGED)))
    print(*rows[-1], flush=True)
    rows.sort(key=lambda r: -float(r[1]))
    write(FOLDER / "policies.csv", [HEAD, *rows])


def write(path: Path, lines: list[list[str]]) -> None:
    with path.open("w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(lines)


if __name__ == "__main__":
    main()
