"""Cost of a control step on the emulated targets, for every drive of the examples.

    python bench/firmware_cost.py > bench/firmware_cost.csv

Counts do not depend on the machine that runs the emulator, only on the cross compiler:
arm-none-eabi-g++ 12.2.1.
"""

import csv
import sys
from pathlib import Path

import reluctance as rl
from reluctance.targets.export.cost import costs

EXAMPLES = Path(__file__).parents[1] / "examples"
ONE_HP_8_6 = ["machine=generic_1hp_8_6", "reference.tau_Nm=2", "control.tau_max_Nm=2.2"]
VARIANTS = {  # more than the file as it is
    "finite_set_mpc": [[], ["control.horizon=2"]],
    "edge_mpc_mcu": [[], [*ONE_HP_8_6, "sensing.i_range_A=10"]],
}


def main() -> None:
    writer = None
    for path in sorted(EXAMPLES.glob("*.toml")):
        if any(word in path.read_text() for word in ("[site]", "shared_switch", "python:")):
            continue  # no drive, or none that is exported
        for overrides in VARIANTS.get(path.stem, [[]]):
            for cost in costs(rl.load(path, overrides)):
                row = {"drive": path.stem, "set": " ".join(overrides)} | cost.with_units()
                if writer is None:
                    writer = csv.DictWriter(sys.stdout, row, lineterminator="\n")
                    writer.writeheader()
                writer.writerow(row)


if __name__ == "__main__":
    main()
