"""Efficiency maps: losses, ripple and currents of a control law over speed and torque."""

from reluctance.efficiency.cycle import Cycle, Driven, driven, read_cycle
from reluctance.efficiency.map import EfficiencyMap, efficiency_map

__all__ = ["Cycle", "Driven", "EfficiencyMap", "driven", "efficiency_map", "read_cycle"]
