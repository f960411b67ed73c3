"""The physical limit of torque smoothness: the best periodic phase current of any controller."""

from reluctance.limit.envelope import Envelope, torque_speed_envelope
from reluctance.limit.magnetics import LeHuyParameters, Machine, phase_magnetics
from reluctance.limit.profile import Profile, best_profile
from reluctance.limit.programme import Programme, Setting
from reluctance.limit.table import Table, profile_table

__all__ = [
    "Envelope",
    "LeHuyParameters",
    "Machine",
    "Profile",
    "Programme",
    "Setting",
    "Table",
    "best_profile",
    "phase_magnetics",
    "profile_table",
    "torque_speed_envelope",
]
