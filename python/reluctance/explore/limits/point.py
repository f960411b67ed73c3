"""The operating point that a drive is asked for, and whether it can be meant."""

from __future__ import annotations

import numpy as np

from reluctance.base.errors import ParameterError
from reluctance.base.units import to_si
from reluctance.drive.drive import Drive


def operating_point(
    drive: Drive, *, tau_ref: float | None = None, omega_m: float | None = None
) -> tuple[float, float]:
    """Torque [N m] and speed [rad/s] that a drive is asked for.

    The speed is the one held, or the greatest reference. The torque is the reference of greatest
    magnitude; with a speed reference, which may be the greatest speed of a pump on an array, it is
    what load and friction take at that speed.
    """
    if drive.converter.bridge != "asymmetric":
        raise ParameterError(
            f"[converter] bridge = {drive.converter.bridge!r}: the limit is computed for phases "
            "that share no switch; need bridge = 'asymmetric'"
        )
    speed = _speed(drive) if omega_m is None else omega_m
    if tau_ref is not None:
        return tau_ref, speed
    if drive.reference.kind == "torque":
        return _greatest(drive.reference.course[1]), speed
    if drive.reference.kind == "none":
        raise ParameterError(
            f"[reference] kind = {drive.reference.kind!r} asks for no torque; give one with --tau"
        )
    return drive.load.torque(speed) + drive.machine.B_Nms * speed, speed


def check_point(
    drive: Drive, *, tau_ref: float, omega_m: float, switching_frequency: float | None = None
) -> None:
    """Refuses what is surely a slip: a torque beyond all phases at i_max at the best angle, or less
    than one turn-on of a switch per electrical period.

    Raises
    ------
    ParameterError : with the greatest torque [N m], or the electrical frequency [Hz].
    """
    machine = drive.machine
    most = machine.greatest_torque
    if not abs(tau_ref) <= most:
        raise ParameterError(
            f"torque {tau_ref:g} N m, need at most {most:.4g}: more is impossible at any angle "
            f"with i_max_A = {machine.i_max_A:g}; lower the torque or raise i_max_A"
        )
    f_e = machine.N_r * abs(omega_m) / (2 * np.pi)
    if switching_frequency is not None and switching_frequency < f_e * (1 - 1e-9):
        raise ParameterError(
            f"switching frequency {switching_frequency:g} Hz, need at least the electrical "
            f"frequency, {f_e:.4g} Hz here; is a unit missing, as in 20kHz?"
        )


def _speed(drive: Drive) -> float:
    if drive.reference.kind in ("speed", "pv"):
        return _greatest(drive.reference.course[1])
    return to_si(drive.load.speed_rpm, "rpm")


def _greatest(values: list[float]) -> float:
    return max(values, key=abs)
