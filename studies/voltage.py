"""Question: from which speed on does the voltage not suffice for a law's own references, and what
does the profile of the limit give in their place?

    python studies/voltage.py [--machine NAME] [--out DIR]

Torque sharing, deadbeat and DITC at 50 and 80 % of the greatest torque without ripple, motoring and
braking, from a quarter to three times base speed; each by rule, and with its own references kept at
every speed. The drives are those of quadrants.py. Writes voltage.csv, one row a run, and
voltage.png: where each law hands over, the error of the mean and the ripple.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import quadrants
from quadrants import ROOT, Bench, Row, bench

from reluctance.base.picture import Picture
from reluctance.base.units import from_si
from reluctance.drive.laws import ditc_reach, shared_torque
from reluctance.drive.laws.hand_over import ALWAYS, TORQUES

SPEEDS = (0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0)  # of base speed
LAWS = ("torque_sharing", "deadbeat", "ditc")
TICKS = (-100, -30, -10, -2, 0, 2, 10)  # of the error of the mean [%]
COLOURS = dict(zip(LAWS, ("#56B4E9", "#E69F00", "#CC79A7"), strict=True))


@dataclass(frozen=True)
class Run:
    """A law at a point, as it is or with its own references at every speed."""

    law: str
    quadrant: str
    torque_part: float
    speed_part: float
    own: int
    beyond: int  # whether the voltage does not suffice here
    mean_error: float
    ripple_rms: float
    i_over_limit: float


@contextmanager
def own_references() -> Iterator[None]:
    """No speed is too high for a law's own references."""
    always = np.full(TORQUES, ALWAYS)
    with (
        patch.object(shared_torque, "feasible_shares", lambda *_: always),
        patch.object(ditc_reach.Alone, "reach", lambda *_: always),
    ):
        yield


def beyond(point: quadrants.Point) -> int:
    """Whether the boundary of the law lies below the speed of a point."""
    known = point.drive.known()
    control: Any = point.drive.control
    motoring, braking = control.boundary(known)
    torque = abs(float(point.drive.reference.course[1][0]))
    reach = np.interp(
        torque / known.tau_max * (TORQUES - 1),
        np.arange(TORQUES),
        braking if known.brakes else motoring,
    )
    return int(known.N_r * known.omega_m > reach * known.u_dc)


def runs(at: Bench) -> Iterator[Run]:
    """All rows of a machine."""
    quadrants.SPEEDS = SPEEDS
    points = [p for p in quadrants.points(at, [*LAWS]) if p.torque_part > 0.2]
    past = [beyond(p) for p in points]
    found: list[list[Row]] = [quadrants.run_all(points)]
    with own_references():
        found.append(quadrants.run_all(points))
    for own, rows in enumerate(found):
        for row, is_past in zip(rows, past, strict=True):
            yield Run(
                law=row.law,
                quadrant=row.quadrant,
                torque_part=row.torque_part,
                speed_part=row.speed_part,
                own=own,
                beyond=is_past,
                mean_error=row.mean_error,
                ripple_rms=row.ripple_rms,
                i_over_limit=row.i_over_limit,
            )


def plot(rows: list[Run], name: str) -> Picture:
    """Error of the mean and ripple over speed at 80 % of the limit's torque."""
    figure = Picture(9.0, 5.5)
    panels = figure.subplots(2, 2, sharex=True)
    for column, quadrant in enumerate(("motoring", "braking")):
        for law in LAWS:
            for own in (1, 0):
                mine = [
                    r
                    for r in rows
                    if (r.law, r.quadrant, r.torque_part, r.own) == (law, quadrant, 0.8, own)
                ]
                x = [r.speed_part for r in mine]
                style: dict[str, Any] = {"color": COLOURS[law], "ls": ":" if own else "-"}
                label = f"{law}, own references" if own else law
                panels[0, column].plot(x, [100 * r.mean_error for r in mine], label=label, **style)
                panels[1, column].plot(x, [100 * r.ripple_rms for r in mine], **style)
                first = [r for r in mine if r.beyond and not own][:1]
                for r in first:
                    panels[1, column].plot(r.speed_part, 100 * r.ripple_rms, "o", **style)
        panels[0, column].set_title(f"{name}, {quadrant}")
        panels[0, column].set_yscale("symlog", linthresh=2)
        panels[0, column].set_yticks(TICKS, [f"{tick:g}" for tick in TICKS])
        panels[1, column].set_yscale("log")
        panels[1, column].set_xlabel("speed over base speed")
    panels[0, 0].set_ylabel("error of the mean torque (%)")
    panels[1, 0].set_ylabel("rms torque ripple (%)")
    panels[0, 0].legend(fontsize=7)
    return figure


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--machine", choices=[*quadrants.MACHINES], default="paper_6_4")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "control")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        at = bench(arguments.machine, Path(folder))
        rows = list(runs(at))
    out: Path = arguments.out
    out.mkdir(parents=True, exist_ok=True)
    quadrants.written(out / "voltage.csv", [asdict(row) for row in rows])
    plot(rows, arguments.machine).savefig(out / "voltage.png", dpi=90, metadata={"Software": None})
    base = from_si(quadrants.base_speed(at.at_rest()), "rpm")
    print(f"{arguments.machine}: base speed {base:.0f} rpm, {len(rows)} runs")


if __name__ == "__main__":
    main()
