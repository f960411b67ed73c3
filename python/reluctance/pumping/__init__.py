"""From the sun to the tank: water over a day or a year of a photovoltaic pumping system."""

from importlib.util import find_spec

from reluctance.base.errors import ParameterError

if find_spec("pandas") is None or find_spec("pvlib") is None:
    raise ParameterError(
        "pumping needs pvlib, which is not installed; `pip install 'reluctance[sun]'`"
    )

from reluctance.pumping.drive_of import drive_of
from reluctance.pumping.figures import Chain, chain, per, remarks, with_units
from reluctance.pumping.operate import Pumped, Samples, columns, pump
from reluctance.pumping.sizing import sizes
from reluctance.pumping.system import System, load_system

__all__ = [
    "Chain",
    "Pumped",
    "Samples",
    "System",
    "chain",
    "columns",
    "drive_of",
    "load_system",
    "per",
    "pump",
    "remarks",
    "sizes",
    "with_units",
]
