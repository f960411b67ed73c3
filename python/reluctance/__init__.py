"""Switched-reluctance motor drives: simulate, control, find the physical limit, flash."""

from reluctance._core import Gate, Leg, Measurement, Order
from reluctance.drive import Drive
from reluctance.drive.known import Known
from reluctance.drive.own_law import Law
from reluctance.errors import ParameterError
from reluctance.load import load
from reluctance.run import Kpis, Result, simulate, simulate_all
from reluctance.sweep import Sweep, sweep

__all__ = [
    "Drive",
    "Gate",
    "Known",
    "Kpis",
    "Law",
    "Leg",
    "Measurement",
    "Order",
    "ParameterError",
    "Result",
    "Sweep",
    "load",
    "simulate",
    "simulate_all",
    "sweep",
]
__version__ = "0.1.0"
