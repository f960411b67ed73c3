"""Signals at random instants into every long command, its imports included.

    python tests/support/signals.py [COMMANDS] [--times 100] [--seed N] [--out FILE.csv]

Ctrl-C, a request to end or a closed terminal ends a command with 128 and the number of the signal,
on one line, and leaves no file: neither where it writes nor where the system keeps temporary ones.
The instant is drawn over the processor time of the command, so that it is the same on a busy
computer.
"""

import argparse
import csv
import os
import random
import re
import secrets
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from command import processor_time

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
RATED, CUBIC = EXAMPLES / "paper_rated.toml", EXAMPLES / "sharing_cubic.toml"
DAY = EXAMPLES / "sun_day.toml"
TOLD = "interrupted; no file is left half-written"
KEPT = r"; (?P<count>\d+) runs are kept in (?P<store>\S+): the same command goes on from there"
PROGRESS = r": \d+ % after \d+ s$"  # on a busy computer, before the signal comes
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
LONGEST = 6.0  # processor time before the signal [s]

LONG = {
    "run": ("run", RATED, "--until", "60", "--record-us", "1000", "--out", "w.csv"),
    "limit": ("limit", RATED, "--envelope", "w.csv", "--at-switching-frequency", "20kHz"),
    "sweep": ("sweep", RATED, "--vary", "control.i_band_A=0.5:2:999", "--table", "w.csv"),
    "compare": ("compare", RATED, "--out", "compared"),
    "tune": (
        *("tune", CUBIC, "--vary", "control.i_band_A=1:2", "--minimise", "i_rms"),
        *("--budget", "999", "--out", "w.toml"),
    ),
    "efficiency": ("efficiency", CUBIC, "--out", "w.csv"),
    "pump": ("pump", EXAMPLES / "sun_year.toml", "--out", "pumped"),
    "size": ("size", DAY, "--vary", "array.n_parallel=2:40", "--out", "sized"),
    "paper": ("paper", "--out", "paper"),
    "geometry": (
        *("machine", "from-geometry", ROOT / "machines" / "geometry" / "own_12_8.toml"),
        *("--out", "w.toml"),
    ),
    "firmware": ("export", "firmware", RATED, "--out", "firmware"),
    "unit": ("export", "fmu", RATED, "--out", "w.fmu"),
    "law": ("law", "build", EXAMPLES / "own_law" / "own_law.hpp", "DeadbeatPulse", "--out", "w.so"),
    "studio": ("studio", "--data", "data"),
}


def is_told(lines: list[str]) -> bool:
    """One line: that it was interrupted, and what a store has of its work."""
    return len(lines) == 1 and re.fullmatch(f"{TOLD}({KEPT})?", lines[0]) is not None


def ended(name: str, draw: random.Random) -> tuple[str, str]:
    """What became of a command: "whole" where it was faster, "at once" where Python had not begun,
    or "told"; and what is wrong."""
    number, at = draw.choice(SIGNALS), draw.uniform(0.0, LONGEST)
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        for inner in ("here", "tmp"):
            (folder / inner).mkdir()
        environment = os.environ | {"RELUCTANCE_CACHE": f"{text}/cache", "TMPDIR": f"{text}/tmp"}
        running = subprocess.Popen(
            [sys.executable, "-m", "reluctance", *map(str, LONG[name])],
            **{"cwd": folder / "here", "env": environment, "text": True},
            **{"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE},
        )
        while running.poll() is None and processor_time(running.pid) < at:
            time.sleep(0.002)
        running.send_signal(number)
        said = running.communicate()[1].splitlines()
        said = [x for x in said if "resource_tracker" not in x and "warnings.warn" not in x]
        said = [x for x in said if not re.search(PROGRESS, x)]
        code = running.returncode
        left = sorted(str(p.relative_to(folder)) for p in folder.glob("[ht]*/**/*"))
    if code == 0:
        half = [file for file in left if "tmp" in file]
        return "whole", f"left {half}" if half else ""
    where = f"signal {number} at {at:.3f} s"
    if code == 128 + number and is_told(said):
        return "told", f"{where}: left {left}" if left else ""
    ours = any("reluctance" in line for line in said)
    if not ours and (code == -number or number == signal.SIGINT):
        return "at once", ""  # before a line of the program
    return "told", f"{where}: code {code}, {said[-3:]}"


def main() -> None:
    ask = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    ask.add_argument("commands", nargs="*", choices=[*LONG, []])
    ask.add_argument("--times", type=int, default=100)
    ask.add_argument("--seed", type=int, default=secrets.randbelow(10**6))
    ask.add_argument("--out", type=Path, help="how often each command ended in which way, as CSV")
    given = ask.parse_args()
    print(f"seed {given.seed}", flush=True)
    rows, wrong = [], 0
    for name in given.commands or LONG:
        draw, count = random.Random(f"{given.seed} {name}"), Counter[str]()
        for _ in range(given.times):
            how, fault = ended(name, draw)
            count[how] += 1
            count["wrong"] += bool(fault)
            if fault:
                print(f"{name}: {fault}", flush=True)
        wrong += count["wrong"]
        rows.append((name, given.seed, *(count[k] for k in ("told", "at once", "whole", "wrong"))))
        print(*rows[-1], flush=True)
    if given.out:
        with given.out.open("w", newline="") as file:
            table = csv.writer(file, lineterminator="\n")
            head = ("command", "seed", "told", "before_the_program", "whole", "wrong")
            table.writerows([head, *rows])
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
