"""What a run costs among thousands: turn-on angle x turn-off angle x current, on all cores.

    python bench/batch.py > bench/batch.csv

The paper's machine at 240 V and 1500 rpm, hysteresis of +-1 A, ten electrical periods a run, from
zero current. Seconds are wall time of the whole call, set-up and key figures included; `cpu_ms` is
processor time a run, `python_ms` the part of it that holds the interpreter lock.
"""

import resource
import sys
import time
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import reluctance as rl

BASE = Path(__file__).parents[1] / "examples" / "single_pulse.toml"
OVERRIDES = [
    "load.speed_rpm=1500",
    "control.regulate=current",
    "control.i_ref_A=60",
    "control.i_band_A=1",
    "simulation.dt_max_us=100",
]
THETA_ON, THETA_OFF, CURRENTS = range(-40, 61, 5), range(90, 156, 5), range(10, 131, 5)
UNTIL = 0.1  # ten electrical periods [s]
JOBS = (1, 2)


def drives(base: rl.Drive, part: int) -> Iterator[rl.Drive]:
    """Every part-th point of the grid."""
    for n, (on, off, i) in enumerate(product(THETA_ON, THETA_OFF, CURRENTS)):
        if n % part == 0:
            yield base.with_values(
                {"control.theta_on_deg": on, "control.theta_off_deg": off, "control.i_ref_A": i}
            )


def main(part: int) -> None:
    base = rl.load(BASE, OVERRIDES)
    print("jobs,runs,wall_s,runs_per_s,cpu_ms,python_ms,failed,peak_MB")
    for jobs in JOBS:
        wall, cpu, lock = time.perf_counter(), time.process_time(), time.thread_time()
        found = rl.simulate_all(drives(base, part), until=UNTIL, jobs=jobs)
        wall, cpu, lock = (
            time.perf_counter() - wall,
            time.process_time() - cpu,
            time.thread_time() - lock,
        )
        n = len(found)
        failed = sum(not isinstance(kpis, rl.Kpis) for kpis in found)
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(
            f"{jobs},{n},{wall:.2f},{n / wall:.0f},{1e3 * cpu / n:.3f},{1e3 * lock / n:.3f},"
            f"{failed},{peak:.0f}"
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1)
