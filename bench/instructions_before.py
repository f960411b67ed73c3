"""Instructions of the closed loop before the engine by Hermite's rule, counted as they are now.

    python bench/instructions_before.py > bench/instructions_before.csv

Builds the last commit before that engine in a folder of its own and runs its bench/instructions.py
there, with the example that it lacks. That takes some 20 minutes, valgrind, and the history.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
COMMIT = "2e1ebbd"  # Bench: instructions of the loop per simulated second
NAMES = {  # of its cases, as they are called now
    "pump, turning shaft": "turning shaft (pump)",
    "edge_mpc, 2 us": "edge_mpc at 2 us",
    "edge_mpc, 20 us": "edge_mpc at 20 us",
    "angles and hysteresis, 100 us": "hysteresis at 100 us",
    "angles and hysteresis, 20 us": "hysteresis at 20 us",
    "single pulse, 3000 rpm": "single pulse at 3000 rpm",
    "rated point, flux map": "rated point on a flux map",
    "angles and hysteresis, 20 us, flux map": "hysteresis on a flux map",
    "rated point, every point recorded": "rated point with every point recorded",
}
COUNT = """
import sys; sys.path.insert(0, "bench")
import instructions
instructions.CASES["hysteresis_200A (500 rpm)"] = instructions.Case("hysteresis_200A")
instructions.main()
"""


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        source, site = place / "source", place / "site"
        source.mkdir()
        tar = str(place / "source.tar")
        subprocess.run(["git", "archive", "--output", tar, COMMIT], cwd=ROOT, check=True)
        subprocess.run(["tar", "-xf", tar, "-C", str(source)], check=True)
        pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target"]
        subprocess.run([*pip, str(site), str(source)], check=True, stdout=sys.stderr)
        counted = subprocess.run(
            [sys.executable, "-c", COUNT],
            cwd=source,
            env={"PYTHONPATH": str(site), "PATH": "/usr/bin:/bin"},
            check=True,
            capture_output=True,
            text=True,
        ).stdout
    for line in counted.splitlines():
        case, _, count = line.rpartition(",")
        case = case.strip('"')
        print(f"{NAMES.get(case, case)},{count}")


if __name__ == "__main__":
    main()
