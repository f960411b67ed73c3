"""One contender's part of the comparison: tune it, run it for the record, vary its frequency."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reluctance.base.errors import ParameterError
from reluctance.base.key_figures import Kpis, shown
from reluctance.drive.drive import Drive
from reluctance.drive.run.result import Result
from reluctance.drive.run.safety import handed_over
from reluctance.drive.run.simulate import simulate
from reluctance.explore.comparison.conditions import period
from reluctance.explore.comparison.contenders import Contender
from reluctance.explore.comparison.contenders import contender as contender_of
from reluctance.explore.comparison.tuning import Tuner, definite_error
from reluctance.explore.tuning import Trial
from reluctance.machine.mismatch import Mismatch

BUDGET = 150  # runs of a search; none has needed more than 80
RECORD_PERIODS = 12  # electrical periods of the run whose figures are printed
FOLLOWS = "its own form cannot give this torque here, so it follows the profile of the limit"
OCTAVES = (-2.0, -1.0, 1.0)  # further frequencies of the Pareto front, over the target


@dataclass(frozen=True)
class FrontPoint:
    """A law at another switching frequency, its other values unchanged."""

    f_switch: float  # [Hz]
    torque_error_rms: float  # [1]
    torque_ripple_pp: float | None  # [1]
    i_rms: float  # [A]


@dataclass(frozen=True)
class Entry:
    """What the comparison finds of a contender."""

    name: str
    values: dict[str, float]  # of [control], as tuned
    met: bool  # the switching frequency is within its tolerance
    note: str  # why not, why there are no figures, or what else to know of them
    runs: int  # spent
    T_s: float = 0.0  # control period [s]
    kpis: Kpis | None = None
    speed_ripple: float = 0.0  # see `torque_to_speed_ripple` [1]
    front: tuple[FrontPoint, ...] = ()
    torque: NDArray[np.float64] | None = None  # (2, n) of the last period: angle [rad el.], [N m]
    samples: NDArray[np.float64] | None = None  # (n, n_phases + 5) for the core's step_time


def contest(point: Drive, name: str, f_target: float, octaves: tuple[float, ...]) -> Entry:
    """Tunes a contender at an operating point and runs it.

    The search knows no mismatch: who tunes a drive has the model, not the machine. The switching
    frequency is then met on the machine.

    Parameters
    ----------
    point : Drive
        See conditions.operating_point.
    name : str
        Of the contender.
    f_target : float
        Mean switching frequency per switch [Hz].
    octaves : tuple of float
        Further frequencies, as powers of two of the target.
    """
    contender = contender_of(name)
    as_modelled = point.computed(mismatch=Mismatch())
    tuner = Tuner(as_modelled, contender, f_target, BUDGET)
    try:
        best = tuner.best()
        longer = Tuner(point, contender, f_target, 0, n_periods=RECORD_PERIODS)
        longer.lever = tuner.lever
        final = longer.match(_searched(contender, best), best.values[contender.free.key])
    except (ParameterError, RuntimeError) as fault:  # the latter: no guide could be computed
        return Entry(name, {}, met=False, note=f"not possible here: {fault}", runs=tuner.runs)
    drive = contender.drive(point, final.values)
    result = simulate(drive, until=RECORD_PERIODS * period(point))
    unused = handed_over(drive, result.kpis)
    met = longer.target.met(final.figures)
    front = _front(longer, final, octaves)
    about = _with_less(front, final) if met else _miss(longer, final)
    return Entry(
        name,
        final.values,
        met=met,
        note="; ".join(filter(None, [about, FOLLOWS if unused else ""])),
        runs=tuner.runs + longer.runs,
        T_s=drive.control.T_s,
        kpis=result.kpis,
        speed_ripple=torque_to_speed_ripple(result),
        front=front,
        torque=_last_period(result),
        samples=_samples(result),
    )


def _searched(contender: Contender, trial: Trial) -> dict[str, float]:
    """The values of a trial but for the free parameter."""
    return {k: v for k, v in trial.values.items() if k != contender.free.key}


def _miss(tuner: Tuner, trial: Trial) -> str:
    """Why the frequency is not met."""
    kHz = trial.figures["f_switch_Hz"] / 1e3
    if tuner.ran_out:
        end = "most" if tuner.target.off(trial.figures) < 0 else "least"
        return f"switches at {end} {kHz:.3g} kHz here"
    return f"its frequency jumps over the target; the nearest is {kHz:.3g} kHz"


def _with_less(front: tuple[FrontPoint, ...], final: Trial) -> str:
    """Says so where a law is smoother at a lower frequency: it cannot use the whole target."""
    best = min(front, key=lambda p: p.torque_error_rms)
    if best.f_switch > 0.9 * final.figures["f_switch_Hz"]:
        return ""
    if best.torque_error_rms > 0.95 * definite_error(final):
        return ""
    return (
        f"smoother with less: error {best.torque_error_rms:.2%} rms, "
        f"ripple {shown(best.torque_ripple_pp, '{:.2%}')} p-p at {best.f_switch / 1e3:.3g} kHz"
    )


def _front(tuner: Tuner, final: Trial, octaves: tuple[float, ...]) -> tuple[FrontPoint, ...]:
    """The tuned law and the same at other frequencies, in order; those out of reach are absent."""
    trials = [final]
    key = tuner.contender.free.key
    rest = _searched(tuner.contender, final)
    for octave in octaves:
        other = Tuner(tuner.point, tuner.contender, tuner.f_target * 2**octave, 0)
        start = final.values[key] * 2 ** (octave / tuner.contender.free.slope)
        try:
            trial = other.match(rest, start)
        except ParameterError:
            continue
        if other.target.met(trial.figures):
            trials.append(trial)
    points = [
        FrontPoint(k["f_switch_Hz"], definite_error(trial), _or_none(k), k["i_rms_A"])
        for trial in trials
        for k in (trial.figures,)
    ]
    return tuple(sorted(points, key=lambda p: p.f_switch))


def _or_none(figures: dict[str, float]) -> float | None:
    """The ripple, which a torque about zero does not have."""
    ripple = figures["torque_ripple_pp"]
    return None if np.isnan(ripple) else ripple


def torque_to_speed_ripple(result: Result) -> float:
    """Speed ripple, (max - min)/mean, that the torque of the second half of a run with held shaft
    would cause on the drive's inertia against a constant load [1]."""
    half = result.t >= result.t[-1] / 2
    t, tau = result.t[half], result.tau[half]
    steps = np.diff(t)
    impulse = np.concatenate([[0.0], np.cumsum(steps * (tau[1:] + tau[:-1]) / 2)])
    swing = impulse - impulse[-1] * (t - t[0]) / (t[-1] - t[0])
    return float(np.ptp(swing) / result.drive.J / abs(result.kpis.speed_mean))


def _last_period(result: Result) -> NDArray[np.float64]:
    theta = result.drive.machine.N_r * result.theta_m
    last = theta >= theta[-1] - 2 * np.pi
    return np.vstack([theta[last] - theta[last][0], result.tau[last]])


def _samples(result: Result) -> NDArray[np.float64]:
    """What the sensors see at each sample of the last quarter of a run, without their errors."""
    drive = result.drive
    t = np.arange(0.75 * result.t[-1], result.t[-1], drive.control.T_s)
    i = [np.interp(t, result.t, phase) for phase in result.i]
    theta = drive.machine.N_r * np.interp(t, result.t, result.theta_m)
    omega = np.interp(t, result.t, result.omega_m)
    ref = np.full_like(t, drive.reference.course[1][0])
    u_dc = np.full_like(t, drive.converter.u_dc_V)
    i_source = np.zeros_like(t)
    columns = [*i, np.mod(theta, 2 * np.pi), omega, u_dc, i_source, ref]
    return np.ascontiguousarray(np.column_stack(columns))
