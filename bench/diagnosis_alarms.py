"""Sound drives that say what broke: `python bench/diagnosis_alarms.py [SEED]` writes its table.

    python bench/diagnosis_alarms.py --drawn [SEED]

Laws x machines x angle sensors x directions, each with a start from rest, a ramp, a reversal and
another ramp, against a fan. Current sensors, resistance, flux linkage and the zero of the angle are
wrong by nearly what the drive file states. A row counts strokes of all phases, and says the status
of a fault: those of DIAGNOSIS are false alarms, others end a run for a reason of the law. The noise
of a row has the seed that it shows: SEED and the number of the row.

With `--drawn` machines of the whole library, laws, voltages, loads, speeds, angle sensors, periods
and errors follow from the seed of a row: bench/diagnosis_drawn.csv.
"""

import argparse
import csv
import itertools
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

import reluctance as rl

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "bench"))
import wiring  # noqa: E402

LAWS = "angles", "torque_sharing", "ditc", "deadbeat", "pwm_current", "edge_mpc", "finite_set_mpc"
DIAGNOSIS = {8, 9, 10, 11, 16, 17, 18, 19, 20}
MACHINES: dict[str, dict[str, Any]] = {
    "paper_6_4": {"sensing.i_range_A": 200, "control.tau_max_Nm": 41.0},
    "own_12_8": {
        **{"converter.u_dc_V": 300, "sensing.i_range_A": 100},
        **{"control.tau_max_Nm": 12.0},
    },
    "generic_1hp_8_6": {
        **{"sensing.i_range_A": 10, "control.tau_max_Nm": 2.2},
        **{"load.J_kgm2": 0.002, "load.k_fan_Nms2": 1e-4},
    },
    "onelab_6_4_pairs": {  # its phases couple
        **{"converter.u_dc_V": 285, "sensing.i_range_A": 15, "control.tau_max_Nm": 4.4},
        **{"load.J_kgm2": 0.003, "load.k_fan_Nms2": 1.5e-4},
    },
}
SENSORS: dict[str, dict[str, Any]] = {
    **{f"{n} counts": {"sensing.encoder_counts": n} for n in (512, 1024, 4096, 16384)},
    "hall": {"sensing.encoder_counts": 0, "sensing.hall": True},
    "ideal": {"sensing.encoder_counts": 0},
}
COURSE = [0.0, 0.25, 0.25, 0.45], [600.0, 900.0, -600.0, -300.0]  # [s], [rpm]
WRONG = {  # nearly what is stated: 20 %, 10 %, 2 deg; gain and offset are stated themselves
    **{"mismatch.R_factor": 0.85, "mismatch.flux_factor": 0.93, "mismatch.angle_offset_deg": 1.5},
}
GAINS = [1.02, 0.98, 1.0, 1.01]
SEED = 20273  # of the first row, where none is given
DRAWN, DRAWN_SEED = 340, 712800  # rows, and their first seed
EVERY_LAW = (*LAWS, "paper_mpc")
EVERY_MACHINE = (*wiring.MACHINES, "onelab_6_4_pairs", "emdlab_6_4_6kw_pairs")
COLUMNS = (
    *("law", "machine", "angle", "direction", "seed"),
    *("simulated_s", "strokes", "false_alarms", "status"),
)


def drive_of(law: str, machine: str, sensor: str, direction: int) -> rl.Drive:
    """A supervised drive with its diagnosis, and the angle by the flux linkages."""
    values = {
        **{"control.law": law, "machine": machine, "reference.tau_Nm": None},
        **{"sensing.i_noise_LSB": 8.0, "sensing.u_dc_noise_V": 1.0, "supervision.enable_s": 0.0},
        **{"load.kind": "fan", "load.k_fan_Nms2": 1e-3, "load.J_kgm2": 0.01},
        **{"load.speed_rpm": 0.0, "reference.kind": "speed"},
        **{"protection.diagnosis": True, "protection.flux_angle": True},
        **{"reference.t_s": COURSE[0], "reference.values": [direction * n for n in COURSE[1]]},
    }
    base = rl.load(ROOT / "examples" / "edge_mpc_mcu.toml")
    drive = base.with_values({**values, **MACHINES[machine], **SENSORS[sensor], **WRONG})
    return drive.with_values({"sensing.i_gain": GAINS[: drive.machine.n_phases]})


def row(case: tuple[str, str, str, int], seed: int = SEED, until: float = 0.5) -> dict[str, Any]:
    """One drive."""
    drive = drive_of(*case).with_values({"sensing.noise_seed": seed})
    return judged(case, drive, seed, until)


def drawn(seed: int) -> dict[str, Any]:
    """One drive that follows from its seed: a start, steps, ramps and a reversal."""
    of = np.random.default_rng(seed)
    machine = EVERY_MACHINE[of.integers(len(EVERY_MACHINE))]
    drive = wiring.sound(of, machine, seed)
    law, sensor = EVERY_LAW[of.integers(len(EVERY_LAW))], list(SENSORS)[of.integers(len(SENSORS))]
    direction, rpm, tau = int(of.choice([-1, 1])), of.uniform(300, 2500), drive.tau_max
    omega = rpm * 2 * np.pi / 60
    steps = (0.2, 1.0, 0.5, 0.8, -1.0, -0.3)
    values: dict[str, Any] = {
        **{"control.law": law, "reference.speed_rpm": None, **SENSORS[sensor]},
        **{"load.k_fan_Nms2": tau * of.uniform(0.05, 0.4) / omega**2},
        **{"load.J_kgm2": tau * of.uniform(0.03, 0.1) / omega},
        **{"reference.t_s": [0.0, 0.35, 0.35, 0.7, 0.7, 1.0]},
        **{"reference.values": [float(direction * rpm * part) for part in steps]},
        **{"mismatch.R_factor": of.uniform(0.84, 1.16)},
        **{"mismatch.flux_factor": of.uniform(0.92, 1.08)},
        **{"mismatch.angle_offset_deg": of.uniform(-1.7, 1.7)},
        **{"protection.flux_angle": True},
    }
    single = {key: float(x) if isinstance(x, np.floating) else x for key, x in values.items()}
    gains = [float(gain) for gain in of.uniform(0.98, 1.02, drive.machine.n_phases)]
    drive = drive.with_values({**single, "sensing.i_gain": gains})
    return judged((law, machine, sensor, direction), drive, seed, 1.2)


def judged(
    case: tuple[str, str, str, int], drive: rl.Drive, seed: int, until: float
) -> dict[str, Any]:
    """A row of the table."""
    result = rl.simulate(drive, until=until, record=1e-3)
    fault = next((event for event in result.events or [] if event.mode == "fault"), None)
    end = until if fault is None else fault.t
    turned = np.trapezoid(np.abs(result.omega_m), result.t) / (2 * np.pi)
    status = 0 if fault is None else fault.status
    strokes = int(turned * drive.machine.N_r * drive.machine.n_phases)
    return dict(
        zip(COLUMNS, (*case, seed, end, strokes, int(status in DIAGNOSIS), status), strict=True)
    )


def main() -> None:
    """Every case on all cores."""
    ask = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    ask.add_argument("seed", nargs="?", type=int)
    ask.add_argument("--drawn", action="store_true")
    given = ask.parse_args()
    seed = given.seed or (DRAWN_SEED if given.drawn else SEED)
    cases = list(itertools.product(LAWS, MACHINES, SENSORS, (1, -1)))
    to = ROOT / "bench" / f"diagnosis_{'drawn' if given.drawn else 'alarms'}.csv"
    with to.open("w", newline="", encoding="utf-8") as file, ProcessPoolExecutor() as pool:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        rows = (
            pool.map(drawn, range(seed, seed + DRAWN))
            if given.drawn
            else pool.map(row, cases, itertools.count(seed))
        )
        writer.writerows(rows)
    print(to)


if __name__ == "__main__":
    main()
