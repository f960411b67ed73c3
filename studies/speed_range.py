"""Question: how do the laws fare from standstill to twice the rated speed?

    python studies/speed_range.py [--out DIR] [--quick]

At each speed every law is tuned as by `reluctance compare` (10 kHz per switch, angles searched) and
asked for the rated torque; then for more and more, with its angles by rule, to find the greatest
torque that it follows: mean within 2 % of the reference, current within 5 % of its limit. Figure
and table: ripple, rms current and torque over speed, beside the physical limit. Standstill is
2 % of the rated speed, with angles by rule and one electrical period evaluated: at 0 none ends.

A predictive law has one guide for the whole study, over torque up to the top and the speeds from
the rated one on, as a drive would have it.
"""

from __future__ import annotations

import argparse
import csv
import multiprocessing
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import reluctance as rl
from reluctance.base.errors import ParameterError
from reluctance.base.picture import Picture
from reluctance.drive.drive import Drive
from reluctance.drive.laws import table_of
from reluctance.drive.laws.guided import Guided
from reluctance.explore.comparison.comparison import PROCESSES, best_profile
from reluctance.explore.comparison.conditions import operating_point, period
from reluctance.explore.comparison.contenders import CONTENDERS, Contender
from reluctance.explore.comparison.figure import style
from reluctance.explore.comparison.tuning import Tuner
from reluctance.machine import optimum

RATED = Path(__file__).parents[1] / "examples" / "paper_rated.toml"
SETTINGS = ["control.T_s_us=5"]
F_SWITCH = 10e3  # [Hz]
PARTS = (0.02, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0)  # of the rated speed
SLOW = 0.1  # of the rated speed: below it one period is evaluated, angles by rule
BUDGET = 60  # runs of a search
LEFT_OUT = ("finite_set_short", "finite_set_mpc_3")  # hopeless; minutes for what horizon 1 gives
LEVELS = 24  # of the capability search
FOLLOWS, CURRENT_SLACK = 0.98, 1.05


@dataclass(frozen=True)
class Row:
    """A law, or the limit, at one speed. NaN where it has no such figure."""

    control: str
    speed_rpm: float
    f_switch_Hz: float
    torque_mean_Nm: float
    torque_error_rms: float
    torque_ripple_pp: float
    i_rms_A: float
    p_cu_W: float
    torque_capability_Nm: float


@dataclass(frozen=True)
class Task:
    """A law at one speed."""

    point: Drive
    contender: Contender
    slow: bool
    budget: int
    top: float  # of the capability search [N m]


def at_speed(drive: Drive, part: float) -> Drive:
    """The rated operating point at a part of its speed."""
    load = drive.load.model_copy(update={"speed_rpm": part * drive.load.speed_rpm})
    return replace(drive, load=load)


def with_guide(contender: Contender, speeds: list[float], top: float) -> Contender:
    """The law, with one guide for all points if it follows one."""
    if not issubclass(table_of(contender.law), Guided):
        return contender
    guide = (("guide_speed_rpm", speeds), ("tau_max_Nm", top))
    return replace(contender, keys=(*contender.keys, *guide))


def measured(task: Task) -> Row:
    """One law at one speed."""
    contender = task.contender
    slow = {"n_periods": 2, "budget": 0} if task.slow else {"budget": task.budget}
    tuner = Tuner(task.point, contender, F_SWITCH, **slow)
    speed_rpm = task.point.load.speed_rpm
    try:
        best = tuner.match({}, tuner.lever.middle) if task.slow else tuner.best()
    except ParameterError:
        return Row(contender.name, speed_rpm, *[np.nan] * 7)
    f = best.figures
    return Row(
        contender.name,
        speed_rpm,
        f["f_switch_Hz"],
        f["tau_mean_Nm"],
        f["torque_error_rms"],
        f["torque_ripple_pp"],
        f["i_rms_A"],
        f["p_cu_W"],
        capability(task, best.values[contender.free.key]),
    )


def capability(task: Task, free: float) -> float:
    """The greatest of LEVELS torques that the law follows, asked from above [N m]."""
    contender = task.contender

    def follows(level: int) -> bool:
        tau = task.top * level / LEVELS
        reference = task.point.reference.model_copy(update={"tau_Nm": tau})
        point = replace(task.point, reference=reference)
        try:
            drive = contender.drive(point, {contender.free.key: free})
            until = (2 if task.slow else 4) * period(point)
            k = rl.simulate(drive, until=until, record=None).kpis
        except ParameterError:
            return False
        return k.tau_mean >= FOLLOWS * tau and k.i_peak <= CURRENT_SLACK * drive.machine.i_max_A

    return task.top * next(filter(follows, range(LEVELS, 0, -1)), 0) / LEVELS


def bound(points: list[Drive]) -> list[Row]:
    """The limit at each speed: least error and copper at the rated torque, ripple-free torque."""
    speeds = [p.omega_nominal for p in points]
    envelope = optimum.torque_speed_envelope(points[0].at(speeds[0]), speeds)
    rows = []
    for point, tau_max in zip(points, envelope.tau_max, strict=True):
        b = best_profile(point)
        rows.append(
            Row(
                "limit",
                point.load.speed_rpm,
                np.nan,
                b.tau_ref,
                b.tau_error_rms / b.tau_ref,
                np.nan,
                b.i_rms,
                b.p_cu,
                float(tau_max),
            )
        )
    return rows


def study(parts: tuple[float, ...], controls: list[str], budget: int) -> list[Row]:
    """All rows: the limit first, then each law over speed."""
    rated = operating_point(rl.load(RATED, SETTINGS))
    points = [at_speed(rated, part) for part in parts]
    limits = bound(points)
    top = 1.2 * max(row.torque_capability_Nm for row in limits)
    speeds = [p.load.speed_rpm for p in points if p.load.speed_rpm >= rated.load.speed_rpm]
    contenders = [with_guide(CONTENDERS[control], speeds, top) for control in controls]
    tasks = [
        Task(point, contender, part < SLOW, budget, top)
        for contender in contenders
        for part, point in zip(parts, points, strict=True)
    ]
    with multiprocessing.get_context("spawn").Pool(PROCESSES) as pool:
        return [*limits, *pool.imap(measured, tasks)]


def plot(rows: list[Row]) -> Figure:
    """Error, rms current and capability over speed."""
    figure = Picture(15, 5)
    panels = figure.subplots(1, 3)
    for control in dict.fromkeys(row.control for row in rows):
        mine = [row for row in rows if row.control == control]
        look = {"color": "k", "lw": 2, "ls": ":"} if control == "limit" else style(control)
        speed = [row.speed_rpm for row in mine]
        for ax, values in zip(
            panels,
            (
                [100 * max(row.torque_error_rms, 1e-6) for row in mine],
                [row.i_rms_A for row in mine],
                [row.torque_capability_Nm for row in mine],
            ),
            strict=True,
        ):
            ax.plot(speed, values, label=control, **look)
    for ax, label in zip(
        panels,
        (
            "rms torque error at the rated torque (%)",
            "rms phase current at the rated torque (A)",
            "greatest torque that is followed (N m)",
        ),
        strict=True,
    ):
        ax.set(xlabel="speed (rpm)", ylabel=label)
        ax.grid(alpha=0.3)
    panels[0].set(yscale="log", ylim=(0.1, 100))
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside right upper", fontsize=8)
    return figure


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out/speed_range"))
    parser.add_argument("--quick", action="store_true", help="two laws, two speeds, short search")
    arguments = parser.parse_args()
    if arguments.quick:
        rows = study((1.0, 2.0), ["sharing_cubic", "deadbeat"], 10)
    else:
        controls = [name for name in CONTENDERS if name not in LEFT_OUT]
        rows = study(PARTS, controls, BUDGET)
    out: Path = arguments.out
    out.mkdir(parents=True, exist_ok=True)
    with (out / "speed_range.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, list(asdict(rows[0])), lineterminator="\n")
        writer.writeheader()
        writer.writerows(asdict(row) for row in rows)
    plot(rows).savefig(out / "speed_range.png", dpi=80, metadata={"Software": None})
    for row in rows:
        print(
            f"{row.control:20s} {row.speed_rpm:6.0f} rpm  error {100 * row.torque_error_rms:6.2f} %"
            f"  {row.i_rms_A:6.2f} A rms  up to {row.torque_capability_Nm:5.1f} N m"
        )


if __name__ == "__main__":
    main()
