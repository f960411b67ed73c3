"""False alarms: ten simulated minutes of each of four laws, healthy drives with noisy sensors.

The exported controller runs through its states (reluctance_run) at every sample, and the protection
judges what noise of 8 LSB rms of 12 bits, 0.5 % on the dc voltage and an encoder of 4096 counts
leave of a sample. References, loads and speeds are random steps and ramps from a seed.
`python tests/support/false_alarms.py` writes bench/protection_alarms.csv; it takes some seven CPU
minutes.
"""

import csv
import ctypes
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from fault_table import LAWS, noisy
from firmware_tools import ROOT

import reluctance as rl
from reluctance import _core_parts
from reluctance.base import toolchain
from reluctance.targets.export import firmware
from reluctance.targets.export.on_desk import SOURCES

COUNTS = 4096  # of the encoder
RATED = 41.339  # [N m]
SPEED = 1500.0  # [rpm]
SECONDS = 200.0  # of each course, three of which are ten minutes

# The exported controller as a C function of the plant's samples, in double; a fault is counted and
# the controller starts anew.
CLOSED = """
#include "reluctance_controller.h"
static reluctance_controller controller;
static reluctance_request request;
struct {
  uint32_t samples, run, trips, doubts, first_status, first_sample, braking, slow, reversals;
} alarms;
void closed_start(void) {
  reluctance_init(&controller);
  alarms = (__typeof__(alarms)){0};
  request = (reluctance_request){1, 0, 0, 0, 0.0F};
}
void closed_step(const double* sample, double* row) {
  enum { N = RELUCTANCE_PHASES };
  reluctance_measurement y;
  reluctance_command orders;
  reluctance_outputs outputs;
  for (int k = 0; k < N; ++k) y.i_A[k] = (float)sample[k];
  y.theta_e_rad = (float)sample[N];
  if (y.theta_e_rad >= 6.28318530717958648F) y.theta_e_rad = 0.0F;
  y.omega_m_rad_s = (float)sample[N + 1];
  y.u_dc_V = (float)sample[N + 2];
  y.i_source_A = (float)sample[N + 3];
  request.reference = (float)sample[N + 4];
  ++request.sequence;
#ifdef LAW_ALONE
  reluctance_step(&controller, &y, request.reference, &orders);
  outputs.mode = RELUCTANCE_MODE_RUN;
#else
  reluctance_run(&controller, &y, &request, &orders, &outputs);
#endif
  const reluctance_status status = reluctance_get_fault(&controller).status;
  if (outputs.mode == RELUCTANCE_MODE_RUN && status != RELUCTANCE_OK) ++alarms.doubts;
  if (outputs.mode == RELUCTANCE_MODE_FAULT) {
    if (alarms.trips++ == 0) {
      alarms.first_status = status;
      alarms.first_sample = alarms.samples;
    }
    reluctance_init(&controller);
  }
  if (outputs.mode == RELUCTANCE_MODE_RUN) {
    static double direction;
    const double omega = sample[N + 1];
    ++alarms.run;
    alarms.braking += reluctance_torque_reference(&controller) * omega < 0;
    alarms.slow += omega < 5 && omega > -5;
    if (omega > 5 || omega < -5) {
      alarms.reversals += direction * omega < 0;
      direction = omega;
    }
  }
  ++alarms.samples;
  for (int k = 0; k < N; ++k) {
    const reluctance_phase_command* o = &orders.phase[k];
    for (int n = 0; n < 5; ++n) *row++ = o->leg[n];
    *row++ = o->gate;
    *row++ = o->chop;
    for (int n = 0; n < 4; ++n) *row++ = o->t_edge_s[n];
    *row++ = o->i_ref_A;
    *row++ = o->i_band_A;
    *row++ = o->theta_on_rad;
    *row++ = o->theta_off_rad;
    *row++ = o->i_lower_A;
    *row++ = o->i_centre_A;
    *row++ = o->i_upper_A;
    *row++ = o->i_runaway_A;
  }
}
"""


@dataclass(frozen=True)
class Alarms:
    """What the protection made of a healthy drive."""

    samples: int
    run: int  # samples in the state `run`
    trips: int
    doubts: int  # samples in `run` that were out of range once, and switched the legs off
    first_status: int  # of the first trip; 0: none
    first_sample: int
    braking: int  # samples in `run` whose torque reference acts against the rotation
    slow: int  # samples in `run` below 5 rad/s
    reversals: int  # of the rotation


def closed(
    drive: rl.Drive,
    folder: Path,
    change: Callable[[Path], None] = lambda package: None,
    more: tuple[str, ...] = (),
) -> ctypes.CDLL:
    """The exported package, changed, with the function above, as a library of its own. more: flags
    of the compiler; -DLAW_ALONE leaves states and protection out."""
    package = firmware(drive, folder / "package").folder
    change(package)
    (package / "closed.c").write_text(CLOSED)
    flags = ("-O2", "-fno-math-errno", "-I.", "-Iinclude", *more)
    units = [*SOURCES, "closed.c"]
    return ctypes.CDLL(
        str(toolchain.build(units, "closed.so", flags, folder=package, what="the package"))
    )


def watched(drive: rl.Drive, until: float) -> tuple[Alarms, rl.Kpis]:
    """A healthy run, and what the protection said."""
    with tempfile.TemporaryDirectory() as folder:
        library = closed(drive, Path(folder))
        kpis = run_with(library, drive, until=until, record=None).kpis
        counted = (ctypes.c_uint32 * len(fields(Alarms))).in_dll(library, "alarms")
        return Alarms(*counted), kpis


def run_with(library: ctypes.CDLL, drive: rl.Drive, **options: Any) -> rl.Result:
    """The drive with the compiled controller, from its start."""
    library.closed_start()
    step = ctypes.cast(library.closed_step, ctypes.c_void_p).value
    controller = _core_parts.c_controller(drive.machine.n_phases, step)
    return rl.simulate(drive, controller=controller, **options)


def _steps(rng: np.random.Generator, every: float, most: float) -> dict[str, object]:
    """A value at random that lasts about `every`, then another: one in five 0."""
    n = int(SECONDS / every * 1.2) + 2
    t = np.cumsum(rng.uniform(0.5, 1.5, n) * every).round(6)
    value = (rng.uniform(-most, most, n + 1) * (rng.random(n + 1) > 0.2)).round(3)
    return {
        "t_s": [0.0, *np.repeat(t, 2).tolist()],
        "values": [*np.repeat(value[:-1], 2).tolist(), float(value[-1])],
    }


def _ramps(rng: np.random.Generator, every: float, most: float) -> dict[str, object]:
    """From one value at random to the next in a straight line."""
    n = int(SECONDS / every) + 2
    value = rng.uniform(-most, most, n)
    value[0] = 0.0
    return {"t_s": (every * np.arange(n)).tolist(), "values": value.round(1).tolist()}


def held(law: str) -> rl.Drive:
    """The speed is held and changes between -1.2 and 1.2 of the rated one; torque steps."""
    rng = np.random.default_rng(1)
    load, torque = _ramps(rng, 0.2, 1.2 * SPEED), _steps(rng, 0.05, RATED)
    return _with(law, {"load.speed_rpm": None, **_table("load", load)}, torque)


def fan(law: str) -> rl.Drive:
    """Torque steps turn a fan, from standstill, in both directions."""
    rng = np.random.default_rng(2)
    k = RATED / (SPEED * np.pi / 30) ** 2
    load = {"load.kind": "fan", "load.speed_rpm": None, "load.k_fan_Nms2": round(k, 7)}
    limit = {"protection.speed_max_rpm": 1.5 * SPEED}
    return _with(law, load | limit, _steps(rng, 0.15, RATED))


def speed_loop(law: str) -> rl.Drive:
    """Speeds between -1 and 1 of the rated one are held against steps of the load, from standstill:
    starts, reversals, braking, and a torque that drives the rotor."""
    rng = np.random.default_rng(3)
    speed, load = _steps(rng, 0.3, SPEED), _steps(rng, 0.1, 0.6 * RATED)
    shaft = {"load.kind": "torque", "load.speed_rpm": None, "load.J_kgm2": 0.008}
    loop = {"reference.kind": "speed", "control.tau_max_Nm": 45.0}
    return _with(law, shaft | loop | _table("load", load), speed)


COURSES = {"held_speed": held, "fan": fan, "speed_loop": speed_loop}


def _table(section: str, course: dict[str, object]) -> dict[str, object]:
    return {f"{section}.{key}": value for key, value in course.items()}


def _with(law: str, changes: dict[str, object], reference: dict[str, object]) -> rl.Drive:
    return noisy(law).with_values(
        {
            "sensing.encoder_counts": COUNTS,
            "reference.tau_Nm": None,
            **_table("reference", reference),
            **changes,
        }
    )


def row(law: str, course: str, until: float = SECONDS) -> dict[str, object]:
    """One law on one course, or its first seconds."""
    drive = COURSES[course](law)
    alarms, kpis = watched(drive, until)
    return {
        "law": law,
        "course": course,
        "simulated_s": until,
        "samples": alarms.samples,
        "in_run_pct": round(100 * alarms.run / alarms.samples, 2),
        "braking_pct": round(100 * alarms.braking / max(alarms.run, 1), 2),
        "below_5_rad_s_pct": round(100 * alarms.slow / max(alarms.run, 1), 2),
        "reversals": alarms.reversals,
        "trips": alarms.trips,
        "doubted_samples": alarms.doubts,
        "first_status": alarms.first_status,
        "first_s": round(alarms.first_sample * drive.control.T_s, 6),
        "i_peak_A": round(kpis.i_peak, 1),
    }


def main() -> None:
    rows = [row(law, course) for law in LAWS for course in COURSES]
    with (ROOT / "bench" / "protection_alarms.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
