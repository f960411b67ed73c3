"""Run drives, and look at what came out: waveforms, key figures, losses, figures, files."""

from reluctance.drive.run.record import Record
from reluctance.drive.run.result import Result
from reluctance.drive.run.simulate import simulate
from reluctance.drive.run.simulate_all import simulate_all

__all__ = ["Record", "Result", "simulate", "simulate_all"]
