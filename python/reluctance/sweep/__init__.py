"""A drive over many of its values: grids and samples, stored for good, tables and figures."""

from reluctance.sweep.found import Sweep
from reluctance.sweep.sweep import sweep

__all__ = ["Sweep", "sweep"]
