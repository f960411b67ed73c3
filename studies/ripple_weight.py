"""Question: what does a weight on ripple save where torque without ripple takes a current that
never ends?

    python studies/ripple_weight.py [--out DIR]

Profiles of the predictive laws at three times base speed and half of the greatest torque without
ripple, motoring, of a machine of the library and one that was drawn (the points of quadrants.py),
and at the design point of the paper's machine, whose current ends. Writes ripple_weight.csv: rms
current over that without ripple, and rms ripple over the torque.
"""

from __future__ import annotations

import argparse
import csv
import tempfile
from pathlib import Path

import numpy as np
from quadrants import MACHINES, ROOT, bench

from reluctance.machine.optimum import best_profile, profile_table

POINTS = (  # machine, speed [rpm], torque [N m]
    ("paper_6_4", 1500.0, 41.339),
    ("generic_60kw_6_4", 8488.0, 49.3),
    ("random_2026", 8751.0, 2.1),
)
WEIGHTS = (3.0, 10.0, 30.0, 100.0, 300.0, 1000.0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "control")
    out: Path = parser.parse_args().out
    rows = []
    for name, rpm, tau in POINTS:
        MACHINES.setdefault(name, None)
        with tempfile.TemporaryDirectory() as folder:
            rest = bench(name, Path(folder)).at_rest()
        point, n = rest.at(rpm * np.pi / 30), 60 * rest.machine.n_phases
        limit = best_profile(point, tau, n_points=n).i_rms
        for weight in WEIGHTS:
            table = profile_table(point, tau, n_levels=4, n_points=n, ripple_weight=weight)
            rows.append(
                {
                    "machine": name,
                    "ripple_weight": f"{weight:g}",
                    "i_over_limit": f"{table.i_rms[-1] / limit:.3f}",
                    "ripple_rms_pct": f"{100 * table.tau_error_rms[-1] / tau:.2f}",
                }
            )
            print(rows[-1], flush=True)
    with (out / "ripple_weight.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
