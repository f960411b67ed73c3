"""Memory and time of a sweep of 100 000 runs, from nothing and again from its store.

    python bench/sweep_memory.py > bench/sweep_memory.csv

Short runs (one electrical period of a single pulse at 3000 rpm), so that what is measured is the
sweep: peak memory of the process, and processor time a point.
"""

import resource
import sys
import tempfile
import time
from pathlib import Path

import reluctance as rl

DRIVE = Path(__file__).parents[1] / "examples" / "single_pulse.toml"
SIDES = (250, 400)  # turn-on angles x turn-off angles
UNTIL = 0.005


def main(part: int) -> None:
    n_on, n_off = SIDES[0] // part, SIDES[1]
    vary = {
        "control.theta_on_deg": [-60 + 100 * n / n_on for n in range(n_on)],
        "control.theta_off_deg": [90 + 60 * n / n_off for n in range(n_off)],
    }
    drive = rl.load(DRIVE, ["simulation.dt_max_us=50", f"simulation.until_s={UNTIL}"])
    print("what,points,ran,failed,cpu_ms,wall_s,peak_MB,store_MB")
    with tempfile.TemporaryDirectory() as folder:
        store = Path(folder) / "runs.sqlite"
        for what in ("run", "from the store"):
            wall, cpu = time.perf_counter(), time.process_time()
            found = rl.sweep(drive, vary, out=store)
            wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
            peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
            print(
                f"{what},{len(found)},{found.ran},{found.failed},{1e3 * cpu / len(found):.3f},"
                f"{wall:.1f},{peak:.0f},{store.stat().st_size / 1e6:.1f}",
                flush=True,
            )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1)
