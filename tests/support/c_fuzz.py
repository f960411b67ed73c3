"""Random sequences of calls of the C interface under sanitizers, as many as are asked for.

    python tests/support/c_fuzz.py [SEQUENCES] [SEED] > bench/c_interface_fuzz.csv

Compiles tests/c_interface/fuzz.cpp with the sanitizers for addresses and undefined behaviour and
runs it with blobs of drives with sensors, a battery, a direct torque law, a predictive law and
states. A wild pointer, a leak, undefined behaviour or an unknown status ends it. 10^6 sequences
take about half an hour. Sequence j of seed s is the same whatever comes before it.
"""

import csv
import os
import re
import subprocess
import sys
import tempfile
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

from c_library import SENSORS

import reluctance as rl
from reluctance.targets.export.blob import blob

ROOT = Path(__file__).parents[2]
DIAGNOSED = {"supervision.enable_s": 0.0, "protection.diagnosis": True}
EXAMPLES = ROOT / "examples"
CHUNK = 50_000  # sequences of one process
FLAGS = (
    "-std=c++20 -O1 -ffp-contract=off -fsanitize=address,undefined -fno-sanitize-recover=all "
    "-DSRM_LAWS=TorqueSharing,Ditc,EdgeMpc -DSRM_MACHINES=LeHuy -DSRM_PHASES=3 "
    "-DSRM_PRECISIONS=double"
).split()


def program(place: Path) -> list[Path]:
    """The fuzzer in a folder, and its blobs: one of them records each point."""
    source, target = ROOT / "tests" / "c_interface" / "fuzz.cpp", place / "fuzz"
    include = f"-I{ROOT / 'include'}"
    subprocess.run(["g++", *FLAGS, include, str(source), "-o", str(target)], check=True)
    sharing = rl.load(EXAMPLES / "sharing_cubic.toml")
    files = [target]
    for name, drive, record in (
        ("sensors", sharing.with_values(SENSORS), 0.0),
        ("battery", rl.load(EXAMPLES / "battery.toml"), None),
        ("ditc", rl.load(EXAMPLES / "ditc.toml"), None),
        ("edge_mpc", rl.load(EXAMPLES / "edge_mpc_mcu.toml"), None),
        ("states", sharing.with_values({"supervision.enable_s": 0.0}), None),
        ("diagnosed", sharing.with_values(DIAGNOSED), None),
    ):
        files.append(place / f"{name}.srm")
        files[-1].write_bytes(blob(drive, record=record))
    return files


def fuzzed(files: list[Path], sequences: int, seed: int) -> Counter[str]:
    """How often each status was answered; also `sequences` and `calls`."""
    target, *blobs = files
    done = subprocess.run(
        [target, str(sequences), str(seed), *blobs], capture_output=True, text=True
    )
    if done.returncode != 0:
        raise RuntimeError(f"seed {seed}: {done.stdout[-500:]}{done.stderr[-3000:]}")
    head = re.match(r"(\d+) sequences, (\d+) calls", done.stdout)
    assert head is not None
    found = Counter(sequences=int(head[1]), calls=int(head[2]))
    for status, count in re.findall(r"^ *(-?\d+) +(\d+)  ", done.stdout, flags=re.M):
        found[status] += int(count)
    return found


def main(sequences: int, seed: int) -> None:
    found: Counter[str] = Counter()
    whole, rest = divmod(sequences, CHUNK)
    chunks = [CHUNK] * whole + [rest] * (rest > 0)
    with tempfile.TemporaryDirectory() as place, ThreadPoolExecutor(os.cpu_count()) as threads:
        files = program(Path(place))
        for one in threads.map(partial(fuzzed, files), chunks, range(seed, seed + len(chunks))):
            found += one
            print(f"{found['sequences']} sequences, {found['calls']} calls", file=sys.stderr)
    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow(["what", "count"])
    names = sorted((k for k in found if k.lstrip("-").isdigit()), key=int)
    rows = [("sequences", found["sequences"]), ("calls", found["calls"])]
    writer.writerows([*rows, *((f"status {name}", found[name]) for name in names)])


if __name__ == "__main__":
    given = [int(float(text)) for text in sys.argv[1:]]
    main(*(given + [1_000_000, 1][len(given) :]))
