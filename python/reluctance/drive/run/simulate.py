"""Run a drive: the closed loop of plant and control, down to each switching instant."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from numbers import Real

import numpy as np

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.base.key_figures import Kpis
from reluctance.drive.drive import Drive, check_drive
from reluctance.drive.guard.supervised import controller as guarded
from reluctance.drive.laws.own_law import Law, core_of
from reluctance.drive.run.bounds import Bounds
from reluctance.drive.run.columns import Rows
from reluctance.drive.run.estimate import Estimate, estimate
from reluctance.drive.run.events import Event, events
from reluctance.drive.run.kpis import evaluated, kpis
from reluctance.drive.run.learned import Learned, learned
from reluctance.drive.run.losses import iron_loss
from reluctance.drive.run.plant import closed_loop
from reluctance.drive.run.result import Result
from reluctance.drive.tables.control import NEVER_REACHED
from reluctance.drive.tables.faults import Fault
from reluctance.drive.tables.supervision import Supervision

WARMING_STEP = 1e-3  # [s]


def simulate(
    drive: Drive,
    *,
    until: float | None = None,
    record: float | None = 0.0,
    progress: Callable[[float], None] | None = None,
    law: Law | None = None,
    controller: _core.Controller | None = None,
    warming: tuple[Sequence[float], Sequence[float]] | None = None,
) -> Result:
    """Run a drive from zero current.

    Parameters
    ----------
    drive : Drive
    until : float, optional
        End of the run [s]; by default the drive's own.
    record : float or None
        Interval of the waveforms [s]; 0 keeps every solver point and event, None keeps nothing.
    progress : callable, optional
        Is told the time reached [s], every few milliseconds.
    law : Law, optional
        A control law in Python: takes the place of the drive's own, inside the same tracker, speed
        loop, comparators and dead-time compensation.
    controller : Controller, optional
        Takes the place of the drive's own, with all that stands around it.
    warming : pair of sequences, optional
        Times [s] and factors on the resistance of the windings, joined by lines; the control is not
        told. It follows in steps of WARMING_STEP.

    Returns
    -------
    Result

    Raises
    ------
    ParameterError
        If an argument is of the wrong kind, `until` or `record` is out of range, the waveforms
        would not fit, or speed or current leave what the machine can mean.

    Examples
    --------
    >>> import reluctance as rl
    >>> result = rl.simulate(rl.load("examples/paper_rated.toml"), until=0.04)
    >>> round(result.kpis.tau_mean)
    41
    """
    end = checked(drive, until, record)
    bounds = Bounds(drive, end, record)
    if law is not None:
        controller = guarded(drive, core_of(law, drive.known()))
    elif controller is None:
        controller = guarded(drive)
    else:
        drive = drive.computed(supervision=Supervision())
    iron = drive.machine.iron is not None  # its loss needs every point, whatever is kept
    watched = iron or record is not None
    loop = closed_loop(drive, controller, -1.0 if not watched else 0.0 if iron else record or 0.0)
    loop.close_period()
    waveforms, periods, kept = [], [], 0
    wall, t = 0.0, 0.0
    history = [[t, *loop.learned()]]
    while t < end:
        start = time.perf_counter()
        if warming is not None:
            loop.change_R(drive.machine.R * float(np.interp(t, *warming)))
        t = loop.advance(end if warming is None else min(end, t + WARMING_STEP))
        wall += time.perf_counter() - start
        history.append([t, *loop.learned()])
        waveforms.append(loop.take_waveforms())
        periods.append(loop.take_periods())
        kept += len(waveforms[-1])
        bounds.check(loop, t, kept)
        if progress is not None:
            progress(t)
    if watched:
        loop.record()
    loop.close_period()
    n_phases = drive.machine.n_phases
    values = np.vstack([*waveforms, loop.take_waveforms()])
    names = [*_core.waveform_columns(n_phases), *_core.flux_estimate_columns]
    rows = Rows(values, names[: values.shape[1]])
    summed = Rows(np.vstack([*periods, loop.take_periods()]), _core.period_columns(n_phases))
    p_fe = _iron_loss(drive, rows, summed)
    if iron:
        rows = rows.between(0, 0) if record is None else _on_grid(rows, record)
    entered = events(controller)
    figures = kpis(summed, drive, p_fe=p_fe, wall_s_per_sim_s=wall / end, entered=entered)
    beliefs = learned(history, drive.known().R) if drive.control.learns else None
    faults = drive.faults.begun(loop.onsets(), end)
    return _result(drive, rows, figures, summed, beliefs, entered, faults)


def checked(drive: object, until: object, record: object) -> float:
    """The end of the run [s], if the arguments can be meant."""
    check_drive(drive, "simulate")
    assert isinstance(drive, Drive)
    given: dict[str, float] = {}
    for name, value in (("until", until), ("record", record)):
        if value is None:
            continue
        if isinstance(value, bool) or not isinstance(value, Real):
            raise ParameterError(f"{name} = {value!r}, need a number of seconds")
        given[name] = float(value)
    if not 0 <= (every := given.get("record", 0.0)) < np.inf:
        raise ParameterError(f"record = {every:g} s, need >= 0, or None to keep no waveforms")
    end = given.get("until", drive.simulation.until_s)
    if not 0 < end < np.inf:
        raise ParameterError(f"until = {end:g} s, need > 0")
    return end


def _on_grid(rows: Rows, record: float) -> Rows:
    """Rows at equal intervals [s] out of all: states between their neighbours, orders and legs as
    they last were. The last row stays."""
    if record == 0:
        return rows
    t = rows["t"]
    grid = record * np.arange(int(t[-1] / record * (1 - 1e-12)) + 1)
    thinned = rows.values[np.searchsorted(t, grid + 1e-9 * record, side="right") - 1]
    for column, name in enumerate(rows.names):
        held = name.startswith(("tau_ref", "leg", "i_ref", "u_")) and name != "u_dc"
        if not held and name not in _core.flux_estimate_columns:
            thinned[:, column] = np.interp(grid, t, rows.values[:, column])
    return Rows(np.vstack([thinned, rows.values[-1:]]), rows.names)


def _iron_loss(drive: Drive, rows: Rows, periods: Rows) -> float | None:
    """Iron loss over the window of the key figures [W]."""
    if drive.machine.iron is None:
        return None
    window = evaluated(periods, drive.machine.N_r)[0]["t"]
    inside = Rows(rows.values[(rows["t"] >= window[0]) & (rows["t"] <= window[-1])], rows.names)
    return iron_loss(drive.machine.iron, inside["t"], inside.phases("psi"))


def _estimate(drive: Drive, rows: Rows) -> Estimate | None:
    if "theta_hat" not in rows.names:
        return None
    return estimate(rows, drive.machine.N_r, drive.control.T_s)


def _result(
    drive: Drive,
    rows: Rows,
    figures: Kpis,
    periods: Rows,
    known: Learned | None,
    entered: list[Event] | None,
    faults: list[tuple[float, Fault]],
) -> Result:
    single = {name: rows[name] for name in ("t", "theta_m", "omega_m", "u_dc", "tau", "tau_ref")}
    phases = {name: rows.phases(name) for name in ("i", "i_ref", "leg", "u", "psi", "tau_ph")}
    phases["i_ref"] = np.where(phases["i_ref"] < NEVER_REACHED, phases["i_ref"], 0.0)
    return Result(
        drive=drive,
        kpis=figures,
        periods=periods,
        learned=known,
        estimate=_estimate(drive, rows),
        events=entered,
        faults=faults,
        **single,
        **phases,
    )
