"""Where a law hands over to the profile of the limit: see include/srm/control/part/feasible.hpp."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from reluctance import _core
from reluctance.base.arrays import FloatArray
from reluctance.base.errors import ParameterError
from reluctance.base.units import from_si
from reluctance.drive.laws.flux_guide import no_guide, packed, resistive_drop
from reluctance.drive.laws.guided import CURRENT_POINTS, MORE_TORQUE, Guided, with_room
from reluctance.drive.tables.known import Known

if TYPE_CHECKING:
    from reluctance.machine import optimum

TORQUES = 9  # of srm::Feasible
SAG = 0.8  # of the nominal dc-link voltage: how low a drive still is to hold its torque [1]
ALWAYS = 1e9  # omega_e/u_dc of a reference that never lacks voltage [rad/Wb]


class HandsOver(Guided):
    """A law that is its textbook self where the voltage suffices, and follows a profile beyond."""

    guide_levels: ClassVar[int] = 11  # 0.12 apart in the root of torque over tau_max

    def tables(self, known: Known, n_points: int = CURRENT_POINTS) -> list[optimum.Table]:
        """Those of motoring, which serve for braking too, mirrored; where every reference brakes,
        those of braking."""
        return self.made(known, -1 if known.brakes else 1, n_points)

    def boundary(self, known: Known) -> tuple[FloatArray, FloatArray]:
        """Greatest omega_e/u_dc of the law's own references for 0..tau_max, motoring and braking,
        (TORQUES,) [rad/Wb]."""
        raise NotImplementedError

    def own(self, known: Known) -> tuple[str, str]:
        """What of the table acts only where the law is its textbook self, and why it acts at no
        speed where the boundary is zero."""
        raise NotImplementedError

    def unused(self, known: Known, *, tau: float, omega_m: float, u_dc: float) -> str:
        """As Feasible of the core decides it in every sample (control/part/feasible.hpp)."""
        motoring, braking = self.boundary(known)
        table = braking if tau * omega_m < 0 else motoring
        torques = known.tau_max * np.linspace(0, 1, TORQUES)
        if known.N_r * abs(omega_m) <= u_dc * np.interp(abs(tau), torques, table):
            return ""
        own, never = self.own(known)
        at_no_speed = np.interp(abs(tau), torques, table == 0) > 0
        return f"{own}: {never if at_no_speed else f'{u_dc:.4g} V do not suffice for it'}"

    def hand_over(self, known: Known, quantity: Literal["i", "psi"]) -> dict[str, Any]:
        """The boundary and the profiles beyond it, as arguments of the law. Profiles are made for a
        drive that works there at as little as SAG of its voltage, and where their speeds are given.

        Parameters
        ----------
        known : Known
        quantity : of the profiles, current [A] or flux linkage [Wb].

        Raises
        ------
        ParameterError
            If the drive works beyond the boundary, and no profile is found there.
        """
        reach = self.boundary(known)
        own = {
            "feasible": _feasible(known, (np.full(TORQUES, ALWAYS),) * 2),
            "guide": no_guide(MORE_TORQUE * known.tau_max),
        }
        if not self.learns and self.guide_speed_rpm is None and not _beyond(known, reach, SAG):
            return own
        try:
            tables = with_room(known, self.tables, self.room(known, MORE_TORQUE))
        except RuntimeError as fault:
            if not _beyond(known, reach, 1.0):
                return own
            raise ParameterError(
                f"[control] law = {self.law!r} needs more than the {known.u_dc:g} V of the dc "
                f"link at {from_si(known.omega_m, 'rpm'):.5g} rpm and {known.tau_max:g} N m, "
                f"and no profile is found ({fault}); lower speed or torque"
            ) from None
        if resistive_drop(tables, known.R) >= known.u_dc and not _beyond(known, reach, 1.0):
            return own
        guide = packed(tables, quantity, known.at(known.omega_m), known.pairs)
        return {"feasible": _feasible(known, reach), "guide": guide}


def _feasible(known: Known, reach: tuple[FloatArray, FloatArray]) -> _core.Feasible:
    motoring, braking = (values.tolist() for values in reach)
    return _core.Feasible(tau_max=known.tau_max, motoring=motoring, braking=braking)


def _beyond(known: Known, reach: tuple[FloatArray, FloatArray], part: float) -> bool:
    """Whether a drive may work beyond its boundary, at a part of its voltage."""
    motoring, braking = (float(values.min()) for values in reach)
    least = motoring if known.motors else braking if known.brakes else min(motoring, braking)
    return known.N_r * known.omega_m > least * part * known.u_dc
