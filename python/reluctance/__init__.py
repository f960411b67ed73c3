"""Switched-reluctance motor drives: simulate, control, find the physical limit, flash."""

from reluctance.drive import Drive
from reluctance.drive_file import load
from reluctance.errors import ParameterError
from reluctance.kpis import Kpis
from reluctance.simulate import Result, simulate

__all__ = ["Drive", "Kpis", "ParameterError", "Result", "load", "simulate"]
__version__ = "0.1.0"
