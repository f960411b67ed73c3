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
from reluctance.run.kpis import Kpis, evaluated, kpis
from reluctance.run.losses import iron_loss

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
    periods: FloatArray  # (n_periods, 19 + n_phases), see include/srm/sim/recorder.hpp


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
    loop = _simulation(drive, controller, -1.0 if not watched else 0.0 if iron else record or 0.0)
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
    rows = np.vstack([*waveforms, loop.take_waveforms()])
    period_rows = np.vstack([*periods, loop.take_periods()])
    p_fe = _iron_loss(drive, rows, period_rows)
    if iron:
        rows = rows[:0] if record is None else _on_grid(rows, record)
    return _result(drive, rows, period_rows, wall / end, p_fe)


def _simulation(
    drive: Drive, controller: _core.Controller, record_every: float
) -> _core.Simulation:
    machine, converter, load = drive.machine, drive.converter, drive.load
    t_ref, ref = drive.reference.course
    return _core.Simulation(
        machine=machine.magnetics,
        n_phases=machine.n_phases,
        R=machine.R,
        u_dc=converter.u_dc_V,
        v_switch=converter.v_switch_V,
        R_switch=converter.R_switch_ohm,
        v_diode=converter.v_diode_V,
        R_diode=converter.R_diode_ohm,
        t_dead=converter.t_dead,
        shaft=_core.Shaft.locked if load.kind == "locked" else _core.Shaft.turning,
        J=drive.J,
        B=machine.B_Nms,
        k_pump=load.k_pump_Nms2,
        tau_load=load.tau_Nm,
        T_s=drive.control.T_s,
        delay=drive.sensing.delay_samples,
        adc_bits=drive.sensing.adc_bits,
        i_range=drive.sensing.i_range_A,
        encoder_counts=drive.sensing.encoder_counts,
        controller=controller,
        t_ref=t_ref,
        ref=ref,
        omega_m=load.speed_rpm * np.pi / 30,
        theta_m=np.radians(drive.simulation.theta_start_deg),
        dt_max=drive.simulation.dt_max_us * 1e-6,
        i_scale=machine.i_max_A,
        record_every=record_every,
    )


def _magnetics(drive: Drive, rows: FloatArray) -> FloatArray:
    """psi, W_c, tau, L_inc, psi_theta of each phase at each row, shape (5, n_phases, n)."""
    machine = drive.machine
    k = np.arange(machine.n_phases)[:, None]
    theta_e = machine.N_r * rows[:, 1] - 2 * np.pi * k / machine.n_phases
    i = np.ascontiguousarray(rows[:, 4::3].T)
    flat = _core.magnetics(machine.magnetics, i.ravel(), theta_e.ravel())
    return flat.T.reshape(5, *i.shape)


def _on_grid(rows: FloatArray, record: float) -> FloatArray:
    """Rows at equal intervals [s] out of all: states between their neighbours, orders and legs as
    they last were. The last row stays."""
    if record == 0:
        return rows
    t = rows[:, 0]
    grid = record * np.arange(int(t[-1] / record * (1 - 1e-12)) + 1)
    thinned = rows[np.searchsorted(t, grid + 1e-9 * record, side="right") - 1]
    for column in (0, 1, 2, *range(4, rows.shape[1], 3)):
        thinned[:, column] = np.interp(grid, t, rows[:, column])
    return np.vstack([thinned, rows[-1:]])


def _iron_loss(drive: Drive, rows: FloatArray, periods: FloatArray) -> float | None:
    """Iron loss over the window of the key figures [W]."""
    if drive.machine.iron is None:
        return None
    window, _ = evaluated(periods, drive.machine.N_r)
    inside = rows[(rows[:, 0] >= window[0, 0]) & (rows[:, 0] <= window[-1, 0])]
    return iron_loss(drive.machine.iron, inside[:, 0], _magnetics(drive, inside)[0])


def _result(
    drive: Drive,
    rows: FloatArray,
    periods: FloatArray,
    wall_ratio: float,
    p_fe: float | None,
) -> Result:
    t, theta_m, omega_m, tau_ref = rows[:, :4].T
    i, leg, i_ref = (np.ascontiguousarray(rows[:, 4 + j :: 3].T) for j in range(3))
    magnetics = _magnetics(drive, rows)
    psi, tau_ph = magnetics[0], magnetics[2]
    figures = kpis(
        periods,
        machine=drive.machine,
        switching=drive.converter,
        p_fe=p_fe,
        T_s=drive.control.T_s,
        wall_time_ratio=wall_ratio,
    )
    return Result(
        drive=drive,
        kpis=figures,
        t=t,
        theta_m=theta_m,
        omega_m=omega_m,
        tau=tau_ph.sum(axis=0),
        tau_ref=tau_ref,
        i=i,
        i_ref=np.where(i_ref < NEVER_REACHED, i_ref, 0.0),
        leg=leg,
        u=_winding_voltage(drive, leg, i),
        psi=psi,
        tau_ph=tau_ph,
        u_dc=np.full_like(t, drive.converter.u_dc_V),
        periods=periods,
    )


def _winding_voltage(drive: Drive, leg: FloatArray, i: FloatArray) -> FloatArray:
    """As include/srm/plant/converter.hpp; 0 where the diodes block."""
    c = drive.converter
    switch = c.v_switch_V + c.R_switch_ohm * i
    diode = c.v_diode_V + c.R_diode_ohm * i
    switches = 1 + leg  # in the path: 2, 1, 0
    u = leg * c.u_dc_V - switches * switch - (2 - switches) * diode
    return np.where((i > 0) | (leg > 0), u, 0.0)
