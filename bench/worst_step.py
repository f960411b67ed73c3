"""The longest control step that a search finds, on the emulated Cortex-M7, protection included.

    python bench/worst_step.py                      writes bench/worst_step.csv
    python bench/worst_step.py "paper_mpc" ...      these laws anew, the other rows as they are

Four kinds of samples, each with a maximum of its own:

- random: anything within the ranges that the protection accepts, which no drive would measure. A
  controller that trips is started again.
- steps: closed loops whose torque reference jumps, motoring and braking, at random speeds.
- points: closed loops at twenty operating points, each from zero current on.
- climb: short sequences after a reset, at first those of the longest random steps. They are changed
  at random, and the longest ones of each generation are the parents of the next. Several small
  families climb, each by itself: a large one settles on the first plateau. The sequence that the
  file has already climbs with them, so that no search forgets what an earlier one found.

`sequence` is the worst of the climb: three samples after a reset, each with phase currents, angle,
speed, dc-link voltage, current of the source and reference. tests/targets/test_worst_step.py runs
it again.
Counts depend on the cross compiler only: arm-none-eabi-g++ 12.2.1. Two minutes a law.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import reluctance as rl
from reluctance.base.files import scratch
from reluctance.drive.drive import Drive
from reluctance.drive.guard.trip_levels import protection
from reluctance.targets.export import firmware
from reluctance.targets.export.recording import record
from reluctance.targets.export.target import build, replay

ROOT = Path(__file__).parents[1]
FILE = ROOT / "bench" / "worst_step.csv"
ONE_HP_8_6 = [
    *("machine=generic_1hp_8_6", "reference.tau_Nm=2", "control.tau_max_Nm=2.2"),
    "sensing.i_range_A=10",
]
BURST = 40  # random samples with an angle that goes on
CHUNK = 60_000  # random samples of a seed
RUN = 2500  # samples of a closed loop with steps
LENGTH = 3  # samples of a sequence of the climb
FAMILY = 20  # sequences that climb together
FEW = 15_000  # random samples of one more family, that the test climbs with too


@dataclass(frozen=True)
class Case:
    """A law as an example has it, and the most instructions that a step of it may take."""

    example: str
    overrides: tuple[str, ...]
    bound: int

    def drive(self) -> Drive:
        return rl.load(ROOT / "examples" / f"{self.example}.toml", list(self.overrides))


# 20 us of a core with 480 MHz hold 9 600 instructions at one cycle each. More than these take
# random samples of paper_mpc, and drives in which three or four phases have a choice at once.
CASES = {
    "edge_mpc with delay": Case("edge_mpc_mcu", (), 9_600),
    "edge_mpc with delay, 8/6": Case("edge_mpc_mcu", tuple(ONE_HP_8_6), 14_000),
    "finite_set_mpc, horizon 2": Case("finite_set_mpc", ("control.horizon=2",), 9_600),
    "finite_set_mpc, horizon 2, 3000 rpm": Case(
        "finite_set_mpc",
        ("control.horizon=2", "control.guide_speed_rpm=[1500,3000]", "load.speed_rpm=3000"),
        25_000,
    ),
    "finite_set_mpc, horizon 2, 8/6": Case(
        "finite_set_mpc", ("control.horizon=2", *ONE_HP_8_6), 95_000
    ),
    "deadbeat": Case("deadbeat", (), 2_500),
    "paper_mpc": Case("paper_rated", (), 12_500),
}


class Target:
    """The exported controller in the emulator; a step that trips resets it."""

    def __init__(self, drive: Drive, folder: Path) -> None:
        package = firmware(drive, folder / "package").folder
        program = package / "emulated" / "replay.cpp"
        text, step = program.read_text(), "  order.step = counted_step();\n"
        if step not in text:
            raise ValueError(f"{program} has another loop")
        again = "  if (order.status != 0) reluctance_init(&stepped);\n"
        program.write_text(text.replace(step, step + again))
        self.program = build(package, "cortex-m7")

    def count(self, samples: np.ndarray) -> np.ndarray:
        """Instructions of each step (n,)."""
        return replay(self.program, "cortex-m7", samples).step.astype(int)


def random_samples(drive: Drive, n: int, seed: int) -> np.ndarray:
    """Currents, angle, speed, voltage, current of the source, reference
    (n, n_phases + 5), all at random."""
    rng = np.random.default_rng(seed)
    N, machine, at = drive.machine.n_phases, drive.machine, protection(drive).levels
    rows = np.empty((n, N + 5), np.float32)
    for first in range(0, n, BURST):
        theta_e = rng.uniform(0, 2 * np.pi)
        omega_m = rng.uniform(-1, 1) * at.omega_max
        u_dc = rng.uniform(0.7, 1.2) * drive.converter.u_dc_V
        for j in range(first, min(first + BURST, n)):
            if j == first or rng.random() < 0.5:
                i = rng.uniform(0, 1.1 * machine.i_max_A, N) * (rng.random(N) > 0.3)
            if j == first or rng.random() < 0.2:
                tau_ref = rng.uniform(-1, 1) * drive.tau_max * (rng.random() > 0.1)
            rows[j] = [*i, theta_e, omega_m, u_dc, 0.0, tau_ref]
            theta_e = (theta_e + machine.N_r * omega_m * drive.control.T_s) % (2 * np.pi)
    return rows


def torque_steps(drive: Drive, n: int) -> Iterator[np.ndarray]:
    """The samples of closed loops whose reference changes every millisecond or so, motoring and
    braking, at a random speed in each."""
    rng = np.random.default_rng(2)
    for _ in range(max(n // RUN, 1)):
        t = np.cumsum(rng.uniform(0.1e-3, 2e-3, 50))
        values = rng.uniform(-1, 1, 51) * drive.tau_max * (rng.random(51) > 0.15)
        course = {
            "tau_Nm": None,
            "t_s": [0.0, *np.repeat(t, 2).tolist()],
            "values": [*np.repeat(values[:-1], 2).tolist(), values[-1]],
        }
        speed_rpm = rng.uniform(-1, 1) * 1.2 * drive.load.speed_rpm
        yield record(_at(drive, speed_rpm, course), steps=RUN).samples


def operating_points(drive: Drive) -> Iterator[np.ndarray]:
    """The samples of closed loops at five speeds and four torques, 0.02 s of each."""
    for speed in (-1.2, 0.1, 0.5, 1.0, 1.2):
        for torque in (1.0, 0.5, 0.1, -0.5):
            tau_Nm = torque * (drive.reference.tau_Nm or drive.tau_max)
            run = _at(drive, speed * drive.load.speed_rpm, {"tau_Nm": tau_Nm})
            yield record(run, steps=round(0.02 / drive.control.T_s)).samples


def _at(drive: Drive, speed_rpm: float, reference: dict[str, Any]) -> Drive:
    return replace(
        drive,
        reference=drive.reference.model_copy(update=reference),
        load=drive.load.model_copy(update={"speed_rpm": speed_rpm}),
    )


def worst_random(drive: Drive, target: Target, n: int) -> tuple[int, np.ndarray]:
    """The most of n samples, and the sequences before the longest steps
    (some, LENGTH, n_phases + 5)."""
    most, sequences, counts = 0, [], []
    for seed in range(1, 1 + -(-n // CHUNK)):
        samples = random_samples(drive, min(CHUNK, n - (seed - 1) * CHUNK), seed)
        found = target.count(samples)
        most = max(most, int(found.max()))
        inside = np.arange(len(found)) % BURST >= LENGTH - 1
        for at in np.argsort(np.where(inside, found, 0))[-20:]:
            sequences.append(samples[at - LENGTH + 1 : at + 1])
            counts.append(found[at])
    return most, np.array(sequences)[np.argsort(counts)[-100:]]


def longest(target: Target, sequences: np.ndarray) -> np.ndarray:
    """The longest step of each sequence (n,), every one after a reset."""
    n, length, width = sequences.shape
    rows = np.full((n, 1 + length, width), np.nan, np.float32)  # NaN trips
    rows[:, 1:] = sequences
    counts = target.count(rows.reshape(-1, width)).reshape(n, -1)
    return np.asarray(counts[:, 1:].max(axis=1))


def climb(
    drive: Drive, target: Target, start: np.ndarray, *, generations: int, children: int
) -> tuple[int, np.ndarray]:
    """The most that changes at random lead to from sequences (n, LENGTH, n_phases + 5), and the
    sequence of it."""
    rng = np.random.default_rng(3)
    N, at = drive.machine.n_phases, protection(drive).levels
    best, found = start, longest(target, start)
    for _ in range(generations):
        new = best[rng.integers(len(best), size=children)].copy()
        size = 10 ** rng.uniform(-4, -0.3, (children, 1))
        which = rng.random((children, LENGTH, N)) < 0.3
        noise = rng.standard_normal(which.shape) * which * size[..., None]
        new[..., :N] += noise * drive.machine.i_max_A
        new[..., :N] = np.clip(new[..., :N], 0, 1.1 * drive.machine.i_max_A)
        new[..., :N] *= rng.random(which.shape) > 0.02
        theta_e, omega_m, u_dc, tau_ref = (new[:, :1, N + j].copy() for j in (0, 1, 2, 4))
        more = rng.standard_normal((4, children, 1)) * (rng.random((4, children, 1)) < 0.3) * size
        omega_m = np.clip(omega_m + more[0] * at.omega_max, -at.omega_max, at.omega_max)
        u_dc = np.clip(u_dc / drive.converter.u_dc_V + more[1], 0.7, 1.2) * drive.converter.u_dc_V
        tau_ref = new[..., N + 4] + more[2] * drive.tau_max * (rng.random((children, LENGTH)) < 0.5)
        turned = drive.machine.N_r * omega_m * drive.control.T_s * np.arange(LENGTH)
        new[..., N] = (theta_e + more[3] * np.pi + turned) % (2 * np.pi)
        new[..., N + 1], new[..., N + 2] = omega_m, u_dc
        new[..., N + 4] = np.clip(tau_ref, -drive.tau_max, drive.tau_max)
        best = np.concatenate([best, new])
        found = np.concatenate([found, longest(target, new)])
        keep = np.argsort(found, kind="stable")[-len(start) :]
        best, found = best[keep], found[keep]
    return int(found[-1]), best[-1]


def as_text(sequence: np.ndarray) -> str:
    return "; ".join(" ".join(str(x) for x in sample) for sample in sequence)


def as_sequence(text: str) -> np.ndarray:
    return np.array([sample.split() for sample in text.split(";")], np.float32)


def row(name: str, case: Case, known: str | None) -> dict[str, object]:
    """What the search finds for a law; known: the worst sequence of an earlier search."""
    drive = case.drive()
    with scratch() as place:
        target = Target(drive, place)
        random, start = worst_random(drive, target, 1_000_000)
        steps = max(int(target.count(x).max()) for x in torque_steps(drive, CHUNK))
        points = [int(target.count(x).max()) for x in operating_points(drive)]
        _, early = worst_random(drive, target, FEW)
        if known:
            early = np.concatenate([early, as_sequence(known)[None]])
        families = [early, *np.split(start, range(FAMILY, len(start), FAMILY))]
        climbs = [climb(drive, target, x, generations=30, children=500) for x in families]
        found, sequence = max(climbs, key=lambda climbed: climbed[0])
    return {
        **{"law": name, "drive": case.example, "set": " ".join(case.overrides)},
        **{"random_samples": 1_000_000, "random": random, "steps": steps},
        **{"operating_points": len(points), "points": max(points), "climb": found},
        **{"found": max(random, steps, *points, found), "bound": case.bound},
        "sequence": as_text(sequence),
    }


def main() -> None:
    names = sys.argv[1:]
    known: dict[str, dict[str, str]] = {}
    if FILE.exists():
        with FILE.open() as file:
            known = {found["law"]: found for found in csv.DictReader(file)}
    rows = [
        row(name, case, known.get(name, {}).get("sequence"))
        if not names or name in names
        else known[name]
        for name, case in CASES.items()
    ]
    with FILE.open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
