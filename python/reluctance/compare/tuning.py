"""Tuning: the switching frequency is met with one parameter, two further ones are searched for.

The frequency is met by bisection on the logarithm of the parameter, helped by the secant. The
search is coarse to fine: a grid over the unit square, then a compass search from its best point
with a step that halves. Every law has the same number of runs to spend.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import exp, log

from reluctance.compare.conditions import period
from reluctance.compare.contenders import Contender
from reluctance.drive import Drive
from reluctance.errors import ParameterError
from reluctance.run.kpis import Kpis, definite
from reluctance.run.simulate import simulate

TOLERANCE = 0.02  # of the switching frequency
MATCH_RUNS = 16  # for one set of values; 5 are usual
GRID = 5  # points a side of the coarse grid
LAST_STEP = 1 / 100  # of the unit square, about 1 deg
TIE = 1.05  # errors this close are equal; then rms current decides
RUN_PERIODS = 8  # electrical periods of a run; the second half is evaluated
NEVER = 1e-3  # a frequency of zero, for logarithms [Hz]


@dataclass(frozen=True)
class Trial:
    """A law with its values at one run."""

    values: dict[str, float]  # of [control]: the free parameter and the searched ones
    kpis: Kpis

    def off_target(self, f_target: float) -> float:
        """Logarithm of the frequency over its target."""
        return log(max(self.kpis.f_switch, NEVER) / f_target)

    def meets(self, f_target: float) -> bool:
        return bool(abs(self.kpis.f_switch / f_target - 1) <= TOLERANCE)


class Tuner:
    """Runs a contender at one operating point and counts the runs."""

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
        self.runs = 0
        self.ran_out = False  # the last match came to the end of the free parameter's range
        self.tried: list[Trial] = []  # that meet the target

    def run(self, values: dict[str, float]) -> Trial:
        """One run from zero current."""
        self.runs += 1
        drive = self.contender.drive(self.point, values)
        until = self.n_periods * period(self.point)
        return Trial(values, simulate(drive, until=until, record=None).kpis)

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
        free = self.contender.free
        low, high = (log(v) for v in free.range(self.point, self.f_target))
        x = min(max(log(start), low), high)
        slope = free.slope
        slow: tuple[float, float] | None = None  # (x, off target) of the nearest too slow run
        fast: tuple[float, float] | None = None
        best: Trial | None = None
        self.ran_out = False
        for n in range(MATCH_RUNS):
            trial = self.run({**values, free.key: float(f"{exp(x):.5g}")})
            y = trial.off_target(self.f_target)
            if best is None or abs(y) < abs(best.off_target(self.f_target)):
                best = trial
            if trial.meets(self.f_target) or not worth(trial):
                break
            if y > 0:
                fast = (x, y)
            else:
                slow = (x, y)
            if slow is not None and fast is not None:
                if abs(fast[0] - slow[0]) < 1e-3:
                    break  # the frequency jumps here: the target lies in the gap
                part = slow[1] / (slow[1] - fast[1]) if n % 3 != 2 else 0.5
                x = slow[0] + min(max(part, 0.1), 0.9) * (fast[0] - slow[0])
            else:
                step = -1.2 * y / slope  # a little too far, so that it ends up between
                if abs(step) < 0.02:
                    step = 0.02 if step > 0 else -0.02
                if x == (low if step < 0 else high):
                    self.ran_out = True
                    break
                x = min(max(x + step, low), high)
        assert best is not None
        return best

    def best(self) -> Trial:
        """The values of least rms torque error at the target frequency; of equal ones that of
        least rms current. If no run meets the target: of the nearest frequency."""
        place = self.contender.place
        start = self.start()
        best = self._keep(self.match({}, start))
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
                            place(self.point, x, y),
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

        cells = [(j + 0.5) / GRID for j in range(GRID)]
        at = min(((x, y) for x in cells for y in cells), key=lambda p: error(*p))
        step = 0.5 / GRID
        while step >= LAST_STEP and self.runs < self.budget:
            around = [(at[0] + dx * step, at[1] + dy * step) for dx, dy in COMPASS]
            inside = [p for p in around if 0 <= p[0] <= 1 and 0 <= p[1] <= 1]
            nearest = min(inside, key=lambda p: error(*p))
            if error(*nearest) < error(*at):
                at = nearest
            else:
                step /= 2
        equal = [t for t in self.tried if definite(t.kpis.torque_error_rms) <= TIE * self._least()]
        return min(equal, key=lambda t: t.kpis.i_rms) if equal else best

    def start(self) -> float:
        low, high = self.contender.free.range(self.point, self.f_target)
        return float((low * high) ** 0.5)

    def _keep(self, trial: Trial) -> Trial:
        if trial.meets(self.f_target):
            self.tried.append(trial)
        return trial

    def _least(self) -> float:
        return min(definite(t.kpis.torque_error_rms) for t in self.tried)

    def _figure(self, trial: Trial) -> float:
        """What the search makes least: the rms torque error, and before it the miss of the target
        where it is missed from above; a law that is too slow at best cannot help it."""
        missed = max(trial.off_target(self.f_target) - TOLERANCE, 0.0)
        return definite(trial.kpis.torque_error_rms) * (1 + 10 * missed)

    def _promises(self, trial: Trial, best: Trial) -> bool:
        """False if the error would be above the best even if it fell with the frequency."""
        part = min(1.0, trial.kpis.f_switch / self.f_target)
        return part * definite(trial.kpis.torque_error_rms) <= self._figure(best)


COMPASS = ((1, 0), (-1, 0), (0, 1), (0, -1))
