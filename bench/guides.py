"""What a guided law costs to set up: its reference profiles, with nothing in the cache.

    python bench/guides.py

writes bench/guides.csv: processor time (user and system) of the set-up, each case in a process of
its own, and the searches of IPOPT with their iterations, which do not depend on the computer.
"""

from __future__ import annotations

import csv
import os
import resource
import tempfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import reluctance as rl
from reluctance.machine.optimum import Programme

ROOT = Path(__file__).parents[1]
ONE_HP = ("machine=generic_1hp_8_6", "reference.tau_Nm=2", "control.tau_max_Nm=2.2")
FIVE_PHASES = (
    "machine=own_10_8",
    "converter.u_dc_V=300",
    "load.speed_rpm=375",
    "reference.tau_Nm=2.6",
    "control.T_s_us=25",
)
CASES = {  # an example and what is set in it
    "paper_6_4": ("edge_mpc_fpga", "control.guide_speed_rpm=[1500,3000,4500]"),
    "generic_1hp_8_6": ("edge_mpc_fpga", *ONE_HP, "control.guide_speed_rpm=[1500,3000]"),
    "generic_1hp_8_6 fast": ("edge_mpc_fpga", *ONE_HP, "control.guide_speed_rpm=[1500,4500]"),
    "generic_60kw_6_4": (
        "edge_mpc_fpga",
        "machine=generic_60kw_6_4",
        "load.speed_rpm=900",
        "reference.tau_Nm=60",
        "control.guide_speed_rpm=[900,2700]",
    ),
    "own_10_8 edge_mpc": ("sharing_cubic", *FIVE_PHASES, "control.law=edge_mpc"),
    "own_10_8 finite_set_mpc": ("sharing_cubic", *FIVE_PHASES, "control.law=finite_set_mpc"),
    "own_10_8 fast": (
        "sharing_cubic",
        *FIVE_PHASES,
        "control.law=edge_mpc",
        "control.guide_speed_rpm=[2000,4000]",
    ),
}


@dataclass
class Searches:
    """Of IPOPT, while they are counted."""

    searches: int = 0
    iterations: int = 0


@contextmanager
def counted() -> Iterator[Searches]:
    """Counts the searches of every programme."""
    count, solve = Searches(), Programme._solve

    def counting(self: Programme, objective: Any, constraint: Any, *args: Any, **kw: Any) -> Any:
        found = solve(self, objective, constraint, *args, **kw)
        count.searches += 1
        count.iterations += self._solvers[objective, constraint].stats()["iter_count"]
        return found

    Programme._solve = counting  # type: ignore[method-assign]
    try:
        yield count
    finally:
        Programme._solve = solve  # type: ignore[method-assign]


def set_up(case: str, *more: str) -> Searches:
    """Sets a law of CASES up, with more settings; reads and writes the cache as any other."""
    example, *settings = CASES[case]
    drive = rl.load(ROOT / "examples" / f"{example}.toml", [*settings, *more])
    with counted() as count:
        drive.control.core(drive.known())
    return count


def cold(case: str) -> dict[str, object]:
    """A row of the file."""
    with tempfile.TemporaryDirectory() as folder:
        os.environ["RELUCTANCE_CACHE"] = folder
        before = resource.getrusage(resource.RUSAGE_SELF)
        count = set_up(case)
        after = resource.getrusage(resource.RUSAGE_SELF)
    time = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return {"case": case, "processor_s": f"{time:.1f}", **asdict(count)}


def main() -> None:
    pool = partial(ProcessPoolExecutor, max_workers=1, mp_context=get_context("spawn"))
    with pool(max_tasks_per_child=1) as processes:
        rows = list(processes.map(cold, CASES))
    with (ROOT / "bench" / "guides.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
