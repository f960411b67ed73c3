"""The levels of the drive's states (control/guard/sequence.hpp): of [protection], or by default."""

from __future__ import annotations

import numpy as np

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.base.units import from_si, to_si
from reluctance.drive.drive import Drive

READY = 0.7  # of u_dc: the dc link is charged; rectified mains sags by no more
READY_ABOVE_MIN = 1.05  # of the under-voltage level, at least
SETTLE_TIME = 0.02  # with the dc link charged, before it counts [s]
CALIBRATE_TIME = 0.05  # mean of the current readings with all legs off [s]
CHOP_ON, CHOP_OFF = 0.6, 0.3  # of the way from u_dc to the over-voltage level
SPEED_LIMIT = 0.95  # of the over-speed level
LEAST_SAMPLES = 2  # of a time-out: the drive would trip with the first sample


def sequence(drive: Drive, guard: _core.Protection) -> _core.Sequence:
    """The states of a drive. guard: its protection.

    Raises
    ------
    ParameterError
        If the drive would wait for a voltage that it cannot have, or trip at once.
    """
    u_dc, table, levels = drive.converter.u_dc_V, drive.protection, guard.levels
    u_ready = table.u_ready_V
    if u_ready is None:
        u_ready = max(READY * u_dc, READY_ABOVE_MIN * levels.u_dc_min)
    if not levels.u_dc_min < u_ready < levels.u_dc_max:
        raise ParameterError(
            f"[protection] u_ready_V = {u_ready:g}, need between u_dc_min_V = {levels.u_dc_min:g} "
            f"and u_dc_max_V = {levels.u_dc_max:g}"
        )
    for key, unit, scale in (("command_timeout_ms", "ms", 1e3), ("precharge_max_s", "s", 1.0)):
        given, least = getattr(table, key), LEAST_SAMPLES * drive.control.T_s * scale
        if given < least * (1 - 1e-9):
            raise ParameterError(
                f"[protection] {key} = {given:g}, need at least {least:g} {unit}, "
                f"{LEAST_SAMPLES} times [control] T_s_us = {drive.control.T_s_us:g}, or the drive "
                f"trips at once; check its unit: it is in {unit}"
            )
    T_s, room = drive.control.T_s, levels.u_dc_max - u_dc
    omega_none = speed_limit(drive, guard)
    speeds = drive.reference.kind in ("speed", "pv")
    return _core.Sequence(
        T_s=T_s,
        u_ready=u_ready,
        t_precharge=table.precharge_max_s,
        n_settle=int(np.ceil(SETTLE_TIME / T_s)),
        n_calibrate=int(np.ceil(CALIBRATE_TIME / T_s)),
        i_offset=guard.i_zero,
        t_command=table.si["command_timeout"],
        u_chop_on=u_dc + CHOP_ON * room,
        u_chop_off=u_dc + CHOP_OFF * room,
        reference_max=omega_none if speeds else _torque_limit(drive),
        omega_none=omega_none,
    )


def speed_limit(drive: Drive, guard: _core.Protection) -> float:
    """From this speed on there is no motoring torque [rad/s].

    Raises
    ------
    ParameterError
        If the drive would trip before.
    """
    given = drive.protection.speed_limit_rpm
    if given is None:
        return SPEED_LIMIT * guard.levels.omega_max
    if to_si(given, "rpm") >= guard.levels.omega_max:
        raise ParameterError(
            f"[protection] speed_limit_rpm = {given:g}, need less than the "
            f"{from_si(guard.levels.omega_max, 'rpm'):g} rpm of over-speed (speed_max_rpm)"
        )
    return to_si(given, "rpm")


def _torque_limit(drive: Drive) -> float:
    """Of the reference: the greatest torque [N m]; 1, to motor, for a law with its own current."""
    return 1.0 if drive.reference.kind == "none" else drive.tau_max
