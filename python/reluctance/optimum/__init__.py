"""The physical limit of torque smoothness: the best periodic phase current of any controller."""

from reluctance.machine.operating_point import OperatingPoint
from reluctance.optimum.envelope import Envelope, torque_speed_envelope
from reluctance.optimum.least_ripple import least_ripple_table
from reluctance.optimum.magnetics import phase_magnetics
from reluctance.optimum.profile import Profile, best_profile
from reluctance.optimum.programme import Programme
from reluctance.optimum.ripple import RippleFloor, ripple_floor
from reluctance.optimum.table import Table, profile_table
from reluctance.optimum.torque_step import TorqueStep, fastest_torque_step

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
