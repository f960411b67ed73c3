"""Efficiency maps: losses, ripple and currents of a control law over speed and torque."""

from reluctance.explore.efficiency_map.cycle import Cycle, Driven, driven, read_cycle
from reluctance.explore.efficiency_map.map import EfficiencyMap, efficiency

__all__ = ["Cycle", "Driven", "EfficiencyMap", "driven", "efficiency", "read_cycle"]
