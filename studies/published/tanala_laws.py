"""Question: what ripple do other laws leave the 12/8 e-bike drive, at no more switching?

    python studies/published/tanala_laws.py [--out FILE]

The operating points of tanala_sharing.py, with its voltage, drops and current limit. A law samples
at 40 kHz, or at the next multiple of 25 us at which the edges of the switches of a phase in a
period are no more than the published changes of state, each of which is an edge or two. At the
points where the source finds no torque reference nothing limits the edges. `published` is the
source's control in this program, `fine_table` the same with a reference of current for the angle of
each sample, and `same_angles` the law `torque_sharing` at the angles of the source and at its
samples; their torque references are raised to the mean torque. Both laws of torque sharing have the
band of the source, +-0.1 A; no other key is given. `limit` is the least current of a torque without
ripple, and the lower bound of the ripple at so many edges.

Writes docs/published_laws.csv, a row for each point and law.
"""

from __future__ import annotations

import argparse
import csv
import math
from pathlib import Path
from typing import Any

from scipy.optimize import brentq
from tanala_sharing import (
    F_SAMPLE,
    N_R,
    NONE_FOUND,
    ON,
    OVERLAP,
    POINTS,
    Point,
    drive,
    trimmed,
)

import reluctance as rl
from reluctance.base.key_figures import Kpis, definite

LAWS = "torque_sharing", "ditc", "deadbeat", "finite_set_mpc", "edge_mpc"
LONGEST = 8  # control period [1/F_SAMPLE]
BAND: dict[str, float] = {"i_band_A": 0.1}
SAME_ANGLES = {**BAND, "theta_on_deg": N_R * ON, "theta_ov_deg": N_R * OVERLAP}
COLUMNS = (
    *("point", "law", "T_s_us", "tau_mean_Nm", "ripple_pct", "i_rms_A"),
    *("edges", "changes_published"),
)


def label(point: Point) -> str:
    """Speed [rpm] and torque [N m]."""
    return f"{point.rpm:.0f}/{point.tau:g}"


def edges(k: Kpis, point: Point) -> float:
    """Of the two switches of a phase in a period, on and off."""
    return 4 * k.f_switch * point.period


def line(point: Point, law: str, T_s: float | None, k: Kpis) -> dict[str, Any]:
    return {
        "point": label(point),
        "law": law,
        "T_s_us": "" if T_s is None else f"{T_s * 1e6:.4g}",
        "tau_mean_Nm": f"{k.tau_mean:.4g}",
        "ripple_pct": f"{100 * definite(k.torque_ripple_pp):.4g}",
        "i_rms_A": f"{k.i_rms:.4g}",
        "edges": f"{edges(k, point):.4g}",
        "changes_published": "" if math.isnan(point.changes) else f"{point.changes:g}",
    }


def same_angles(point: Point) -> dict[str, Any]:
    """The law of this program that the source's is nearest to."""

    def kpis(tau: float) -> Kpis:
        given = drive(point, {"law": "torque_sharing", **SAME_ANGLES}, tau=tau)
        return rl.simulate(given, record=None).kpis

    least, most = 0.9 * point.tau, 2 * point.tau
    tau = brentq(lambda t: kpis(t).tau_mean - point.tau, least, most, xtol=1e-3)
    return line(point, "same_angles", point.period / point.steps, kpis(tau))


def by_itself(point: Point, law: str) -> dict[str, Any]:
    """A law at the shortest period that keeps to the edges."""
    for multiple in range(1, LONGEST + 1):
        T_s = multiple / F_SAMPLE
        control = {"law": law, "T_s_us": T_s * 1e6, **(BAND if law == "torque_sharing" else {})}
        k = rl.simulate(drive(point, control), record=None).kpis
        if math.isnan(point.changes) or edges(k, point) <= point.changes:
            break
    return line(point, law, T_s, k)


def limit(point: Point) -> dict[str, Any]:
    """Of any control. Four edges make a turn-on of each of the two switches."""
    f = None if math.isnan(point.changes) else point.changes / (4 * point.period)
    best = rl.limit(drive(point, {"law": "torque_sharing"}), switching_frequency=f)
    return {
        "point": label(point),
        "law": "limit",
        "tau_mean_Nm": f"{point.tau:.4g}",
        "ripple_pct": f"{100 * best.floor.bound_pp / point.tau:.4g}" if best.floor else "0",
        "i_rms_A": f"{best.least_copper.i_rms:.4g}",
        "edges": f"{point.changes:g}" if best.floor else "",
        "changes_published": f"{point.changes:g}" if best.floor else "",
    }


def of(point: Point) -> list[dict[str, Any]]:
    """The rows of a point."""
    own = [by_itself(point, law) for law in LAWS]
    if point in POINTS:
        T_s, fine = point.period / point.steps, 360 / N_R / point.steps
        first = [
            line(point, "published", T_s, trimmed(point)[0].kpis),
            line(point, "fine_table", T_s, trimmed(point, fine)[0].kpis),
        ]
        own = [*first, same_angles(point), *own]
    return [*own, limit(point)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    default = Path(__file__).parents[2] / "docs" / "published_laws.csv"
    parser.add_argument("--out", type=Path, default=default)
    arguments = parser.parse_args()
    with arguments.out.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        for point in (*POINTS, *NONE_FOUND):
            for row in of(point):
                writer.writerow(row)
                print(*row.values(), sep="  ", flush=True)


if __name__ == "__main__":
    main()
