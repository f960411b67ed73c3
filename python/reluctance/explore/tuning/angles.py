"""Tune turn-on and turn-off angle at each node of a grid of speeds and torques.

Every node is a tuning of its own, on a locked shaft. It starts from the angles of the law's own
rule and from those of the neighbours that are done, besides the points of the search.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from reluctance.base.errors import ParameterError
from reluctance.base.files import check_ending, write_whole
from reluctance.base.units import to_si
from reluctance.drive.drive import Drive
from reluctance.drive.laws.angle_table import COLUMNS, NOTE
from reluctance.drive.laws.angles import Angles
from reluctance.drive.laws.pulses import pulses
from reluctance.explore.efficiency_map import locked
from reluctance.explore.sweeps.swept import figure_name
from reluctance.explore.sweeps.vary import Vary, checked
from reluctance.explore.tuning.goal import Bound, Goal, bound
from reluctance.explore.tuning.search import search
from reluctance.explore.tuning.trials import Trial, Trials, Values

BUDGET = 40  # trials of a node
HELD = 0.98  # of the torque: what the mean has to reach
KEYS = ("control.theta_on_deg", "control.theta_off_deg")
RANGES = ((-120.0, 60.0), (90.0, 178.0))  # of the angles, where none are given [deg]


@dataclass(frozen=True)
class Node:
    """Angles at a speed and a torque, under border units."""

    speed_rpm: float
    torque_Nm: float
    theta_on_deg: float
    theta_off_deg: float
    figures: dict[str, float]  # of the run with them; empty where there is none
    note: str  # what is not as it was asked for

    @property
    def row(self) -> dict[str, Any]:
        """As in the CSV file."""
        angles = {name: getattr(self, name) for name in COLUMNS}
        told = {name: float(f"{value:.6g}") for name, value in self.figures.items()}
        return angles | told | {NOTE: self.note}


@dataclass(frozen=True)
class TunedAngles:
    """What the tuning of a grid found; the last axis, torque, varies fastest."""

    name: str  # of the drive
    goal: Goal
    nodes: tuple[Node, ...]
    tried: int
    ran: int  # runs made now

    def save(self, path: str | Path) -> None:
        """Writes the CSV file that `angle_table` of a drive file names.

        Raises
        ------
        ParameterError
            If the ending is not .csv or the disk does not take it.
        """
        check_ending(Path(path), {".csv"})
        write_whole(Path(path), self._write)

    def _write(self, path: Path) -> None:
        names = dict.fromkeys(name for node in self.nodes for name in node.row if name != NOTE)
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, [*names, NOTE], lineterminator="\n")
            writer.writeheader()
            writer.writerows(node.row for node in self.nodes)


def tune_angles(
    drive: Drive,
    over: Mapping[str, Sequence[float]],
    minimise: str | None = None,
    *,
    maximise: str | None = None,
    keep: Sequence[str] = (),
    vary: Vary | None = None,
    budget: int = BUDGET,
    out: str | Path | None = None,
    jobs: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> TunedAngles:
    """Turn-on and turn-off angles over speed and torque for which a key figure is best.

    Parameters
    ----------
    drive : Drive
        With the law `angles`. Load and reference are replaced by a locked shaft and a torque.
    over : mapping
        "speed_rpm" and "torque_Nm" to rising values, at least two of each.
    minimise, maximise : str
        The figure, one of the two.
    keep : list of str
        Bounds as "i_rms_A<50". Besides them, the mean torque is at least 98 % of the node's.
    vary : mapping, optional
        Other ranges of `control.theta_on_deg` and `control.theta_off_deg`.
    budget : int
        Trials of a node.
    out, jobs, progress : as for `sweep`.

    Returns
    -------
    TunedAngles
        A node that no angles hold has those of the greatest torque, and a note.

    Raises
    ------
    ParameterError
        If an argument cannot be meant.

    Examples
    --------
    >>> import reluctance as rl
    >>> from reluctance.explore.tuning import tune_angles
    >>> drive = rl.load("examples/paper_rated.toml", ["control.law=angles"])
    >>> grid = {"speed_rpm": [1000, 2000], "torque_Nm": [10, 20]}
    >>> found = tune_angles(drive, grid, "p_cu", budget=8)
    >>> [node.note for node in found.nodes]
    ['', '', '', '']
    """
    if (minimise is None) == (maximise is None):
        raise ParameterError("need either a figure to minimise or one to maximise")
    if isinstance(budget, bool) or not isinstance(budget, int) or budget < 6:
        raise ParameterError(f"budget = {budget!r}, need at least 6 trials of each node")
    speeds, torques = _axes(over)
    bounds = tuple(bound(text) for text in keep)
    goal = Goal(figure_name(minimise or maximise or ""), maximise is not None, bounds)
    ranges = _ranges(vary)
    based = _without_angles(drive)
    found: dict[tuple[int, int], Node] = {}
    tried = ran = 0
    count = len(speeds) * len(torques)
    for j, speed in enumerate(speeds):
        for k, torque in enumerate(torques):
            here = locked.at(
                based,
                u_dc=drive.converter.u_dc_V,
                omega=to_si(speed, "rpm"),
                tau=torque,
                tau_max=torque,
            )
            held = Bound("tau_mean_Nm", True, HELD * torque)
            trials = Trials(
                here,
                Goal(goal.figure, goal.most, (held, *bounds)),
                vary=ranges,
                until=locked.length(here, to_si(speed, "rpm")),
                out=out,
                jobs=jobs,
                budget=budget,
                progress=_part(progress, len(found), count),
            )
            rule = _by_rule(here)
            done = [found[at] for at in ((j, k - 1), (j - 1, k)) if at in found]
            starts = [rule, *((node.theta_on_deg, node.theta_off_deg) for node in done)]
            search(trials, [_within(ranges, angles) for angles in starts])
            found[j, k] = _node(here, speed, torque, trials, rule)
            tried, ran = tried + len(trials.tried), ran + trials.ran
            if progress is not None:
                progress(len(found) / count)
    return TunedAngles(drive.name, goal, tuple(found.values()), tried, ran)


def _axes(over: Mapping[str, Sequence[float]]) -> tuple[list[float], list[float]]:
    names = COLUMNS[:2]
    if not isinstance(over, Mapping) or set(over) != set(names):
        told = ", ".join(over) if isinstance(over, Mapping) else repr(over)
        raise ParameterError(f"over {told}: need {names[0]} and {names[1]}, each with its values")
    axes = checked(over)
    for name in names:
        values = axes[name]
        if not all(isinstance(v, int | float) and 0 < v < np.inf for v in values):
            raise ParameterError(f"over {name} = {values}, need numbers > 0")
        if len(values) < 2 or any(b <= a for a, b in pairwise(values)):
            raise ParameterError(f"over {name} = {values}, need at least two rising values")
    return axes[names[0]], axes[names[1]]


def _ranges(vary: Vary | None) -> dict[str, list[Any]]:
    ranges = {key: list(ends) for key, ends in zip(KEYS, RANGES, strict=True)}
    for name, ends in checked(vary).items() if vary else ():
        numbers = all(isinstance(v, int | float) and not isinstance(v, bool) for v in ends)
        if name not in KEYS or not numbers or len(ends) != 2 or ends[0] >= ends[1]:
            raise ParameterError(
                f"vary {name} = {ends}: over speed and torque need ranges of {' and '.join(KEYS)}"
            )
        ranges[name] = [*ends]
    return ranges


def _without_angles(drive: Drive) -> Drive:
    """The drive with the angles left to the law's rule."""
    control = drive.control
    if not isinstance(control, Angles):
        raise ParameterError("angles over speed and torque need [control] law = 'angles'")
    if not control.follows_torque:
        raise ParameterError(
            "angles over speed and torque need a torque to follow; remove [control] i_ref_A and "
            "regulate, and give a [reference]"
        )
    given = (*KEYS, "control.angle_table")
    known = [name for name in given if getattr(control, name.partition(".")[2]) is not None]
    return drive.with_values(dict.fromkeys(known)) if known else drive


def _by_rule(drive: Drive) -> tuple[float, float]:
    """The angles of the law's own rule [deg]."""
    assert isinstance(drive.control, Angles)
    on, off = np.degrees(drive.control.window(drive.known()))
    return float(on), float(off)


def _within(ranges: Mapping[str, list[Any]], angles: tuple[float, float]) -> Values:
    clipped = (np.clip(a, *ends) for a, ends in zip(angles, ranges.values(), strict=True))
    return {name: float(f"{a:.6g}") for name, a in zip(ranges, clipped, strict=True)}


def _node(
    drive: Drive, speed: float, torque: float, trials: Trials, rule: tuple[float, float]
) -> Node:
    """The best trial that holds the torque, whatever else it misses; where none does, the rule's
    angles, which give most of it."""
    holding = [t for t in trials.tried if np.isfinite(t.worth) and t.misses[0] <= 0]
    if not holding:
        known = replace(drive.known(), omega_m=to_si(speed, "rpm"))
        assert isinstance(drive.control, Angles)
        law = drive.control.fixed(known, brakes=False)
        most = float(pulses(law, np.radians(rule[0]), np.radians(rule[1]), known.i_max).tau)
        note = f"out of reach: these angles give at most {most:.4g} N m"
        return Node(speed, torque, *rule, {}, note)
    best = min(holding, key=lambda trial: trial.rank)
    names = dict.fromkeys(
        [trials.goal.figure, "tau_mean_Nm", *(b.figure for b in trials.goal.bounds)]
    )
    figures = {name: best.figures[name] for name in names}
    on, off = (float(best.values[key]) for key in KEYS)
    return Node(speed, torque, on, off, figures, _missed(best, trials.goal))


def _missed(best: Trial, goal: Goal) -> str:
    missed = [str(b) for b, miss in zip(goal.bounds, best.misses, strict=True) if miss > 0]
    return f"misses {' and '.join(missed)}" if missed else ""


def _part(
    progress: Callable[[float], None] | None, done: int, count: int
) -> Callable[[float], None] | None:
    """The progress of a node as a part of all."""
    if progress is None:
        return None
    return lambda part: progress((done + part) / count)
