"""Commissioning: what is found out of a drive before it turns for the first time."""

from reluctance.commission.bench import Found, Wires, commission, write_pulses
from reluctance.export.commission_levels import Levels, levels

__all__ = ["Found", "Levels", "Wires", "commission", "levels", "write_pulses"]
