"""Run a drive, and look at what came out: waveforms, key figures, losses, figures, files."""

from reluctance.run.kpis import Kpis
from reluctance.run.result import Result
from reluctance.run.simulate import simulate

__all__ = ["Kpis", "Result", "simulate"]
