"""A machine by five numbers: `model = "lehuy"` in a machine file."""

from __future__ import annotations

import warnings
from functools import lru_cache
from typing import Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from reluctance import _core
from reluctance.base.arrays import FloatArray
from reluctance.base.errors import Note
from reluctance.machine.machine_file import MachineFile
from reluctance.machine.models import PhaseMagnetics

# The first slope of the aligned curve reaches psi_m at 1/3 to 1/23 of i_m in the library. Below
# 1/500 a unit is wrong: millihenry in the place of henry, or the like.
STEEPEST = 500.0
# The model goes through the point where the aligned curve is saturated there. The library misses it
# by 2 % at most; from here on it is said.
MISSED = 0.05
HENRY = "inductances are in henry, 0.15 for 150 mH"


class LeHuyMachine(MachineFile):
    """A machine by five numbers: the model of H. Le-Huy and P. Brunelle (IECON 2005)."""

    core = _core.LeHuy
    flux_keys = ("L_u_H", "L_a_H", "L_sat_H", "psi_m_Wb")  # the current of the point stays

    model: Literal["lehuy"]
    L_u_H: float = Field(gt=0)  # unaligned inductance
    L_a_H: float = Field(gt=0)  # aligned inductance, unsaturated
    L_sat_H: float = Field(gt=0)  # aligned incremental inductance, saturated
    i_m_A: float = Field(gt=0)  # a point of the line that the aligned curve ends in: current ...
    psi_m_Wb: float = Field(gt=0)  # ... and flux linkage

    @model_validator(mode="after")
    def aligned_flux_saturates(self) -> LeHuyMachine:
        A = self.psi_m_Wb - self.L_sat_H * self.i_m_A
        if A <= 0:
            raise ValueError(
                f"psi_m_Wb = {self.psi_m_Wb:g}, need more than L_sat_H i_m_A = "
                f"{self.L_sat_H * self.i_m_A:g}; check the point (i_m_A, psi_m_Wb), and the units: "
                f"{HENRY}"
            )
        if self.L_a_H <= max(self.L_u_H, self.L_sat_H):
            raise ValueError(
                f"L_a_H = {self.L_a_H:g}, need more than L_u_H = {self.L_u_H:g} and "
                f"L_sat_H = {self.L_sat_H:g}; check the units of all three: {HENRY}"
            )
        unsaturated = self.L_a_H * self.i_m_A
        if self.psi_m_Wb > unsaturated:
            raise ValueError(
                f"psi_m_Wb = {self.psi_m_Wb:g}, need at most L_a_H i_m_A = {unsaturated:g}, which "
                f"iron without saturation has; check the units: weber, and {HENRY}"
            )
        if self.psi_m_Wb * STEEPEST < unsaturated:
            raise ValueError(
                f"L_a_H = {self.L_a_H:g} reaches psi_m_Wb = {self.psi_m_Wb:g} at "
                f"{self.psi_m_Wb / self.L_a_H:.2g} A, need at least 1/{STEEPEST:g} of i_m_A = "
                f"{self.i_m_A:g}; check the units: {HENRY}"
            )
        return self

    @classmethod
    def from_table(cls, table: dict[str, Any], where: str) -> Self:
        """With a Note where the aligned curve misses its point."""
        machine = super().from_table(table, where)
        A = machine.psi_m_Wb - machine.L_sat_H * machine.i_m_A
        missed = A * float(np.exp(-(machine.L_a_H - machine.L_sat_H) * machine.i_m_A / A))
        if missed > MISSED * machine.psi_m_Wb:
            told = (
                f"(i_m_A, psi_m_Wb) of [machine] is a point of the line that the aligned curve "
                f"ends in: at {machine.i_m_A:g} A the curve itself has "
                f"{machine.psi_m_Wb - missed:.4g} Wb, not {machine.psi_m_Wb:g}; where it should "
                f"have that, take a point at a larger current, or {machine._through_the_point()}"
            )
            warnings.warn(told, Note, stacklevel=2)
        return machine

    def _through_the_point(self) -> str:
        """The key with which the curve itself goes through (i_m_A, psi_m_Wb)."""
        steep, line = (self.L_a_H - self.L_sat_H) * self.i_m_A, self.L_sat_H * self.i_m_A

        def above(A: float) -> float:
            return float(line - A * np.expm1(-steep / A) - self.psi_m_Wb)

        if above(steep) < 0:  # beyond, psi_m_Wb would be more than iron without saturation has
            return "check the three inductances against it"
        from scipy.optimize import brentq  # here: it is slow to import

        A = brentq(above, self.psi_m_Wb - line, steep)
        return f"set psi_m_Wb = {line + A:.4g}"

    @property
    def magnetics(self) -> _core.LeHuy:
        return _le_huy(self.N_r, self.L_u_H, self.L_a_H, self.L_sat_H, self.i_m_A, self.psi_m_Wb)

    @staticmethod
    def symbolic(machine: _core.LeHuy) -> PhaseMagnetics:
        """Formulae: include/srm/machine/lehuy.hpp."""
        N_r, L_u, L_sat = machine.N_r, machine.L_u, machine.L_sat
        A, B = machine.A, machine.B

        def magnetics(i: Any, theta_e: FloatArray) -> tuple[Any, Any]:
            import casadi as ca  # here: it is slow to import, and a cached result does without

            past = theta_e > np.pi
            x = np.where(past, 2 - theta_e / np.pi, theta_e / np.pi)
            f = x * x * (3 - 2 * x)
            df = np.where(past, -1.0, 1.0) * N_r * 6 / np.pi * x * (1 - x)
            E = ca.exp(-B * i)
            psi = L_u * i + ((L_sat - L_u) * i + A * (1 - E)) * f
            tau = ((L_sat - L_u) * i * i / 2 + A * i - A / B * (1 - E)) * df
            return psi, tau

        return magnetics

    @staticmethod
    def content(machine: _core.LeHuy) -> list[Any]:
        return [machine.N_r, machine.L_u, machine.L_sat, machine.A, machine.B]


# Thousands of drives of a sweep have the same machine: what follows from it is computed once.
@lru_cache(maxsize=64)
def _le_huy(
    N_r: int, L_u: float, L_a: float, L_sat: float, i_m: float, psi_m: float
) -> _core.LeHuy:
    return _core.LeHuy(N_r=N_r, L_u=L_u, L_a=L_a, L_sat=L_sat, i_m=i_m, psi_m=psi_m)
