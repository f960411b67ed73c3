"""A drive over many of its values: grids and samples, stored for good, tables and figures."""

from reluctance.explore.sweeps.result import Sweep
from reluctance.explore.sweeps.sweep import sweep

__all__ = ["Sweep", "sweep"]
