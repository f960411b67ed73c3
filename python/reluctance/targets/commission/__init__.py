"""Commissioning: what is found out of a drive before it turns for the first time."""

from reluctance.targets.commission.bench import Found, Held, Wires, commission, write_pulses
from reluctance.targets.commission.board import Emulated, emulated
from reluctance.targets.commission.wires_file import read_wires
from reluctance.targets.export.commission_levels import Levels, levels

__all__ = [
    "Emulated",
    "Found",
    "Held",
    "Levels",
    "Wires",
    "commission",
    "emulated",
    "levels",
    "read_wires",
    "write_pulses",
]
