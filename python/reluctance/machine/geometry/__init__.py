"""From a lamination to a machine: the 2-D field of its cross-section over current and angle."""

from reluctance.machine.geometry.solved import Solution, convergence

__all__ = ["Solution", "convergence"]
