"""The [control] table of direct instantaneous torque control."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from reluctance import _core
from reluctance.drive.known import Known
from reluctance.errors import ParameterError
from reluctance.laws.conduction import ConductionAngles

FloatArray = NDArray[np.float64]

INNER_PART = 0.01  # of tau_max: default inner band
OUTER_PART = 2.0  # of the inner band: default outer band
# Turn-off angles, electrical [deg]: late enough that the outgoing phase fills what the incoming one
# lacks, early enough that its flux is gone in time. Found on the machines of studies/quadrants.py
# up to base speed: the rms error is flat within 5 deg of these.
OFF, BRAKE_OFF = 150.0, 337.0
WIDE = float(np.radians(130))  # the widest window, without the angle in which flux is built up
TORQUES = 9  # of srm::TurnOn


class Ditc(ConductionAngles):
    """The torque error picks the legs, in an inner and an outer band."""

    law: Literal["ditc"]
    tau_band_Nm: float | None = Field(None, gt=0)  # inner, half width; by default 1 % of tau_max
    tau_band_outer_Nm: float | None = Field(None, gt=0)  # by default twice the inner one

    @model_validator(mode="after")
    def outer_band_is_outside(self) -> Ditc:
        inner, outer = self.tau_band_Nm, self.tau_band_outer_Nm
        if outer is not None and (inner is None or outer < inner):
            raise ValueError(f"tau_band_outer_Nm = {outer:g}, need >= tau_band_Nm, given as well")
        return self

    def check(self, known: Known) -> None:
        stroke = 360 / known.n_phases
        if self.theta_on_deg is None or self.theta_off_deg is None:
            return
        if self.theta_off_deg - self.theta_on_deg < stroke:
            raise ParameterError(
                f"[control] theta_off_deg - theta_on_deg = "
                f"{self.theta_off_deg - self.theta_on_deg:g}, need >= {stroke:g} with "
                f"{known.n_phases} phases, so that one is always in charge"
            )

    def controller(self, known: Known) -> _core.Controller:
        inner = INNER_PART * known.tau_max if self.tau_band_Nm is None else self.tau_band_Nm
        outer = OUTER_PART * inner if self.tau_band_outer_Nm is None else self.tau_band_outer_Nm
        window, brake = self.window(known), self.brake_window(known)
        none = [0.0] * TORQUES
        return _core.ditc(
            self.setting(known),
            conduction=self.conduction(known, window, brake),
            turn_on=_core.TurnOn(
                tau_max=known.tau_max,
                psi=_flux_alone(known, window[1], 1) if self.theta_on_deg is None else none,
                psi_brake=_flux_alone(known, brake[1], -1) if self.brake_on_deg is None else none,
            ),
            bands=_core.TorqueBands(inner=inner, outer=outer),
            i_max=known.i_max,
            T_s=self.T_s,
        )

    def window(self, known: Known) -> tuple[float, float]:
        """By default a stroke, entered as much earlier as flux needs to be built up."""
        if self.theta_on_deg is not None:
            return super().window(known)
        off = float(np.radians(OFF))
        return off - _dwell(known, off), off

    def brake_window(self, known: Known) -> tuple[float, float]:
        """The same: off when the torque of braking has nearly gone."""
        if self.brake_on_deg is not None:
            return super().brake_window(known)
        off = float(np.radians(BRAKE_OFF))
        return off - 2 * np.pi / known.n_phases, off


def _dwell(known: Known, off: float) -> float:
    """A stroke; more where phases that conduct for a stroke do not give the torque at i_max in the
    mean over the angle [rad]. Braking, the EMF holds their current up past the window."""
    stroke = dwell = 2 * np.pi / known.n_phases
    while dwell < WIDE:
        theta = np.linspace(off - dwell, off, 61)
        i = np.full_like(theta, known.i_max)
        tau = _core.magnetics(known.magnetics, i, theta)[:, 2].mean() * dwell / stroke
        if tau > known.tau_max:
            break
        dwell += stroke / 12
    return float(dwell)


def _alone(known: Known, theta: float, sign: int) -> tuple[FloatArray, FloatArray]:
    """Torque of this sign [N m] of a phase at an angle, and what a turn-on needs for it: its flux,
    and what the resistance takes while it is built up [Wb]."""
    i = np.linspace(0, known.i_max, 500)
    magnetics = _core.magnetics(known.magnetics, i, np.full_like(i, theta))
    left = np.maximum(known.u_dc - known.R * i / 2, known.u_dc / 2)
    tau = np.maximum.accumulate(sign * magnetics[:, 2])
    return np.asarray(tau), np.asarray(magnetics[:, 0] * known.u_dc / left)


def _flux_alone(known: Known, theta_off: float, sign: int) -> list[float]:
    """What a phase needs that is to give the torques 0..tau_max alone, a stroke before it is turned
    off [Wb]."""
    tau, psi = _alone(known, theta_off - 2 * np.pi / known.n_phases, sign)
    torques = known.tau_max * np.linspace(0, 1, TORQUES)
    at = np.minimum(np.searchsorted(tau, torques), len(tau) - 1)
    return [float(value) for value in psi[at]]
