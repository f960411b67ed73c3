"""Tuning of a contender: the switching frequency is met with one value, two others are searched.

The trials, the matching of the frequency and the search are those of `reluctance tune`. Every law
has the same number of runs to spend.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property

from reluctance.base.errors import ParameterError
from reluctance.drive.drive import Drive
from reluctance.explore.comparison.conditions import period
from reluctance.explore.comparison.contenders import Contender
from reluctance.explore.tuning.compass import compass
from reluctance.explore.tuning.goal import Goal, Target
from reluctance.explore.tuning.match import Lever, match
from reluctance.explore.tuning.trials import Trial, Trials

TOLERANCE = 0.02  # of the switching frequency
TIE = 1.05  # errors this close are equal; then rms current decides
RUN_PERIODS = 8  # electrical periods of a run; the second half is evaluated
SECTION = "control."


class Tuner:
    """Runs a contender at one operating point and counts the runs. Values are keys of [control]."""

    def __init__(
        self,
        point: Drive,
        contender: Contender,
        f_target: float,
        budget: int,
        *,
        n_periods: int = RUN_PERIODS,
    ) -> None:
        self.point, self.contender, self.f_target, self.budget = point, contender, f_target, budget
        self.n_periods = n_periods  # of a run
        self.target = Target("f_switch_Hz", f_target, TOLERANCE)
        self.runs = 0
        self.ran_out = False  # the last match came to the end of the free parameter's range
        self.tried: list[Trial] = []  # that meet the target

    @cached_property
    def lever(self) -> Lever:
        """The free parameter, as far as the law is known to work."""
        contender = self.contender
        return Lever(*contender.range(self.point, self.f_target), contender.free.slope)

    @cached_property
    def trials(self) -> Trials:
        drive = self.contender.drive(self.point, {})
        goal = Goal("torque_error_rms", False, (self.target,))
        return Trials(drive, goal, until=self.n_periods * period(self.point), jobs=1)

    def run(self, values: dict[str, float]) -> Trial:
        """One run from zero current.

        Raises
        ------
        ParameterError
            If the law cannot work with these values.
        """
        self.runs += 1
        (trial,) = self.trials.run([{SECTION + key: v for key, v in values.items()}])
        if trial.why:
            raise ParameterError(trial.why)
        return replace(trial, values=values)

    def match(
        self,
        values: dict[str, float],
        start: float,
        *,
        worth: Callable[[Trial], bool] = lambda trial: True,
    ) -> Trial:
        """The run nearest to the target frequency, over the free parameter, from a first guess.

        `worth` may stop it after a run that promises nothing.
        """
        free = self.contender.free.key
        found = match(
            lambda value: self.run({**values, free: value}),
            self.target,
            self.lever,
            start,
            worth=worth,
        )
        self.ran_out = found.ran_out
        return found.trial

    def best(self) -> Trial:
        """The values of least rms torque error at the target frequency; of equal ones that of
        least rms current. If no run meets the target: of the nearest frequency."""
        place = self.contender.place
        best = self._keep(self._first())
        if place is None:
            return best
        known: dict[tuple[float, float], float] = {}

        def error(x: float, y: float) -> float:
            nonlocal best
            if (x, y) not in known:
                known[x, y] = float("inf")
                if self.runs < self.budget:
                    try:
                        trial = self.match(
                            place(self.point.machine.n_phases, x, y),
                            best.values[self.contender.free.key],
                            worth=lambda trial: self._promises(trial, best),
                        )
                    except ParameterError:  # these angles cannot work
                        return known[x, y]
                    known[x, y] = self._figure(trial)
                    if known[x, y] < self._figure(best):
                        best = trial
                    self._keep(trial)
            return known[x, y]

        compass(error, lambda: self.runs < self.budget)
        equal = [t for t in self.tried if definite_error(t) <= TIE * self._least()]
        return min(equal, key=lambda t: t.figures["i_rms_A"]) if equal else best

    def _first(self) -> Trial:
        """The law with its own numbers. Where it cannot work in the middle of the free parameter's
        range, that is narrowed towards what switches more: down to its end."""
        while True:
            try:
                return self.match({}, self.lever.middle)
            except ParameterError:
                if self.lever.high < 1.1 * self.lever.low:
                    raise
                self.lever = self.lever.narrowed()

    def _keep(self, trial: Trial) -> Trial:
        if self.target.met(trial.figures):
            self.tried.append(trial)
        return trial

    def _least(self) -> float:
        return min(definite_error(t) for t in self.tried)

    def _figure(self, trial: Trial) -> float:
        """What the search makes least: the rms torque error, and before it the miss of the target
        where it is missed from above; a law that is too slow at best cannot help it."""
        missed = max(self.target.off(trial.figures) - TOLERANCE, 0.0)
        return definite_error(trial) * (1 + 10 * missed)

    def _promises(self, trial: Trial, best: Trial) -> bool:
        """False if the error would be above the best even if it fell with the frequency."""
        part = min(1.0, trial.figures["f_switch_Hz"] / self.f_target)
        return part * definite_error(trial) <= self._figure(best)


def definite_error(trial: Trial) -> float:
    """The rms torque error of a run that has one.

    Raises
    ------
    RuntimeError
        If there is no torque, no reference or no speed.
    """
    error = trial.figures["torque_error_rms"]
    if error != error:
        raise RuntimeError("a key figure without meaning here: no torque, no reference or no speed")
    return error
