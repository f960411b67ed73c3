"""From the sun to the tank: water over a day or a year of a photovoltaic pumping system."""

from reluctance.pumping.figures import Chain, chain, per, remarks, with_units
from reluctance.pumping.operate import Pumped, Samples, columns, operate
from reluctance.pumping.system import System, load_system

__all__ = [
    "Chain",
    "Pumped",
    "Samples",
    "System",
    "chain",
    "columns",
    "load_system",
    "operate",
    "per",
    "remarks",
    "with_units",
]
