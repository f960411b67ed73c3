"""Question: what do the poles and the law gain together that each does not gain alone?

    python studies/geometry_tune.py [--out DIR] [--budget N]

The 6/4 machine of machines/geometry/onelab_6_4.toml with cubic torque sharing at 600 rpm, 3 N m and
300 V. Least rms torque error at no more copper loss than before the tuning: over the angles of the
law, over both pole arcs and the bore, over the angles of the law on what that found, and over all
five. Every set of dimensions is a field
solution of its own; the outer diameter, the pole heights, the gap and the turns stay, so that a
wider bore takes its space from the stator's yoke, and a wider pole from the winding.

Writes geometry_tune.csv, a row for the machine as it is and for each tuning, and
geometry_tune.png.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

import reluctance as rl
from reluctance.explore.tuning import Tuned, tune

ROOT = Path(__file__).parents[1]
SETTINGS = [
    f"machine={ROOT / 'machines' / 'geometry' / 'onelab_6_4.toml'}",
    "machine.map.angles=16",
    "machine.map.currents=11",
    "machine.map.current_max_A=16",
    "converter.u_dc_V=300",
    "load.speed_rpm=600",
    "reference.tau_Nm=3",
    "control.i_band_A=0.1",
]
LAW = {"control.theta_on_deg": [0.0, 15.0], "control.theta_ov_deg": [25.0, 45.0]}
POLES = {
    "machine.stator.pole_arc_deg": [26.0, 38.0],
    "machine.rotor.pole_arc_deg": [26.0, 42.0],
    "machine.stator.bore_diameter_mm": [54.0, 66.0],
}
WAYS = {"law": LAW, "poles": POLES, "law after poles": LAW, "both": LAW | POLES}
FIGURES = ("torque_error_rms", "p_cu_W", "i_peak_A", "f_switch_Hz")
LABELS = {
    **{"law": "angles of the law", "poles": "pole arcs and bore"},
    **{"law after poles": "the law on the tuned poles", "both": "all five"},
}
COLOURS = ("#0072B2", "#E69F00", "#CC79A7", "#009E73")
TICKS = (1, 2, 5, 10, 20)  # of the picture [%]
BUDGET = 80  # trials of each tuning
UNTIL = 0.15  # [s]


def drive() -> rl.Drive:
    """The machine as it is, with the angles that the law has by rule."""
    return rl.load(ROOT / "examples" / "sharing_cubic.toml", SETTINGS)


def value(drive: rl.Drive, key: str) -> str:
    """Of a dotted key in a drive; empty where the drive leaves it to a rule."""
    at: Any = drive.tables()
    for word in key.split("."):
        at = at.get(word) if at is not None else None
    return "" if at is None else f"{at:.5g}"


def row(tuned: str, drive: rl.Drive, trials: int) -> dict[str, str]:
    """Values, as in `stator_pole_arc_deg`, and key figures of a drive."""
    kpis = rl.simulate(drive, until=UNTIL, record=None).kpis.with_units()
    cells = {"_".join(key.split(".")[-2:]): value(drive, key) for key in WAYS["both"]}
    figures = {name: f"{kpis[name]:.5g}" for name in FIGURES}
    return {"tuned": tuned, "trials": str(trials)} | cells | figures


def figure(found: Mapping[str, Tuned], most: float) -> Figure:
    """Every trial: torque error over copper loss; the best of each tuning filled."""
    drawn = Figure(figsize=(7, 4.2), layout="constrained")
    axes = drawn.subplots()
    for (name, tuned), colour in zip(found.items(), COLOURS, strict=True):
        trials = [t for t in tuned.tried if np.isfinite(t.worth)]
        x = [t.figures["p_cu_W"] for t in trials]
        y = [100 * t.figures["torque_error_rms"] for t in trials]
        axes.plot(x, y, "o", mfc="none", ms=4, color=colour, label=LABELS[name])
        best = tuned.best.figures
        axes.plot(best["p_cu_W"], 100 * best["torque_error_rms"], "o", ms=9, color=colour)
    axes.axvline(most, color="k", lw=0.8, ls="--", label="copper loss before the tuning")
    axes.set(xlabel="copper loss [W]", ylabel="torque error, rms [%]", yscale="log")
    axes.set_yticks(TICKS, labels=[f"{tick:g}" for tick in TICKS])
    axes.minorticks_off()
    axes.legend(fontsize=8)
    return drawn


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=ROOT / "docs")
    parser.add_argument("--budget", type=int, default=BUDGET, help="trials of each tuning")
    arguments = parser.parse_args()
    before = drive()
    rows = [row("nothing", before, 0)]
    most = float(rows[0]["p_cu_W"])
    found: dict[str, Tuned] = {}
    for name, vary in WAYS.items():
        start = found["poles"].drive if name == "law after poles" else before
        found[name] = tuned = tune(
            start,
            vary,
            "torque_error_rms",
            keep=[f"p_cu_W<{most}"],
            until=UNTIL,
            budget=arguments.budget,
        )
        rows.append(row(name, tuned.drive, len(tuned.tried)))
        print(rows[-1], flush=True)
    with (arguments.out / "geometry_tune.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    picture = figure(found, most)
    picture.savefig(arguments.out / "geometry_tune.png", dpi=90, metadata={"Software": None})


if __name__ == "__main__":
    main()
