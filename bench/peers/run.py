"""Processor time per simulated second, against other open programs, in one run.

    python bench/peers/run.py [FOLDER] > bench/peers/peers.csv

Each peer is installed in an environment of its own in FOLDER (by default a temporary one), with its
version pinned. The jobs differ, and the column `job` says how: no peer has a switched-reluctance
machine, so only the row by hand is the same job. A ratio is that of a peer to the first row.
"""

import csv
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
PEERS = {  # script: interpreter, and what it needs
    "numba_rk4.py": ("python3.11", ["numba==0.61.2", "numpy==2.2.6"]),
    "motulator_drive.py": ("python3.11", ["motulator==0.5.0", "numpy==2.2.6", "scipy==1.15.3"]),
    "gem_steps.py": ("python3.11", ["gym-electric-motor==3.0.3"]),
}
LIMIT = 900  # of one installation or measurement [s]


def environment(folder: Path, script: str, interpreter: str, needs: list[str]) -> Path:
    """A Python that has what a script needs."""
    place = folder / Path(script).stem
    python = place / "bin" / "python"
    if not (place / "installed").exists():
        found = shutil.which(interpreter)
        if found is None:
            raise RuntimeError(f"no {interpreter}")
        subprocess.run([found, "-m", "venv", place], check=True, timeout=LIMIT)
        pip = [str(python), "-m", "pip", "install", "-q", "--disable-pip-version-check", *needs]
        subprocess.run(pip, check=True, timeout=LIMIT, stdout=sys.stderr)
        (place / "installed").write_text("")
    return python


def measured(python: Path | str, script: str) -> list[dict[str, object]]:
    """The rows that a script prints."""
    line = [python, "-W", "ignore", HERE / script]
    done = subprocess.run(line, check=True, timeout=LIMIT, capture_output=True, text=True)
    return [json.loads(row) for row in done.stdout.splitlines() if row.startswith("{")]


def main(folder: Path) -> None:
    rows = measured(sys.executable, "ours.py")
    for script, (interpreter, needs) in PEERS.items():
        try:
            rows += measured(environment(folder, script, interpreter, needs), script)
        except (RuntimeError, subprocess.SubprocessError) as fault:
            print(f"{script}: {fault}", file=sys.stderr)
    first = float(str(rows[0]["cpu_s_per_s"]))
    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow(["peer", "cpu_s_per_s", "ratio", "job"])
    for row in rows:
        cpu = float(str(row["cpu_s_per_s"]))
        writer.writerow([row["peer"], f"{cpu:.3g}", f"{cpu / first:.3g}", row["job"]])


if __name__ == "__main__":
    if len(sys.argv) > 1:
        main(Path(sys.argv[1]).absolute())
    else:
        with tempfile.TemporaryDirectory() as name:
            main(Path(name))
