"""Run drives, and look at what came out: waveforms, key figures, losses, figures, files."""

from reluctance.run.record import Record
from reluctance.run.result import Result
from reluctance.run.simulate import simulate
from reluctance.run.simulate_all import simulate_all

__all__ = ["Record", "Result", "simulate", "simulate_all"]
