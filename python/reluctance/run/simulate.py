"""Run a drive: the closed loop of plant and control, down to each switching instant."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reluctance import _core
from reluctance.drive import Drive
from reluctance.drive.control import NEVER_REACHED
from reluctance.errors import ParameterError
from reluctance.run.columns import Table, named
from reluctance.run.kpis import Kpis, evaluated, kpis
from reluctance.run.losses import iron_loss
from reluctance.run.plant import bridge, closed_loop

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Result:
    """Waveforms and key figures of a run. At an event the row shows what holds from then on."""

    drive: Drive
    kpis: Kpis
    t: FloatArray  # (n,) [s]
    theta_m: FloatArray  # (n,) [rad]
    omega_m: FloatArray  # (n,) [rad/s]
    tau: FloatArray  # (n,) [N m]
    tau_ref: FloatArray  # (n,) [N m]; 0 where the law has no torque reference
    i: FloatArray  # (n_phases, n) [A]
    i_ref: FloatArray  # (n_phases, n) [A]; 0 where the law commands legs directly
    leg: FloatArray  # (n_phases, n): 1 magnetize, 0 freewheel, -1 demagnetize
    u: FloatArray  # (n_phases, n) winding voltages [V]
    psi: FloatArray  # (n_phases, n) [Wb]
    tau_ph: FloatArray  # (n_phases, n) [N m]
    u_dc: FloatArray  # (n,) [V]
    periods: Table  # (n_periods,) or (n_phases, n_periods) each: include/srm/sim/recorder.hpp


def simulate(
    drive: Drive,
    *,
    until: float | None = None,
    record: float | None = 0.0,
    progress: Callable[[float], None] | None = None,
    controller: _core.Controller | None = None,
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
    controller : Controller, optional
        Takes the place of the drive's own.

    Returns
    -------
    Result

    Raises
    ------
    ParameterError
        If `until` is not positive.

    Examples
    --------
    >>> import reluctance as rl
    >>> result = rl.simulate(rl.load("examples/paper_rated.toml"), until=0.04)
    >>> round(result.kpis.tau_mean)
    41
    """
    end = drive.simulation.until_s if until is None else until
    if not 0 < end < np.inf:
        raise ParameterError(f"until = {end:g} s, need > 0")
    if controller is None:
        controller = drive.controller()
    iron = drive.machine.iron is not None  # its loss needs every point, whatever is kept
    watched = iron or record is not None
    loop = closed_loop(drive, controller, -1.0 if not watched else 0.0 if iron else record or 0.0)
    loop.close_period()
    waveforms, periods = [], []
    wall, t = 0.0, 0.0
    while t < end:
        start = time.perf_counter()
        t = loop.advance(end)
        wall += time.perf_counter() - start
        waveforms.append(loop.take_waveforms())
        periods.append(loop.take_periods())
        if progress is not None:
            progress(t)
    if watched:
        loop.record()
    loop.close_period()
    n_phases = drive.machine.n_phases
    wave = named([*waveforms, loop.take_waveforms()], _core.waveform_columns(n_phases))
    ends = named([*periods, loop.take_periods()], _core.period_columns(n_phases))
    p_fe = _iron_loss(drive, wave, ends)
    if iron:
        wave = _on_grid(wave, record)
    return _result(drive, wave, ends, wall / end, p_fe)


def _on_grid(wave: Table, record: float | None) -> Table:
    """Waveforms at equal intervals [s] out of all: states between their neighbours, orders and
    legs as they last were. The last instant stays. None: no waveforms."""
    if record == 0:
        return wave
    if record is None:
        return {name: values[..., :0] for name, values in wave.items()}
    t = wave["t"]
    grid = record * np.arange(int(t[-1] / record * (1 - 1e-12)) + 1)
    before = np.append(np.searchsorted(t, grid + 1e-9 * record, side="right") - 1, len(t) - 1)
    grid = np.append(grid, t[-1])
    thinned = {name: values[..., before] for name, values in wave.items()}
    for name in ("t", "theta_m", "omega_m", "u_dc", "tau"):
        thinned[name] = np.interp(grid, t, wave[name])
    for name in ("i", "psi", "tau_ph"):
        thinned[name] = np.array([np.interp(grid, t, phase) for phase in wave[name]])
    return thinned


def _iron_loss(drive: Drive, wave: Table, periods: Table) -> float | None:
    """Iron loss over the window of the key figures [W]."""
    if drive.machine.iron is None:
        return None
    window, _ = evaluated(periods, drive.machine.N_r)
    inside = (wave["t"] >= window["t"][0]) & (wave["t"] <= window["t"][-1])
    return iron_loss(drive.machine.iron, wave["t"][inside], wave["psi"][:, inside])


def _result(
    drive: Drive, wave: Table, periods: Table, wall_ratio: float, p_fe: float | None
) -> Result:
    figures = kpis(
        periods,
        machine=drive.machine,
        switching=drive.converter,
        n_switches=_core.n_switches(bridge(drive.converter), drive.machine.n_phases),
        p_fe=p_fe,
        T_s=drive.control.T_s,
        wall_time_ratio=wall_ratio,
    )
    wave["i_ref"] = np.where(wave["i_ref"] < NEVER_REACHED, wave["i_ref"], 0.0)
    return Result(drive=drive, kpis=figures, periods=periods, **wave)
