"""The trip levels of a drive: as its [protection] table gives them, or by default."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reluctance.drive import Drive
from reluctance.drive.pv_source import cold_voltage
from reluctance.errors import ParameterError
from reluctance.units import from_si, to_si

OVER_CURRENT = 1.2  # of i_max_A
ZERO_CURRENT = 0.02  # of i_max_A: a current sensor's offset and noise
SURE_DEAD_TIME = 0.2  # of a control period: safety.hpp counts on 80 % of the volt-seconds
OVER_VOLTAGE, UNDER_VOLTAGE = 1.25, 0.25  # of u_dc_V
ABOVE_COLD = 1.05  # of the open-circuit voltage on a cold morning, where no rating is given
OVER_SPEED = 1.3  # of the speed that the drive works at
ENCODER_STEPS = 1.5  # one by which the angle is late, half a one of margin
SMALLEST_SLACK_DEG = 0.1  # electrical; for an ideal sensor
SETTLE = 8.0  # time constants of the angle tracker: e^-8 of a wrong first speed is left


@dataclass(frozen=True)
class Limits:
    """The trip levels of a drive, in SI units."""

    i_trip: float  # [A]
    i_zero: float  # [A]
    u_dc_min: float  # [V]
    u_dc_max: float  # [V]
    omega_max: float  # [rad/s]
    angle_slack: float  # electrical [rad]
    settle: int  # samples before the angle is judged; 0 where the speed is measured


def limits(drive: Drive) -> Limits:
    """The trip levels of a drive, as given or by default.

    Raises
    ------
    ParameterError
        If the sensors cannot show a level, or a level would trip in normal work.
    """
    table = drive.protection
    i_max, u_dc = drive.machine.i_max_A, drive.converter.u_dc_V
    i_trip = _given(table.i_trip_A, OVER_CURRENT * i_max)
    if drive.sensing.adc_bits > 0 and drive.sensing.i_range_A <= i_trip:
        raise ParameterError(
            f"[protection] i_trip_A = {i_trip:g}, need < [sensing] i_range_A = "
            f"{drive.sensing.i_range_A:g}, or over-current is never seen"
        )
    lowest, highest = _voltages(drive)
    u_dc_min = _given(table.u_dc_min_V, lowest)
    u_dc_max = _given(table.u_dc_max_V, highest)
    if drive.source.kind == "pv" and u_dc_max <= cold_voltage(drive.source):
        raise ParameterError(
            f"[protection] u_dc_max_V = {u_dc_max:g}, need more than the "
            f"{cold_voltage(drive.source):.4g} V of a cold bright morning, or it trips before work"
        )
    if not u_dc_min < u_dc < u_dc_max:
        raise ParameterError(
            f"[protection] u_dc_min_V = {u_dc_min:g}, u_dc_max_V = {u_dc_max:g}, need [converter] "
            f"u_dc_V = {u_dc:g} between them"
        )
    omega_max = _given(table.speed_max_rpm, from_si(OVER_SPEED * drive.omega_nominal, "rpm"))
    omega_max = to_si(omega_max, "rpm")
    if omega_max <= drive.omega_nominal:
        raise ParameterError(
            f"[protection] speed_max_rpm = {from_si(omega_max, 'rpm'):g}, need more than the "
            f"{from_si(drive.omega_nominal, 'rpm'):g} rpm that the drive works at; set it"
        )
    step = 360 * drive.machine.N_r / drive.sensing.encoder_counts if _encoder(drive) else 0.0
    slack = _given(table.angle_slack_deg, max(ENCODER_STEPS * step, SMALLEST_SLACK_DEG))
    if slack <= step:
        raise ParameterError(
            f"[protection] angle_slack_deg = {slack:g}, need more than the encoder's step of "
            f"{step:g} deg electrical"
        )
    if drive.converter.t_dead > SURE_DEAD_TIME * drive.control.T_s:
        raise ParameterError(
            f"[converter] dead_time_us = {drive.converter.dead_time_us:g}, need at most "
            f"{SURE_DEAD_TIME:g} of [control] T_s_us = {drive.control.T_s_us:g} for firmware: the "
            "protection would find a healthy current sensor dead; take a longer control period"
        )
    return Limits(
        i_trip=i_trip,
        i_zero=_given(table.i_zero_A, ZERO_CURRENT * i_max),
        u_dc_min=u_dc_min,
        u_dc_max=u_dc_max,
        omega_max=omega_max,
        angle_slack=float(np.radians(slack)),
        settle=_settle(drive),
    )


def _voltages(drive: Drive) -> tuple[float, float]:
    """Default limits of the dc-link voltage [V]. An array gives nothing at night, and its
    open-circuit voltage on a cold morning."""
    if drive.source.kind != "pv":
        return UNDER_VOLTAGE * drive.converter.u_dc_V, OVER_VOLTAGE * drive.converter.u_dc_V
    margin = ABOVE_COLD * cold_voltage(drive.source)
    return 0.0, drive.converter.u_rating_V or margin


def _given(value: float | None, default: float) -> float:
    return default if value is None else value


def _settle(drive: Drive) -> int:
    bandwidth = drive.sensing.tracker_bandwidth
    return int(np.ceil(SETTLE / (bandwidth * drive.control.T_s))) if bandwidth > 0 else 0


def _encoder(drive: Drive) -> bool:
    return drive.sensing.encoder_counts > 0
