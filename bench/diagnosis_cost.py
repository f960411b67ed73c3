"""What `diagnosis` and `flux_angle` add to a step: `python bench/diagnosis_cost.py` writes
diagnosis_cost.csv.

The samples of a start from rest, of bench/faults.toml, with a fault from the beginning go through
three packages on the emulated Cortex-M7: with the diagnosis, without, and with the angle by the
flux linkages besides. A row has the most that a sample cost more, of those where both run, and the
dearest sample of the first two. In doubt the diagnosis tries each phase, which the recorded
currents do not follow: its status is none of the fault's.
"""

import csv
import itertools
import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np

import reluctance as rl
from reluctance.base.files import scratch
from reluctance.targets.export import firmware
from reluctance.targets.export.recording import record
from reluctance.targets.export.target import build, replay

BENCH = Path(__file__).parent
sys.path.insert(0, str(BENCH))
import faults  # noqa: E402  of this folder

DRIVES = "6_4/deadbeat", "12_8/edge_mpc", "8_6/deadbeat", "6_4_pairs/deadbeat"
LATE_US = 1.0  # dead time with which the last one is judged as well
STEPS = 2500
START_DEG = 22.0
B_C = {"phase": "b", "other": "c"}
FAULTS: list[tuple[str, dict[str, Any]]] = [
    ("none", {}),
    ("encoder_reversed", {}),
    ("encoder_off", {"angle_deg": 30.0}),
    ("encoder_off", {"angle_deg": 90.0}),
    ("power_exchanged", B_C),
    ("sensors_exchanged", B_C),
    ("power_exchanged sensors_exchanged", B_C),
    ("sensor_gain", {"phase": "b", "gain": 0.7}),
    ("lower_shorted", {"phase": "b"}),
]


def start(name: str, dead_time_us: float = 0.0) -> rl.Drive:
    """A drive of the benchmark that starts from rest, without its states."""
    given = tomllib.loads((BENCH / "faults.toml").read_text(encoding="utf-8"))
    drive = faults.drive_of(name, 0.0, given)
    torque = {"reference.tau_Nm": None, "control.tau_max_Nm": drive.reference.tau_Nm}
    more = {"supervision.enable_s": None, "simulation.theta_start_deg": START_DEG}
    if dead_time_us > 0:
        more["converter.dead_time_us"] = dead_time_us
    return drive.with_values({**given["starts"]["values"], **torque, **more})


def words(fault: tuple[str, dict[str, Any]]) -> str:
    """How a fault stands in the table."""
    return " ".join([fault[0], *(str(value) for value in fault[1].values())])


def row(drive: rl.Drive, programs: list[Path], fault: tuple[str, dict[str, Any]]) -> dict[str, Any]:
    """One fault."""
    kinds = [] if fault[0] == "none" else fault[0].split()
    broken = drive.with_values({"faults": [{"kind": kind, **fault[1]} for kind in kinds]})
    samples = record(broken, steps=STEPS).samples
    named, plain, followed = (replay(program, "cortex-m7", samples) for program in programs)
    ends = [int(np.argmax(np.append(each.status, 1) != 0)) for each in (named, plain)]
    both = slice(0, min(ends))
    added = named.step[both].astype(int) - plain.step[both].astype(int)
    more = followed.step[: ends[0]].astype(int) - named.step[: ends[0]]
    return {
        "fault": words(fault),
        "samples": ends[0],
        "status": int(named.status.max()),
        "added_max": int(added.max()),
        "flux_angle_added_max": int(more.max()),
        "with_max": int(named.step[: ends[0] + 1].max()),
        "without_max": int(plain.step[: ends[1] + 1].max()),
    }


def rows(
    name: str, dead_time_us: float, chosen: list[tuple[str, dict[str, Any]]] = FAULTS
) -> list[dict[str, Any]]:
    """Faults of a drive."""
    drive = start(name, dead_time_us)
    with scratch() as place:
        programs = []
        for n, on in enumerate([(True, None), (False, None), (True, True)]):
            keys = ("protection.diagnosis", "protection.flux_angle")
            package = drive.with_values(dict(zip(keys, on, strict=True)))
            programs.append(build(firmware(package, place / str(n)).folder, "cortex-m7"))
        first = {"drive": name, "dead_time_us": dead_time_us}
        return [{**first, **row(drive, programs, fault)} for fault in chosen]


def main() -> None:
    """Every fault of every drive."""
    cases = [*((name, 0.0) for name in DRIVES), (DRIVES[-1], LATE_US)]
    found = list(itertools.chain.from_iterable(rows(*case) for case in cases))
    to = BENCH / "diagnosis_cost.csv"
    with to.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, found[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(found)
    print(to)


if __name__ == "__main__":
    main()
