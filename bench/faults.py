"""What the protection finds of each fault: `make benchmark-faults` writes bench/faults.csv.

    python bench/faults.py [CASES.toml] [--out FILE.csv]

The cases are in bench/faults.toml: drives, speeds, faults and instants; and starts from rest with
something wrong from the beginning, as rows of speed 0. bench/faults_published.toml has published
cases, in which a fault is there from the beginning at a held speed. Every drive is supervised, with
the sensors that the file states. A row counts, over the instants, how often the protection has
ended the run, which status it gave most often, whether it named the right phase, after how long (of
a fault from the beginning, since the state `run`, or since the enable where that was not reached),
and the greatest current until the end.
"""

import argparse
import csv
import re
import sys
import tomllib
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import reluctance as rl
from reluctance import _core
from reluctance.base.phases import LETTERS

BENCH = Path(__file__).parent
sys.path.insert(0, str(BENCH.parent / "studies" / "published"))
import closed_form_6_4  # noqa: E402  a machine of faults_published.toml

PHASE = "b"
BEFORE_RUN = 0.1  # precharge and calibration; until then the drive has settled [s]


@dataclass(frozen=True)
class Case:
    """One drive with one fault, at every instant."""

    name: str
    drive: rl.Drive
    speed_rpm: float  # 0: starts from rest
    fault: dict[str, Any]  # its kind may be several words: as many faults
    instants: list[float]  # electrical angles of the phase; from the beginning, of the rotor [deg]
    seed: int
    watched: float  # [s]

    @property
    def from_beginning(self) -> bool:
        return "t_s" not in self.fault


@dataclass(frozen=True)
class Found:
    """What became of one run."""

    status: int  # 0: nothing was found
    phase: str  # that was named
    t: float  # since the fault [s]
    i_peak: float  # over i_max


def drive_of(name: str, speed_rpm: float, cases: dict[str, Any]) -> rl.Drive:
    """A drive of the file: `machine/law`, or the path of a drive file."""
    if name.endswith(".toml"):
        return rl.load(BENCH / name, trust=True).with_values({"supervision.enable_s": 0.0})
    machine, law = name.split("/")
    values = {**cases["machines"][machine], **cases["laws"][law], **cases["sensing"]}
    values |= {"load.speed_rpm": speed_rpm, "supervision.enable_s": 0.0}
    if values["machine"] == "closed_form_6_4":
        closed_form_6_4.OUT.mkdir(parents=True, exist_ok=True)
        values["machine"] = str(closed_form_6_4.machine_file(closed_form_6_4.OUT))
    return rl.load(BENCH.parent / "examples" / cases["base"]).with_values(values)


def cases(file: Path) -> list[Case]:
    """In the order of the file."""
    given = tomllib.loads(file.read_text(encoding="utf-8"))
    found: list[Case] = []

    def add(drive: rl.Drive, name: str, speed: float, rest: tuple[Any, Any, float]) -> None:
        fault, instants, watched = rest
        seed = sum(len(case.instants) for case in found)
        found.append(Case(name, drive, speed, fault, instants, seed, watched))

    for name in given["drives"]:
        for speed in given["speeds_rpm"]:
            drive = drive_of(name, float(speed), given)
            watched = (1 + given["watched_periods"]) * 60 / (speed * drive.machine.N_r)
            for fault in given.get("faults", []):
                late = {**fault, "t_s": given["settled_s"]}
                add(drive, name, speed, (late, given["instants_deg"], watched))
            for fault in given.get("from_beginning", []):
                add(drive, name, speed, (fault, given["theta_start_deg"], watched))
        if "starts" not in given:
            continue
        starts = given["starts"]
        drive = drive_of(name, 0.0, given)
        torque = {"reference.tau_Nm": None, "control.tau_max_Nm": drive.reference.tau_Nm}
        drive = drive.with_values({**starts["values"], **torque})
        for fault in starts["faults"]:
            add(drive, name, 0.0, (fault, starts["theta_start_deg"], starts["watched_s"]))
    return found


def run(case: Case) -> list[Found]:
    """Every instant of a case."""
    return [_run(case, n, angle) for n, angle in enumerate(case.instants)]


def _run(case: Case, n: int, angle: float) -> Found:
    at = {} if case.from_beginning else {"theta_e_deg": float(angle)}
    faults = [{**case.fault, **at, "kind": kind, "phase": PHASE} for kind in _kinds(case)]
    values: dict[str, Any] = {"faults": faults, "sensing.noise_seed": case.seed + n}
    if case.from_beginning:
        values["simulation.theta_start_deg"] = float(angle)
    drive = case.drive.with_values(values)
    result = rl.simulate(drive, until=BEFORE_RUN + case.watched, record=drive.control.T_s)
    events = result.events or []
    entered = next((event.t for event in events if event.mode == "run"), 0.0)
    begun = max([entered, *(t for t, _ in result.faults)])
    i_peak = float(result.i[:, result.t >= begun].max()) / drive.machine.i_max_A
    for event in events:
        if event.mode == "fault":
            named = re.search(r", phase (\d)", event.text)
            phase = LETTERS[int(named[1])] if named else ""
            return Found(event.status, phase, event.t - begun, i_peak)
    return Found(0, "", np.inf, i_peak)


def _kinds(case: Case) -> list[str]:
    return [kind for kind in case.fault["kind"].split() if kind != "none"]


COLUMNS = (
    *("drive", "speed_rpm", "fault", "instants", "found", "before", "status", "says"),
    *("right_phase", "ms_median", "ms_max", "periods_max", "i_peak_over_i_max"),
)


def row(case: Case, found: list[Found]) -> dict[str, Any]:
    """The instants of a case in one line. before: alarms before the fault, which are false."""
    after = [f for f in found if f.status and f.t >= 0]
    status = Counter(f.status for f in after).most_common(1)[0][0] if after else 0
    t = [f.t for f in after]
    keys = {key: value for key, value in case.fault.items() if key not in ("phase", "t_s")}
    period = 60 / (case.speed_rpm * case.drive.machine.N_r) if case.speed_rpm else np.nan
    return {
        "drive": case.name,
        "speed_rpm": case.speed_rpm,
        "fault": " ".join(str(value) for value in keys.values()),
        "instants": len(found),
        "found": len(after),
        "before": sum(f.t < 0 for f in found),
        "status": status or "",
        "says": _core.describe_status(status) if status else "",
        "right_phase": sum(f.phase == PHASE for f in after),
        "ms_median": f"{1e3 * np.median(t):.2f}" if t else "",
        "ms_max": f"{1e3 * max(t):.2f}" if t else "",
        "periods_max": f"{max(t) / period:.2f}" if t and case.speed_rpm else "",
        "i_peak_over_i_max": f"{max(f.i_peak for f in found):.2f}",
    }


def main() -> None:
    """Runs all cases on all cores."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", nargs="?", type=Path, default=BENCH / "faults.toml")
    parser.add_argument("--out", type=Path, default=BENCH / "faults.csv")
    given = parser.parse_args()
    every = cases(given.cases)
    with given.out.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        with ProcessPoolExecutor() as pool:
            for case, found in zip(every, pool.map(run, every), strict=True):
                writer.writerow(line := row(case, found))
                print(*line.values(), sep=", ", flush=True)
    print(given.out)


if __name__ == "__main__":
    main()
