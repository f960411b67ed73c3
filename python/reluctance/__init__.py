"""Switched-reluctance motor drives: simulate, control, find the physical limit, flash."""

from reluctance.drive import Drive
from reluctance.errors import ParameterError
from reluctance.load import load
from reluctance.run import Kpis, Result, simulate

__all__ = ["Drive", "Kpis", "ParameterError", "Result", "load", "simulate"]
__version__ = "0.1.0"
