"""The angle by the flux linkages: `python bench/flux_angle.py` writes bench/flux_angle.csv.

Drives of bench/faults.toml at a held speed for half a second, once with a control that knows its
machine, and once with one that believes 1/1.15 of the resistance, 1/0.94 of the flux linkage, and
has a zero of the angle sensor that is off by 1.5 deg. A row has the error of the angle over the
second half, and what is found at the end: the zero, and flux linkage and resistance over those that
are believed. `slip_deg` is by how much the angle shown has fallen behind when a drive that loses
0.5 % of its counts trips, the median of four instants; empty where one runs on for 90 deg.
"""

import csv
import sys
import tomllib
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

import reluctance as rl

BENCH = Path(__file__).parent
sys.path.insert(0, str(BENCH))
import faults  # noqa: E402  of this folder

SPEEDS = 100, 300, 1500, -1500
SENSORS = {"4096 counts": {}, "512 counts": {"sensing.encoder_counts": 512}}
WRONG = {
    "mismatch.R_factor": 1 / 1.15,
    "mismatch.flux_factor": 1 / 0.94,
    "mismatch.angle_offset_deg": 1.5,
}
LOST = 0.005  # of the counts
GIVES_UP = 90.0  # deg electrical of slip


def drive(name: str, sensor: str, speed: float, knows: bool) -> rl.Drive:
    """One drive with its angle by the flux linkages."""
    given = tomllib.loads((BENCH / "faults.toml").read_text(encoding="utf-8"))
    values = {**SENSORS[sensor], **({} if knows else WRONG), "protection.flux_angle": True}
    return faults.drive_of(name, float(speed), given).with_values(values)


def row(case: tuple[str, str, float, bool]) -> dict[str, Any]:
    """What is found of a drive."""
    name, sensor, speed, knows = case
    made = drive(*case)
    result = rl.simulate(made, until=0.6, record=made.control.T_s)
    assert result.estimate is not None
    found = result.estimate.figures()
    assert found is not None and result.events is not None
    figures = {key: f"{value:.3f}" for key, value in found.items()}
    status = result.events[-1].status
    keys = {"drive": name, "sensor": sensor, "speed_rpm": speed, "knows": knows}
    slips = {"slip_deg": slip(made), "slip_without_deg": slip(made, flux_angle=None)}
    return {**keys, **figures, "status": status, **slips}


def slip(made: rl.Drive, flux_angle: bool | None = True) -> str:
    """Median slip at which a drive trips that loses counts [deg electrical]; empty where it does
    not, or not always."""
    given = tomllib.loads((BENCH / "faults.toml").read_text(encoding="utf-8"))
    period = 60 / abs(made.load.speed_rpm * made.machine.N_r)
    slips = []
    for angle in given["instants_deg"][::2]:
        at = {"t_s": 0.15, "phase": faults.PHASE, "theta_e_deg": float(angle)}
        lost = {**at, "kind": "encoder_lost_counts", "part": LOST}
        values = {"faults": [lost], "protection.flux_angle": flux_angle}
        result = rl.simulate(
            made.with_values(values), until=0.15 + (1 + GIVES_UP / 360 / LOST) * period, record=None
        )
        tripped = [event.t for event in result.events or [] if event.mode == "fault"]
        if not tripped:
            return ""
        slips.append(360 * LOST * (tripped[0] - result.faults[0][0]) / period)
    return f"{np.median(slips):.1f}"


def main() -> None:
    """Every drive."""
    names = tomllib.loads((BENCH / "faults.toml").read_text(encoding="utf-8"))["drives"]
    cases = [
        (name, sensor, speed, knows)
        for name in names
        for sensor in SENSORS
        for speed in SPEEDS
        for knows in (True, False)
    ]
    with ProcessPoolExecutor() as pool:
        found = list(pool.map(row, cases))
    to = BENCH / "flux_angle.csv"
    with to.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, found[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(found)
    print(to)


if __name__ == "__main__":
    main()
