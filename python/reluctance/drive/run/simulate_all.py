"""Run many drives for their key figures, on all cores.

The core runs the loops on threads of its own, without the interpreter lock; Python meanwhile sets
up the next drives and evaluates those that have ended. No waveform is kept.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.base.key_figures import Kpis
from reluctance.drive.drive import Drive
from reluctance.drive.guard.supervised import controller
from reluctance.drive.laws.own_law import OwnLaw
from reluctance.drive.run.bounds import Bounds
from reluctance.drive.run.columns import Rows
from reluctance.drive.run.events import events
from reluctance.drive.run.kpis import kpis
from reluctance.drive.run.plant import closed_loop
from reluctance.drive.run.simulate import checked, simulate

WAITING = 4  # runs for each thread that are set up ahead: none of them waits for Python


def simulate_all(
    drives: Iterable[Drive],
    *,
    until: float | None = None,
    jobs: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> list[Kpis | ParameterError]:
    """Run many drives from zero current, on all cores.

    Parameters
    ----------
    drives : iterable of Drive
    until : float, optional
        End of each run [s]; by default each drive's own.
    jobs : int, optional
        Threads; by default as many as there are cores. A law in Python runs in this thread.
    progress : callable, optional
        Is told the part that is done.

    Returns
    -------
    list of Kpis or ParameterError
        In the order of the drives: the key figures as `simulate` gives them, or why there are none.

    Raises
    ------
    ParameterError
        If an argument is of the wrong kind.

    Examples
    --------
    >>> import reluctance as rl
    >>> drive = rl.load("examples/sharing_cubic.toml")
    >>> bands = [drive.with_values({"control.i_band_A": band}) for band in (0.5, 1, 2)]
    >>> [round(kpis.f_switch / 1e3) for kpis in rl.simulate_all(bands, until=0.04)]
    [7, 4, 2]
    """
    listed = list(drives)
    found: dict[int, Kpis | ParameterError] = {}
    for n, figures in finished(enumerate(listed), until=until, jobs=jobs):
        found[n] = figures
        if progress is not None:
            progress(len(found) / len(listed))
    return [found[n] for n in range(len(listed))]


def finished(
    drives: Iterable[tuple[int, Drive]], *, until: float | None = None, jobs: int | None = None
) -> Iterator[tuple[int, Kpis | ParameterError]]:
    """Numbered drives, taken as threads become free, and what their runs gave, as they end."""
    threads = jobs_of(jobs)
    runs = _core.Runs(threads)
    started: dict[int, _Started] = {}
    try:
        for n, drive in drives:
            end = checked(drive, until, None)
            if isinstance(drive.control, OwnLaw) or drive.machine.iron is not None:
                yield n, _alone(drive, end)
                continue
            try:
                started[n] = start = _started(drive, end)
            except (ParameterError, RuntimeError) as fault:  # the latter: no guide was found
                yield n, _reason(fault)
                continue
            runs.add(n, start.loop, end, start.within)
            while runs.unfinished >= WAITING * threads:
                yield _taken(runs, started)
        while runs.unfinished:
            yield _taken(runs, started)
    finally:
        runs.close()


def jobs_of(jobs: int | None) -> int:
    """The number of threads; by default the cores that this process may use."""
    if jobs is None:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 1
    if isinstance(jobs, bool) or not isinstance(jobs, int) or not 1 <= jobs <= 1024:
        raise ParameterError(f"jobs = {jobs!r}, need a number of threads from 1 to 1024")
    return jobs


@dataclass(frozen=True)
class _Started:
    """A run on its way."""

    drive: Drive
    bounds: Bounds
    controller: _core.Controller
    loop: _core.Simulation

    @property
    def within(self) -> _core.Within:
        return self.bounds.within()


def _started(drive: Drive, end: float) -> _Started:
    bounds = Bounds(drive, end, None)
    guarded = controller(drive)
    return _Started(drive, bounds, guarded, closed_loop(drive, guarded, -1.0))


def _taken(runs: _core.Runs, started: dict[int, _Started]) -> tuple[int, Kpis | ParameterError]:
    """The key figures of a run that has ended."""
    n, t, wall, values = runs.take()
    run = started.pop(n)
    try:
        run.bounds.check(run.loop, t, 0)
    except ParameterError as fault:
        return n, fault
    rows = Rows(np.asarray(values), _core.period_columns(run.drive.machine.n_phases))
    entered = events(run.controller)
    return n, kpis(rows, run.drive, p_fe=None, wall_s_per_sim_s=wall / t, entered=entered)


def _alone(drive: Drive, end: float) -> Kpis | ParameterError:
    """Of a drive that needs Python or waveforms while it runs."""
    try:
        return simulate(drive, until=end, record=None).kpis
    except (ParameterError, RuntimeError) as fault:
        return _reason(fault)


def _reason(fault: Exception) -> ParameterError:
    return fault if isinstance(fault, ParameterError) else ParameterError(str(fault))
