"""Question: does every law hold its torque on machines that nobody has seen?

    python studies/drawn.py [--seed N ...] [--ranges usual|wide] [--law NAME ...] [--board]
                            [--speed PART ...] [--out DIR]

Machines are drawn from seeds (`drawn_machine.py`); the points are those of `quadrants.py`: 0.1 to 3
times base speed, 20, 50 and 80 % of the limit, motoring and braking, by rule. A coin of the seed
turns each point forwards or backwards. Without --seed the seed is new at each call, and printed.
Judged is the mean torque over the torque reference: within 2 % at 50 and 80 %, within 5 % at 20 %;
a drive that is refused at set-up does not hold.

--board runs the drives as a microcontroller does: 20 us, one sample late, 12-bit currents, 4096
counts, and a control whose flux linkage is 10 % and whose resistance is 30 % wrong, which learns
where its law can.

Writes drawn.csv, one row a run, and a drive file for each point that misses, `machine_law_N.toml`,
to run with `reluctance run`. The exit status says whether the bounds hold.
"""

from __future__ import annotations

import argparse
import json
import secrets
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import quadrants
from drawn_machine import USUAL, WIDE, drawn_machine
from quadrants import Bench, Point, Row

from reluctance.base.errors import ParameterError
from reluctance.drive.drive import Drive
from reluctance.drive.laws import table_of
from reluctance.drive.laws.learning import Learns

ROOT = Path(__file__).parents[1]
RANGES = {"usual": USUAL, "wide": WIDE}
BOARD = (
    "control.T_s_us=20",
    "sensing.delay_samples=1",
    "sensing.adc_bits=12",
    "sensing.encoder_counts=4096",
    "mismatch.flux_factor=0.9",
    "mismatch.R_factor=1.3",
)


@dataclass(frozen=True)
class Bound:
    """What the mean torque of a part of the points must keep to, all over the reference."""

    parts: tuple[float, ...]  # of the limit's torque
    within: float
    held: float  # part of the points that must be within
    worst: float  # of any point

    def verdict(self, rows: list[Row]) -> tuple[bool, str]:
        """Whether they do, and the figures."""
        mine = [row for row in rows if row.torque_part in self.parts]
        errors = np.array([np.inf if row.refused else row.mean_error for row in mine])
        held = int(np.sum(np.abs(errors) <= self.within))
        run = errors[np.isfinite(errors)]
        worst = run[np.argmax(np.abs(run))] if len(run) else np.inf
        holds = held >= self.held * len(mine) and abs(worst) <= self.worst
        text = f"{held:5d} of {len(mine):5d} within {100 * self.within:g} %"
        return holds, f"{text}, worst {100 * worst:7.2f} %, {len(mine) - len(run)} refused"


BOUNDS = (Bound((0.5, 0.8), 0.02, 0.995, 0.1), Bound((0.2,), 0.05, 0.99, np.inf))


def benches(seeds: list[int], ranges: str, folder: Path) -> Iterator[tuple[int, Bench]]:
    """The machines of some seeds; their files are written to the folder."""
    for seed in seeds:
        name = f"{ranges}_{seed}"
        text, u_dc = drawn_machine(seed, RANGES[ranges])
        machine = folder / f"{name}.toml"
        machine.write_text(text, encoding="utf-8")
        given = (f"machine={machine}", f"converter.u_dc_V={u_dc}", "reference.tau_Nm=0.01")
        yield seed, Bench(name, given)


def points(seed: int, at: Bench, laws: list[str], *, board: bool) -> list[Point]:
    """The runs on a machine, each forwards or backwards."""
    listed = []
    for law in laws:
        coin = np.random.default_rng(seed)
        settings: tuple[str, ...] = ()
        if board:
            i_range = 1.5 * at.at_rest().machine.i_max_A
            settings = (*BOARD, f"sensing.i_range_A={i_range!r}")
            settings += ("control.learn=true",) if issubclass(table_of(law), Learns) else ()
        for point in quadrants.points(replace(at, settings=settings), [law]):
            listed.append(backwards(point) if coin.integers(2) else point)
    return listed


def backwards(point: Point) -> Point:
    """Speed and torque of the other sign."""
    drive = point.drive
    values = {
        "load.speed_rpm": -float(drive.load.given["speed_rpm"]),
        "reference.tau_Nm": -float(drive.reference.given["tau_Nm"]),
    }
    return replace(point, drive=drive.with_values(values))


def drive_file(drive: Drive) -> str:
    """The text of a drive file that gives this drive."""
    tables = {name: table for name, table in drive.tables().items() if table}
    lines = []
    for name, table in tables.items():
        lines += [f"[{name}]", *(f"{key} = {json.dumps(value)}" for key, value in table.items())]
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, nargs="+", default=[secrets.randbelow(10**6)])
    parser.add_argument("--ranges", choices=[*RANGES], default="usual")
    parser.add_argument("--law", choices=[*quadrants.PERIODS], nargs="+")
    parser.add_argument("--speed", type=float, nargs="+", help="of base speed")
    parser.add_argument("--board", action="store_true")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "drawn")
    arguments = parser.parse_args()
    if arguments.speed:
        quadrants.SPEEDS = tuple(arguments.speed)
    print("seeds", *arguments.seed, flush=True)
    laws: list[str] = arguments.law or [*quadrants.PERIODS]
    out: Path = arguments.out
    out.mkdir(parents=True, exist_ok=True)
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as folder:
        for seed, at in benches(arguments.seed, arguments.ranges, Path(folder)):
            try:
                listed = points(seed, at, laws, board=arguments.board)
            except (ParameterError, RuntimeError) as fault:
                print(f"{at.name}: no limit to judge by: {fault}", flush=True)
                continue
            found = quadrants.run_all(listed)
            rows += found
            missed = [(p, r) for p, r in zip(listed, found, strict=True) if not holds(r)]
            print(f"{at.name}: {len(found) - len(missed)} of {len(found)} hold", flush=True)
            for n, (point, row) in enumerate(missed):
                path = out / f"{at.name}_{row.law}_{n}.toml"
                path.write_text(drive_file(point.drive), encoding="utf-8")
                print(
                    f"  {row.law:15s} {row.speed_part:4g} x base {row.quadrant:8s} "
                    f"{row.torque_part:g}: {100 * row.mean_error:8.2f} %  {path} {row.refused}"
                )
    quadrants.written(out / "drawn.csv", [asdict(row) for row in rows])
    fine = True
    for law in laws:
        for bound in BOUNDS:
            good, text = bound.verdict([row for row in rows if row.law == law])
            print(f"{law:15s} {'holds ' if good else 'MISSES'} {text}")
            fine &= good
    sys.exit(not fine)


def holds(row: Row) -> bool:
    """Whether the mean of a run is within its bound."""
    within = next(bound.within for bound in BOUNDS if row.torque_part in bound.parts)
    return abs(row.mean_error) <= within


if __name__ == "__main__":
    main()
