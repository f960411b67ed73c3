"""The searches of `reluctance.machine.optimum` with an operating point spelled out in keywords."""

from reluctance.machine import optimum
from reluctance.machine.optimum import OperatingPoint

POINT = ("n_phases", "R", "i_max", "u_dc", "omega_m")


def split(machine, given):
    """The operating point among keywords, and the others."""
    at = {key: given[key] for key in POINT if key in given}
    rest = {key: value for key, value in given.items() if key not in POINT}
    return OperatingPoint(machine, **at), rest


def best_profile(machine, *, tau_ref, **given):
    point, rest = split(machine, given)
    return optimum.best_profile(point, tau_ref, **rest)


def fastest_torque_step(machine, *, tau_ref, **given):
    point, rest = split(machine, given)
    return optimum.fastest_torque_step(point, tau_ref, **rest)


def profile_table(machine, *, tau_max, **given):
    point, rest = split(machine, given)
    return optimum.profile_table(point, tau_max, **rest)


def torque_speed_envelope(machine, *, omega_m, **given):
    point, rest = split(machine, {**given, "omega_m": 0.0})
    return optimum.torque_speed_envelope(point, omega_m, **rest)
