"""The [control] table of direct instantaneous torque control."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from reluctance import _core
from reluctance.base.arrays import FloatArray
from reluctance.base.errors import ParameterError
from reluctance.drive.laws.conduction import ConductionAngles
from reluctance.drive.laws.ditc_reach import Alone
from reluctance.drive.laws.hand_over import ALWAYS, TORQUES, HandsOver
from reluctance.drive.laws.least_copper import ROOM
from reluctance.drive.tables.known import Known
from reluctance.drive.tables.variants import Free, Look, Variant

INNER_PART = 0.01  # of tau_max: default inner band
OUTER_PART = 2.0  # of the inner band: default outer band
BRAKE_OFF = 335.0  # electrical: turn-off when braking [deg]


def overlapping_angles(n_phases: int, x: float, y: float) -> dict[str, float]:
    """Turn-on from 90 deg ahead of unaligned to 60 deg behind it, turn-off from 90 to 175 deg, at
    least a stroke apart."""
    on = -90 + 150 * x
    off = max(90 + 85 * y, on + 360 / n_phases)
    return {"theta_on_deg": round(on, 2), "theta_off_deg": round(off + 0.005, 2)}


class Ditc(HandsOver, ConductionAngles):
    """The torque error picks the legs, in an inner and an outer band."""

    look: ClassVar[Look] = Look("direct", "#CC79A7", "--")
    title: ClassVar[str] = "direct torque control (DITC)"
    variants: ClassVar[tuple[Variant, ...]] = (
        Variant(
            name="ditc",
            free=Free("tau_band_Nm", "tau", 1e-4, 0.5, slope=-1.0),
            place=overlapping_angles,
            what="The torque error, from a model, picks the legs in two bands.",
            when="Fast sampling and a good map: small ripple without current references.",
            needs="fast sampling",
        ),
    )
    knows_pairs: ClassVar[bool] = True
    law: Literal["ditc"] = "ditc"
    tau_band_Nm: float | None = Field(None, gt=0)  # inner, half width; by default 1 % of tau_max
    tau_band_outer_Nm: float | None = Field(None, gt=0)  # by default twice the inner one

    @model_validator(mode="after")
    def outer_band_is_outside(self) -> Ditc:
        inner, outer = self.tau_band_Nm, self.tau_band_outer_Nm
        if outer is not None and (inner is None or outer < inner):
            raise ValueError(f"tau_band_outer_Nm = {outer:g}, need >= tau_band_Nm, given as well")
        return self

    def check(self, known: Known) -> None:
        super().check(known)
        if self.tau_band_Nm is not None and self.tau_band_Nm >= known.tau_max:
            raise ParameterError(
                f"[control] tau_band_Nm = {self.tau_band_Nm:g}, need less than the greatest torque "
                f"of the drive, {known.tau_max:g} N m"
            )
        stroke = 360 / known.n_phases
        if self.theta_on_deg is None or self.theta_off_deg is None:
            return
        if self.theta_off_deg - self.theta_on_deg < stroke:
            raise ParameterError(
                f"[control] theta_off_deg - theta_on_deg = "
                f"{self.theta_off_deg - self.theta_on_deg:g}, need >= {stroke:g} with "
                f"{known.n_phases} phases, so that one is always in charge"
            )

    def core(self, known: Known) -> _core.Law:
        inner, outer = self.bands(known)
        window, brake = self.ends(known)
        motors, brakes = self._alone(known)
        make = self.maker(known, _core.ditc, _core.coupled_ditc)
        return make(
            conduction=self.conduction(known, window, brake),
            turn_on=_core.TurnOn(
                tau_max=known.tau_max if self.free_angles else 0.0,
                psi=motors.psi.tolist(),
                psi_brake=brakes.psi.tolist(),
            ),
            bands=_core.TorqueBands(inner=inner, outer=outer),
            **self.hand_over(known, "psi"),
            psi_band=inner / known.tau_max * float(motors.psi[-1]),
            R=known.R,
            i_max=known.i_max,
            T_s=self.T_s,
        )

    def bands(self, known: Known) -> tuple[float, float]:
        """Inner and outer half width [N m]."""
        inner = INNER_PART * known.tau_max if self.tau_band_Nm is None else self.tau_band_Nm
        outer = OUTER_PART * inner if self.tau_band_outer_Nm is None else self.tau_band_outer_Nm
        return inner, outer

    def used(self, known: Known) -> dict[str, float]:
        inner, outer = self.bands(known)
        return super().used(known) | {"tau_band_Nm": inner, "tau_band_outer_Nm": outer}

    def ends(self, known: Known) -> tuple[tuple[float, float], tuple[float, float]]:
        return self._window(known), self.brake_window(known)

    @property
    def free_angles(self) -> bool:
        """Whether no angle is the user's."""
        return self.theta_on_deg is None and self.brake_on_deg is None

    def own(self, known: Known) -> tuple[str, str]:
        never = f"more than {INNER_PART:.0%} of the torque is missing at some angle"
        return "its angles by rule", never

    def boundary(self, known: Known) -> tuple[FloatArray, FloatArray]:
        """That of windows by rule. Angles of the user are kept."""
        if not self.free_angles:
            return (np.full(TORQUES, ALWAYS),) * 2
        motors, brakes = self._alone(known)
        return motors.reach(INNER_PART), brakes.reach(INNER_PART)

    def _alone(self, known: Known) -> tuple[Alone, Alone]:
        """A phase a stroke before it is turned off, motoring and braking."""
        off, brake_off = self._window(known)[1], self.brake_window(known)[1]
        return Alone(known, off, 1), Alone(known, brake_off, -1)

    def _window(self, known: Known) -> tuple[float, float]:
        """By default the turn-off angle of least copper, and a turn-on angle from which flux
        can rise so far that the phase gives the whole torque alone once its predecessor is off."""
        window = self.window(known)
        if self.theta_on_deg is not None:
            return window
        return _turn_on(known, window[1], 1), window[1]

    def brake_window(self, known: Known, room: float = ROOM) -> tuple[float, float]:
        """The same from the other end: off when the torque of braking has nearly gone."""
        if self.brake_on_deg is not None:
            return super().brake_window(known, room)
        off = float(np.radians(BRAKE_OFF))
        return _turn_on(known, off, -1), off


def _turn_on(known: Known, theta_off: float, sign: int) -> float:
    """From where flux rises so far by one stroke before theta_off that the phase then gives the
    greatest torque of this sign alone [rad]."""
    alone = Alone(known, theta_off, sign)
    lead = known.N_r * known.omega_m * alone.psi[-1] / known.u_dc
    return float(theta_off - alone.stroke - lead)
