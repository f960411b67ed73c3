"""The core as WebAssembly against the same core as a library of this machine, in one run.

    make c-library wasm; python bench/wasm.py > bench/wasm.csv

Processor time between 5 and 20 simulated seconds without waveforms: set-up and the compiler of
Node's engine drop out. Turns alternate; the least of each side counts, since other work on the
computer only adds to it. Needs g++, clang++-19 and node.
"""

import ctypes
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import reluctance as rl
from reluctance.targets.export.blob import blob

ROOT = Path(__file__).parents[1]
EXAMPLES = ("paper_rated", "edge_mpc_mcu", "hysteresis_200A", "map_mpc", "sun_cloud")
UNTIL = (5.0, 20.0)
TURNS = 7
MORE = 1
ROWS = 1000


def native(lib: ctypes.CDLL, file: Path, until: float) -> float:
    """Processor seconds in the library."""
    content, unit = file.read_bytes(), ctypes.c_uint32()
    if lib.srm_create(content, ctypes.c_size_t(len(content)), 0, ctypes.byref(unit)) < 0:
        sys.exit(f"error: {file.name} is refused")
    lib.srm_start(unit)
    start, taken = time.process_time(), ctypes.c_size_t()
    rows = (ctypes.c_double * (ROWS * 100))()
    while lib.srm_advance(unit, ctypes.c_double(until), None) == MORE:
        for table in (2, 3):  # waveforms and periods
            lib.srm_take(unit, table, rows, ctypes.c_size_t(ROWS), ctypes.byref(taken))
    used = time.process_time() - start
    lib.srm_free(unit)
    return used


def webassembly(file: Path, until: float) -> float:
    """Processor seconds in Node."""
    command: list[str | Path] = [
        "node",
        ROOT / "web" / "run.mjs",
        ROOT / "build" / "reluctance.wasm",
        str(until),
    ]
    return float(subprocess.check_output([*command, file], text=True).split()[2])


def slope(run: Callable[[float], float]) -> float:
    """Processor seconds per simulated second."""
    first, second = (run(until) for until in UNTIL)
    return (second - first) / (UNTIL[1] - UNTIL[0])


def main() -> None:
    lib = ctypes.CDLL(str(ROOT / "build" / "libreluctance.so"))
    print("example,native_s_per_s,webassembly_s_per_s,ratio")
    with tempfile.TemporaryDirectory() as place:
        for name in EXAMPLES:
            file = Path(place) / f"{name}.srm"
            file.write_bytes(blob(rl.load(ROOT / "examples" / f"{name}.toml"), record=None))
            turns = [
                [slope(partial(native, lib, file)), slope(partial(webassembly, file))]
                for _ in range(TURNS)
            ]
            one, other = (min(side) for side in zip(*turns, strict=True))
            print(f"{name},{one:.4f},{other:.4f},{other / one:.2f}", flush=True)


if __name__ == "__main__":
    main()
