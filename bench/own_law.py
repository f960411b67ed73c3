"""A law in Python: what a call costs, and its place in a comparison.

    python bench/own_law.py

writes bench/own_law.csv and bench/own_law_compare.csv. Costs are user CPU time of a call.
"""

import csv
import resource
import statistics
from pathlib import Path

import numpy as np

import reluctance as rl
from reluctance import _core
from reluctance.drive.laws.own_law import core_of, law_class
from reluctance.explore.comparison import compare
from reluctance.explore.comparison.table import records

ROOT = Path(__file__).parents[1]
RATED = ROOT / "examples" / "paper_rated.toml"
LAW = f"python:{ROOT / 'examples' / 'own_law' / 'own_law.py'}:RestOfTorque"
RUNS = 7


class Constant(rl.Law):
    """The least that a law can do."""

    def reset(self, known: rl.Known) -> None:
        self.orders = [rl.Order.regulate(20.0, 1.0)] * known.n_phases

    def step(self, y: rl.Measurement, tau_ref: float) -> list[rl.Order]:
        return self.orders


def us_per_sample(drive: rl.Drive, law: rl.Law | None) -> float:
    """Median user CPU time of one call of a controller [us]."""
    known = drive.known()
    core = drive.control.core(known) if law is None else core_of(law, known)
    controller = _core.Controller(core, drive.frame(known))
    random = np.random.default_rng(1)
    n_phases, count = known.n_phases, 20_000
    samples = np.column_stack(
        [
            random.uniform(0, 80, (count, n_phases)),
            random.uniform(0, 2 * np.pi, count),
            np.full((count, 4), (known.omega_m, known.u_dc, 0.0, known.tau_max)),
        ]
    )
    times = []
    for _ in range(RUNS):
        before = resource.getrusage(resource.RUSAGE_SELF).ru_utime
        _core.step_time(controller, np.ascontiguousarray(samples), repeats=1)
        times.append(resource.getrusage(resource.RUSAGE_SELF).ru_utime - before)
    return statistics.median(times) / count * 1e6


def main() -> None:
    drive = rl.load(RATED, ["control.law=torque_sharing", "control.i_band_A=1.0"])
    laws = {"torque_sharing": None, "constant": Constant(), "RestOfTorque": law_class(LAW)()}
    with (ROOT / "bench" / "own_law.csv").open("w", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["law", "us_per_sample"])
        for name, law in laws.items():
            rows.writerow([name, f"{us_per_sample(drive, law):.2f}"])
    found = compare(rl.load(RATED), ["sharing_linear", LAW], f_switch=10e3, octaves=())
    keys = ("f_switch_Hz", "torque_error_rms", "torque_ripple_pp", "i_rms_over_limit")
    with (ROOT / "bench" / "own_law_compare.csv").open("w", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["control", *keys])
        for record in records(found):
            name = record["control"].rpartition(":")[2]
            rows.writerow([name, *(f"{record[key]:.6g}" for key in keys)])


if __name__ == "__main__":
    main()
