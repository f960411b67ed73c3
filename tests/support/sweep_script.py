"""A sweep as a process of its own, for tests that end it: it logs each run as it begins.

python sweep_script.py STORE LOG
"""

import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import reluctance as rl

DRIVE = Path(__file__).parents[2] / "examples" / "sharing_cubic.toml"
BANDS = [0.5 + n / 200 for n in range(240)]
UNTIL = 0.02


def main(store: str, log: str) -> None:
    points = import_module("reluctance.explore.sweeps.points")
    sweep = import_module("reluctance.explore.sweeps.sweep")
    points.COMMIT_EVERY = 0.0  # as many commits as runs, so that many are hit
    original = sweep.finished
    with open(log, "a", encoding="utf-8") as file:

        def logged(drives: Iterator[tuple[int, rl.Drive]], **options: object) -> object:
            def begun() -> Iterator[tuple[int, rl.Drive]]:
                for n, drive in drives:
                    file.write(f"{drive.control.i_band_A!r}\n")
                    file.flush()
                    yield n, drive

            return original(begun(), **options)

        sweep.finished = logged
        rl.sweep(rl.load(DRIVE), {"control.i_band_A": BANDS}, until=UNTIL, out=store, jobs=2)


if __name__ == "__main__":
    main(*sys.argv[1:])
