"""Wrong wiring of drives drawn at random: `python bench/wiring.py [SEED]` writes bench/wiring.csv.

Machines of the library, laws, voltages, loads, noise, periods and rotor angles are drawn, and so is
what is wrong: power cables or current sensors of two phases exchanged, an encoder that runs
backwards, its zero off by 20.5 deg or more; or nothing. Each drive starts from rest to 300 rpm. A
row has the status and its time since the state `run`, and the greatest current. Its drive follows
from its seed: SEED and the number of the row.
"""

import csv
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

import reluctance as rl
from reluctance import _core
from reluctance.base.phases import LETTERS

ROOT = Path(__file__).parents[1]
MACHINES = (
    *("design_10_8", "design_12_8", "emdlab_6_4_6kw", "emdlab_8_6", "generic_1hp_8_6"),
    *("generic_60kw_6_4", "guc_linear_6_4", "npf_vector_6_4", "onelab_6_4", "own_10_8"),
    *("own_12_8", "own_18_12", "paper_6_4"),
)
LAWS = "angles", "torque_sharing", "deadbeat", "pwm_current", "edge_mpc"
NAMES: dict[str, set[int]] = {  # at rest the direction is one with the zero
    "none": {0},
    "power_exchanged": {18},
    "sensors_exchanged": {18},
    "encoder_reversed": {16, 17},
    "encoder_off": {16, 17},
    "encoder_off, small": {16, 17},
}
OMEGA = 300 * 2 * np.pi / 60  # [rad/s]
SEED, ROWS = 7100, 72
COLUMNS = (
    *("seed", "machine", "law", "wrong", "angle_deg", "theta_e_deg", "u_dc_V", "T_s_us"),
    *("status", "right", "ms", "i_peak_over_i_max"),
)


def sound(of: np.random.Generator, name: str, seed: int) -> rl.Drive:
    """A supervised drive with a machine of the library, nothing wrong with it."""
    values: dict[str, Any] = {
        **{"machine": name, "reference.tau_Nm": 1.0},
        **{"sensing.i_range_A": 1e3, "load.kind": "fan", "load.k_fan_Nms2": 1.0},
    }
    base = rl.load(ROOT / "examples" / "edge_mpc_mcu.toml").with_values(values)
    machine = base.machine
    i = np.linspace(0.0, 0.7 * machine.i_max_A, 40)
    psi = [_core.magnetics(machine.magnetics, i, np.full(40, at))[:, 0] for at in (0.0, np.pi)]
    strokes = machine.n_phases * machine.N_r / (2 * np.pi)  # a radian
    tau = 0.6 * strokes * float(np.trapezoid(psi[1] - psi[0], i))
    u_dc = float(psi[1][-1] / 1.5e-3 * of.uniform(0.6, 1.5))
    values |= {
        **{"control.law": LAWS[of.integers(len(LAWS))], "control.tau_max_Nm": tau},
        **{"control.T_s_us": float(of.choice([20, 40])), "converter.u_dc_V": u_dc},
        **{"sensing.i_range_A": 1.4 * machine.i_max_A, "sensing.u_dc_noise_V": u_dc / 300},
        **{"sensing.i_noise_LSB": float(of.uniform(1, 8)), "sensing.noise_seed": seed},
        **{"load.J_kgm2": tau * float(of.uniform(0.06, 0.2)) / OMEGA, "load.speed_rpm": 0.0},
        **{"load.k_fan_Nms2": tau * float(of.uniform(0.05, 0.5)) / OMEGA**2},
        **{"reference.tau_Nm": None, "reference.kind": "speed", "reference.speed_rpm": 300},
        **{"simulation.theta_start_deg": float(of.uniform(0, 360 / machine.N_r))},
        **{"protection.diagnosis": True, "supervision.enable_s": 0.0},
    }
    return base.with_values(values)


def drawn(seed: int) -> tuple[str, str, rl.Drive]:
    """The name of the machine, what is wrong, and the drive."""
    of = np.random.default_rng(seed)
    wrong = list(NAMES)[of.integers(len(NAMES))]
    name = MACHINES[of.integers(len(MACHINES))]
    drive = sound(of, name, seed)
    two = [LETTERS[k] for k in of.choice(drive.machine.n_phases, 2, replace=False)]
    angle = of.choice([-1, 1]) * of.uniform(*((20.5, 30) if "small" in wrong else (30, 180)))
    fault: dict[str, Any] = {"kind": wrong.split(",")[0]}
    if "exchanged" in wrong:
        fault |= {"phase": two[0], "other": two[1]}
    if "off" in wrong:
        fault |= {"angle_deg": float(angle)}
    return name, wrong, drive.with_values({"faults": [] if wrong == "none" else [fault]})


def row(seed: int) -> dict[str, Any]:
    """One drive."""
    name, wrong, drive = drawn(seed)
    result = rl.simulate(drive, until=0.45, record=drive.control.T_s)
    events = result.events or []
    began = next(event.t for event in events if event.mode == "run")
    fault = next((event for event in events if event.mode == "fault"), None)
    status = 0 if fault is None else fault.status
    off = drive.faults.each[0].angle_deg if "off" in wrong else None
    theta_e = drive.machine.N_r * drive.simulation.theta_start_deg
    found = (
        *(seed, name, drive.control.law, wrong, "" if off is None else f"{off:.1f}"),
        *(f"{theta_e % 360:.0f}", f"{drive.converter.u_dc_V:.0f}", drive.control.T_s_us, status),
        *(int(status in NAMES[wrong]), "" if fault is None else f"{1e3 * (fault.t - began):.2f}"),
        f"{float(result.i[:, result.t >= began].max()) / drive.machine.i_max_A:.2f}",
    )
    return dict(zip(COLUMNS, found, strict=True))


def main() -> None:
    """Every drive on all cores."""
    seed = int(sys.argv[1]) if len(sys.argv) > 1 else SEED
    to = ROOT / "bench" / "wiring.csv"
    with to.open("w", newline="", encoding="utf-8") as file, ProcessPoolExecutor() as pool:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        for found in pool.map(row, range(seed, seed + ROWS)):
            writer.writerow(found)
            print(*found.values(), sep=", ", flush=True)
    print(f"seed {seed}: {to}")


if __name__ == "__main__":
    main()
