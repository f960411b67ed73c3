"""Choose values of a drive so that a figure is best, and others keep their bounds."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import reluctance.explore.tuning.compass as compass
import reluctance.explore.tuning.optuna_search as optuna_search
import reluctance.explore.tuning.search as search
from reluctance.base.errors import Note, ParameterError
from reluctance.drive.drive import Drive, check_drive
from reluctance.explore.sweeps.result import Sweep
from reluctance.explore.sweeps.swept import figure_name
from reluctance.explore.sweeps.vary import Vary, checked
from reluctance.explore.tuning.goal import Goal, bound
from reluctance.explore.tuning.trials import Trial, Trials

BUDGET = 100  # trials


@dataclass(frozen=True)
class Tuned:
    """What a tuning found."""

    drive: Drive  # with the values that were found
    goal: Goal
    best: Trial
    tried: tuple[Trial, ...]  # in their order
    ran: int  # runs made now

    @property
    def table(self) -> Sweep:
        """All trials as a sweep, for tables and figures."""
        import numpy as np

        return Sweep(
            name=self.drive.name,
            values={name: [t.values[name] for t in self.tried] for name in self.best.values},
            figures={
                name: np.array([t.figures[name] for t in self.tried]) for name in self.best.figures
            },
            why=[t.why for t in self.tried],
            grid=(),
            ran=self.ran,
            known=0,
        )


def tune(
    drive: Drive,
    vary: Vary,
    minimise: str | None = None,
    *,
    maximise: str | None = None,
    keep: Sequence[str] = (),
    at: Sequence[Mapping[str, Any]] = (),
    budget: int = BUDGET,
    method: Literal["cobyla", "compass", "optuna"] = "cobyla",
    study: str | Path | None = None,
    until: float | None = None,
    out: str | Path | None = None,
    jobs: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Tuned:
    """The values of a drive file for which a key figure is best.

    Parameters
    ----------
    drive : Drive
    vary : mapping
        `section.key` to its range (two numbers) or to a list of choices.
    minimise, maximise : str
        The figure, one of the two; its mean over the operating points.
    keep : list of str
        Bounds as "f_switch_Hz<15e3", in the units of `run --json`; they must hold at each point.
    at : list of mapping
        Operating points as values of the drive file; by default the drive's own.
    budget : int
        Trials; each is a run at every operating point.
    method : str
        "cobyla": Sobol points, then COBYLA; "compass": of two ranges a grid, then a compass search;
        both are the same however often. "optuna": its sampler.
    study : str or Path, optional
        The store of Optuna.
    until, out, jobs, progress : as for `sweep`.

    Raises
    ------
    ParameterError
        If an argument cannot be meant, or no trial gives the figure.

    Examples
    --------
    >>> import reluctance as rl
    >>> from reluctance.explore.tuning import tune
    >>> drive = rl.load("examples/sharing_cubic.toml")
    >>> found = tune(
    ...     drive, {"control.i_band_A": [0.3, 3]}, "torque_error_rms",
    ...     keep=["f_switch_Hz<8e3"], until=0.03, budget=16,
    ... )
    >>> found.best.kept
    True
    """
    check_drive(drive, "tune")
    if (minimise is None) == (maximise is None):
        raise ParameterError("need either a figure to minimise or one to maximise")
    if isinstance(budget, bool) or not isinstance(budget, int) or budget < 2:
        raise ParameterError(f"budget = {budget!r}, need at least 2 trials")
    if method not in ("cobyla", "compass", "optuna"):
        raise ParameterError(f"method = {method!r}, need 'cobyla', 'compass' or 'optuna'")
    if study is not None and method != "optuna":
        raise ParameterError("study is Optuna's store; set method = 'optuna'")
    figure = figure_name(minimise or maximise or "")
    goal = Goal(figure, maximise is not None, tuple(bound(text) for text in keep))
    points = [dict(point) for point in at] or [{}]
    if any(set(point) != set(points[0]) for point in points):
        raise ParameterError("the operating points need the same keys")
    trials = Trials(
        drive,
        goal,
        vary=checked(vary),
        points=points,
        until=until,
        out=out,
        jobs=jobs,
        budget=budget,
        progress=progress,
    )
    if method == "optuna":
        optuna_search.search(trials, study)
    elif method == "compass":
        compass.search(trials)
    else:
        search.search(trials, trials.given())
    best = trials.best()
    if best.worth != best.worth:
        reason = next(
            (t.why for t in trials.tried if t.why),
            f"no trial has {figure}; what `reluctance run` shows says why, as that a loss is not "
            "counted, or a run too short (--until)",
        )
        raise ParameterError(f"none of the {len(trials.tried)} trials works: {reason}")
    as_given = trials.as_given()
    if as_given.rank < best.rank:
        warnings.warn(
            f"the drive as given is better than the best of {len(trials.tried)} trials: {figure} = "
            f"{as_given.figures[figure]:.4g} against {best.figures[figure]:.4g}; raise the budget "
            "(--budget), or narrow the ranges around its values",
            Note,
            stacklevel=2,
        )
    return Tuned(drive.with_values(best.values), goal, best, tuple(trials.tried), trials.ran)
