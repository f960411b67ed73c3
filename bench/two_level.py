"""What a board with one comparator and hysteresis a phase loses against all four thresholds.

python bench/two_level.py > bench/two_level.csv
"""

import csv
import sys
from pathlib import Path

import reluctance as rl

EXAMPLES = Path(__file__).parents[1] / "examples"
UNTIL = {"paper_pump": 0.4}  # [s], at speed by then
LAWS = ("paper_rated", "sharing_cubic", "map_mpc", "paper_pump", "hysteresis_200A")


def main() -> None:
    writer = None
    for name in LAWS:
        for comparators in ("analog", "two_level"):
            drive = rl.load(EXAMPLES / f"{name}.toml", [f"sensing.comparators={comparators}"])
            k = rl.simulate(drive, until=UNTIL.get(name, 0.06), record=None).kpis
            row = {
                "example": name,
                "comparators": comparators,
                "tau_mean_Nm": k.tau_mean,
                "torque_ripple_pp": k.torque_ripple_pp,
                "torque_error_rms": k.torque_error_rms,
                "f_switch_Hz": k.f_switch,
            }
            if writer is None:
                writer = csv.DictWriter(sys.stdout, row, lineterminator="\n")
                writer.writeheader()
            writer.writerow(row)


if __name__ == "__main__":
    main()
