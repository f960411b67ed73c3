"""Faults in closed loop: what the exported protection finds, after how long, and at what current.

The exported controller runs on the desk (firmware_tools.Native) with 12-bit sensors and noise. At
an instant a sensor, the dc link or a phase fails; the plant goes on.
`python tests/support/fault_table.py` writes every drive and fault to
bench/protection_faults.csv; with the argument `noise`, a second of every example with noise to
bench/protection_noise.csv.
"""

import csv
import os
import sys
import tempfile
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from firmware_tools import ROOT, Native

import reluctance as rl
from reluctance.drive.guard.trip_levels import protection

LAWS = ("sharing_cubic", "paper_rated", "deadbeat", "edge_mpc_mcu")
NOISE_LSB = 8.0  # rms
PHASE = 1  # the phase that fails
EXAMPLES = (
    *("battery", "deadbeat", "ditc", "edge_mpc_fpga", "edge_mpc_mcu", "fan", "finite_set_mpc"),
    *("five_phases_losses", "hysteresis_200A", "load_step", "map_mpc", "paper_half", "paper_pump"),
    *("paper_rated", "pwm_current", "sharing_cubic", "single_pulse", "sun_cloud", "voltage_sag"),
)


def noisy(name: str, *overrides: str, lsb: float = NOISE_LSB) -> rl.Drive:
    """An example with 12-bit current sensors and noise, 0.5 % of noise on the dc voltage."""
    given = rl.load(ROOT / "examples" / f"{name}.toml")
    i_range = given.sensing.i_range_A or 1.6 * given.machine.i_max_A
    sensing = [
        *("sensing.adc_bits=12", f"sensing.i_range_A={i_range}", f"sensing.i_noise_LSB={lsb}"),
        f"sensing.u_dc_noise_V={0.005 * given.converter.u_dc_V if lsb else 0.0}",
    ]
    return rl.load(ROOT / "examples" / f"{name}.toml", [*sensing, *overrides])


@dataclass
class Fault:
    """What fails: a change of the sample, of the orders, or of the drive."""

    sample: Callable[[Any, dict[str, Any]], None] | None = None  # (sample, memory) from then on
    orders: Callable[[list[float], int], None] | None = None  # (row, n_phases) from then on
    overrides: tuple[str, ...] = ()
    from_start: bool = False  # it was there before the drive was switched on


@cache
def compiled(name: str, lsb: float = NOISE_LSB) -> Native:
    """The exported controller of an example, compiled once."""
    with tempfile.TemporaryDirectory() as folder:
        return Native(noisy(name, lsb=lsb), Path(folder))


def _set(value: float) -> Callable[[Any, dict[str, Any]], None]:
    def spoil(y: Any, memory: dict[str, Any]) -> None:
        y["i"][PHASE] = value

    return spoil


def _gain(gain: float) -> Callable[[Any, dict[str, Any]], None]:
    def spoil(y: Any, memory: dict[str, Any]) -> None:
        y["i"][PHASE] *= gain

    return spoil


def _frozen(y: Any, memory: dict[str, Any]) -> None:
    if "held" not in memory and y["i"][PHASE] > 20:
        memory["held"] = float(y["i"][PHASE])
    y["i"][PHASE] = memory.get("held", y["i"][PHASE])


def _swapped(y: Any, memory: dict[str, Any]) -> None:
    y["i"][[0, 1]] = y["i"][[1, 0]]


def _stuck(y: Any, memory: dict[str, Any]) -> None:
    y["theta_e"] = memory.setdefault("theta_e", float(y["theta_e"]))


def _turned(degrees: float) -> Callable[[Any, dict[str, Any]], None]:
    def spoil(y: Any, memory: dict[str, Any]) -> None:
        y["theta_e"] = np.mod(y["theta_e"] + np.float32(np.radians(degrees)), np.float32(6.2831))

    return spoil


def _jitter(degrees: float) -> Callable[[Any, dict[str, Any]], None]:
    """Of the angle, rms, new in every sample."""

    def spoil(y: Any, memory: dict[str, Any]) -> None:
        random = memory.setdefault("random", np.random.default_rng(0))
        _turned(degrees * random.normal())(y, memory)

    return spoil


def _loses(share: float) -> Callable[[Any, dict[str, Any]], None]:
    """The encoder misses a share of its counts."""

    def spoil(y: Any, memory: dict[str, Any]) -> None:
        now = float(y["theta_e"])
        turned = (now - memory.get("before", now)) % (2 * np.pi)
        memory["before"] = now
        memory["lost"] = memory.get("lost", 0.0) + share * turned
        _turned(-np.degrees(memory["lost"]))(y, memory)

    return spoil


def _legs(change: Callable[[float], float]) -> Callable[[list[float], int], None]:
    def spoil(row: list[float], n_phases: int) -> None:
        first = PHASE * (len(row) - 1) // n_phases
        row[first : first + 5] = [change(leg) for leg in row[first : first + 5]]

    return spoil


def _open(row: list[float], n_phases: int) -> None:
    """The phase carries no current, whatever is ordered."""
    width = (len(row) - 1) // n_phases
    row[PHASE * width : PHASE * width + 6] = [-1.0] * 5 + [1.0]


FAULTS = {
    "sensor open (reads 0)": Fault(_set(0.0)),
    "sensor shorted (full scale)": Fault(_set(1e3)),
    "sensor frozen above 20 A": Fault(_frozen),
    "sensor gain 0.5": Fault(_gain(0.5)),
    "sensor gain 0.7": Fault(_gain(0.7)),
    "sensor gain 1.4": Fault(_gain(1.4)),
    "sensors of two phases swapped": Fault(_swapped),
    "angle stuck": Fault(_stuck),
    "angle jumps by 60 deg": Fault(_turned(60)),
    "angle jumps by -60 deg": Fault(_turned(-60)),
    "angle off by 10 deg from the start": Fault(_turned(10), from_start=True),
    "index lost: off by half a Hall sector": Fault(_turned(30), from_start=True),
    "angle with 5 deg rms of jitter": Fault(_jitter(5)),
    "encoder loses 2 % of its counts": Fault(_loses(0.02)),
    "dc link sags to 20 %": Fault(overrides=("source.sag",)),
    "phase open": Fault(orders=_open),
    "lower switch shorted": Fault(orders=_legs(lambda leg: max(leg, 0.0))),
}


def possible(law: str, fault: str) -> bool:
    """A shorted switch is simulated for orders to a timer only."""
    return "switch" not in fault or law in ("deadbeat", "edge_mpc_mcu")


@dataclass(frozen=True)
class Found:
    """What became of a fault."""

    drive: str
    fault: str
    status: int  # 0: not found
    late_us: float  # from the fault to the trip; of the whole run where it was not found
    i_peak: float  # greatest true current after the fault [A]
    i_max: float


def play(name: str, fault: str, *, at: float = 20e-3, until: float = 30e-3) -> Found:
    """One fault in one example."""
    kind = FAULTS[fault]
    given = noisy(name)
    if kind.overrides:
        u = given.converter.u_dc_V
        course = [f"source.t_s=[0, {at}, {at}]", f"source.values=[{u}, {u}, {0.2 * u}]"]
        given = noisy(name, *course)
    at = 0.0 if kind.from_start else at
    T_s, n = given.control.T_s, round(at / given.control.T_s)
    memory: dict[str, Any] = {}

    def spoil(y: Any, sample: int) -> None:
        if sample >= n and kind.sample is not None:
            kind.sample(y, memory)

    target = compiled(name).again(spoil)

    def step(y: rl.Measurement, reference: float) -> list[float]:
        row = target.step(y, reference)
        if len(target.status) > n and kind.orders is not None:
            kind.orders(row, given.machine.n_phases)
        return row

    controller = rl._core.controller_from(given.machine.n_phases, step)
    run = rl.simulate(given, until=until, controller=controller)
    trip = target.trip
    after = run.i[:, run.t >= at]
    late = (trip[0] - n) * T_s if trip else until - at
    return Found(
        name, fault, trip[1] if trip else 0, 1e6 * late, after.max(), given.machine.i_max_A
    )


def silent(name: str, *, until: float, lsb: float = NOISE_LSB) -> dict[str, Any]:
    """A healthy run with noise: the first trip, if any."""
    quiet = ["load.speed_rpm=1300", "pv_control.wake_s=0", "source.t_s=[0, 0.1, 0.3]"]
    given = noisy(name, *(quiet if name == "sun_cloud" else []), lsb=lsb)
    with tempfile.TemporaryDirectory() as folder:
        target = Native(given, Path(folder))
    run = rl.simulate(given, until=until, record=None, controller=target.controller)
    ideal = rl.simulate(
        given.with_values({"sensing.i_noise_LSB": 0.0, "sensing.u_dc_noise_V": 0.0}),
        until=min(until, 0.1),
        record=None,
    )
    guard = protection(given)
    return {
        "drive": name,
        "samples": len(target.status),
        "trips": int(target.trip is not None),
        "noise_A": round(given.sensing.i_noise, 4),
        "i_zero_A": round(guard.i_zero, 3),
        "torque_error_rms": run.kpis.torque_error_rms,
        "torque_error_rms_no_noise": ideal.kpis.torque_error_rms,
    }


def _write(path: Path, rows: list[dict[str, Any]]) -> None:
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def _row(job: tuple[str, str]) -> dict[str, Any]:
    found = play(*job)
    return {
        "drive": found.drive,
        "fault": found.fault,
        "status": found.status,
        "late_us": round(found.late_us, 1),
        "i_peak_A": round(float(found.i_peak), 1),
        "i_max_A": found.i_max,
    }


def _silent(name: str) -> dict[str, Any]:
    return silent(name, until=1.0)


def main() -> None:
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        jobs = [(law, fault) for fault in FAULTS for law in LAWS if possible(law, fault)]
        if "noise" in sys.argv[1:]:
            _write(ROOT / "bench" / "protection_noise.csv", list(pool.map(_silent, EXAMPLES)))
        else:
            _write(ROOT / "bench" / "protection_faults.csv", list(pool.map(_row, jobs)))


if __name__ == "__main__":
    main()
