"""The physical limit of torque smoothness: the best periodic phase current of any controller."""

from reluctance.machine.operating_point import OperatingPoint
from reluctance.machine.optimum.envelope import Envelope, torque_speed_envelope
from reluctance.machine.optimum.least_ripple import least_ripple_table
from reluctance.machine.optimum.magnetics import phase_magnetics
from reluctance.machine.optimum.profile import Profile, best_profile
from reluctance.machine.optimum.programme import Programme
from reluctance.machine.optimum.ripple import RippleFloor, ripple_floor
from reluctance.machine.optimum.table import Table, profile_table
from reluctance.machine.optimum.torque_step import TorqueStep, fastest_torque_step

__all__ = [
    "Envelope",
    "OperatingPoint",
    "Profile",
    "Programme",
    "RippleFloor",
    "Table",
    "TorqueStep",
    "best_profile",
    "fastest_torque_step",
    "least_ripple_table",
    "phase_magnetics",
    "profile_table",
    "ripple_floor",
    "torque_speed_envelope",
]
