"""An operating point: the phases of a machine, the voltage on them, and a speed."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING

from reluctance.base.errors import need
from reluctance.machine.models import Magnetics

if TYPE_CHECKING:
    from reluctance.machine.coupling import Coupling


@dataclass(frozen=True)
class OperatingPoint:
    """Where offline computations on a machine take place. Of no drive file: numbers in SI."""

    magnetics: Magnetics  # of a phase
    n_phases: int
    R: float  # of a phase [ohm]
    i_max: float  # greatest phase current [A]
    u_dc: float  # dc-link voltage [V]
    omega_m: float  # speed, of either sign [rad/s]
    coupling: Coupling | None = None  # of the phases; None where they are independent

    def __post_init__(self) -> None:
        need(self.n_phases >= 2, "n_phases", self.n_phases, "at least 2 phases")
        need(self.R >= 0, "R", self.R, "a resistance >= 0 ohm")
        need(self.u_dc > 0, "u_dc", self.u_dc, "a voltage > 0 V")
        need(self.i_max > 0, "i_max", self.i_max, "a current > 0 A")
        need(isfinite(self.omega_m), "omega_m", self.omega_m, "a finite speed [rad/s]")

    @property
    def N_r(self) -> int:
        """Rotor poles."""
        return self.magnetics.N_r
