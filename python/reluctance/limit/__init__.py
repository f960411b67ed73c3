"""The physical limit of torque smoothness: the best periodic phase current of any controller."""

from reluctance.drive.operating_point import OperatingPoint
from reluctance.limit.envelope import Envelope, torque_speed_envelope
from reluctance.limit.least_ripple import least_ripple_table
from reluctance.limit.magnetics import phase_magnetics
from reluctance.limit.point import check_point, operating_point
from reluctance.limit.profile import Profile, best_profile
from reluctance.limit.programme import Programme
from reluctance.limit.report import Limit, envelope_of, floor_of, limit_of
from reluctance.limit.ripple import RippleFloor, ripple_floor
from reluctance.limit.table import Table, profile_table
from reluctance.limit.torque_step import TorqueStep, fastest_torque_step

__all__ = [
    "Envelope",
    "Limit",
    "OperatingPoint",
    "Profile",
    "Programme",
    "RippleFloor",
    "Table",
    "TorqueStep",
    "best_profile",
    "check_point",
    "envelope_of",
    "fastest_torque_step",
    "floor_of",
    "least_ripple_table",
    "limit_of",
    "operating_point",
    "phase_magnetics",
    "profile_table",
    "ripple_floor",
    "torque_speed_envelope",
]
