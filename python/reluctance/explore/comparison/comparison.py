"""Compare control laws at one operating point and one switching frequency."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.drive.drive import Drive, check_drive
from reluctance.explore import limits
from reluctance.explore.comparison.conditions import operating_point
from reluctance.explore.comparison.contenders import chosen, contender
from reluctance.explore.comparison.contest import OCTAVES, Entry, contest
from reluctance.machine import optimum

PROCESSES = 2
STEP_PASSES = 5  # over the samples of a run; the least mean counts

Task = tuple[Drive, str, float, tuple[float, ...]]


@dataclass(frozen=True)
class Comparison:
    """The laws side by side."""

    point: Drive  # the operating point; its own control law is one of many here
    f_target: float  # mean switching frequency per switch [Hz]
    bound: (
        optimum.Profile
    )  # least copper without ripple; with least ripple where there must be some
    floor: optimum.RippleFloor  # the least ripple at f_target, of any control near that profile
    entries: tuple[Entry, ...]
    step_time: dict[str, float]  # of a control step on this computer, by name [s]

    def __repr__(self) -> str:
        laws = ", ".join(entry.name for entry in self.entries)
        return f"Comparison({self.point.name}: {laws} at {self.f_target / 1e3:g} kHz per switch)"


def compare(
    drive: Drive,
    controls: list[str] | None = None,
    *,
    f_switch: float = 20e3,
    octaves: tuple[float, ...] = OCTAVES,
    processes: int = PROCESSES,
    progress: Callable[[float], None] | None = None,
) -> Comparison:
    """Control laws at equal switching frequency, under equal conditions.

    Of the drive's [control] only T_s_us, precision and tau_max_Nm are used; each law takes its own
    defaults beside them and what the tuning finds.

    Parameters
    ----------
    drive : Drive
    controls : list of str, optional
        Names of CONTENDERS; `python:FILE:CLASS` or `cpp:FILE:STRUCT` for a law of your own, whose
        code runs. By default all of CONTENDERS.
    f_switch : float
        Mean switching frequency per switch [Hz].
    octaves : tuple of float
        Further frequencies of the Pareto front, as powers of two of f_switch.
    processes : int
        1 works in this process.
    progress : callable, optional
        Is told the part that is done.

    Returns
    -------
    Comparison
        The same in every respect but `step_time` however often it is made.

    Raises
    ------
    ParameterError
        If a name is unknown, the frequency is not positive or below the electrical one, or the
        drive has no working point.

    Examples
    --------
    >>> import reluctance as rl
    >>> from reluctance.explore.comparison import compare
    >>> drive = rl.load("examples/sharing_cubic.toml")
    >>> found = compare(drive, ["sharing_cubic"], f_switch=5e3, octaves=(), processes=1)
    >>> found.entries[0].met
    True
    """
    check_drive(drive, "compare")
    if not 0 < f_switch < 1e9:
        raise ParameterError(f"switching frequency {f_switch:g} Hz, need > 0")
    contenders = chosen(controls)
    point = operating_point(drive)
    tau_ref, omega_m = point.reference.course[1][0], point.omega_nominal
    limits.check_point(point, tau_ref=tau_ref, omega_m=omega_m, switching_frequency=f_switch)
    bound = best_profile(point)
    floor = limits.floor_of(point, tau_ref=tau_ref, omega_m=omega_m, switching_frequency=f_switch)
    _fill_the_cache(point, [c.name for c in contenders])
    tasks: list[Task] = [(point, c.name, f_switch, octaves) for c in contenders]
    found: dict[str, Entry] = {}
    for entry in _worked(tasks, processes):
        found[entry.name] = entry
        if progress is not None:
            progress(len(found) / len(tasks))
    entries = tuple(found[c.name] for c in contenders)
    return Comparison(
        point=point,
        f_target=f_switch,
        bound=bound,
        floor=floor,
        entries=tuple(replace(e, samples=None) for e in entries),
        step_time={e.name: step_time(point, e) for e in entries if e.samples is not None},
    )


def best_profile(point: Drive) -> optimum.Profile:
    """The physical limit at an operating point, for the plant as it is; where ripple there must be,
    the least rms error."""
    return optimum.best_profile(
        point.at(point.omega_nominal), point.reference.course[1][0], norm="rms"
    )


def step_time(point: Drive, entry: Entry) -> float:
    """Wall time of a law's step over the samples of its run [s]; alone on its core if it can be."""
    assert entry.samples is not None
    controller = contender(entry.name).drive(point, entry.values).controller()
    return float(_core.step_time(controller, entry.samples, repeats=STEP_PASSES))


def _fill_the_cache(point: Drive, names: list[str]) -> None:
    """Makes the guide tables once, before two processes would both make them."""
    for name in names:
        try:
            contender(name).drive(point, {}).controller()
        except (ParameterError, RuntimeError):  # `contest` reports it
            continue


def _worked(tasks: list[Task], processes: int) -> Iterator[Entry]:
    if processes == 1 or len(tasks) == 1:
        yield from map(_work, tasks)
        return
    context = multiprocessing.get_context("spawn")
    with context.Pool(min(processes, len(tasks)), initializer=_leave_interrupts) as pool:
        yield from pool.imap_unordered(_work, tasks)


def _work(task: Task) -> Entry:
    return contest(*task)


def _leave_interrupts() -> None:
    """Ctrl-C is the parent's: it ends the pool."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
