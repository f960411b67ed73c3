"""The [control] table of direct instantaneous torque control."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from reluctance import _core
from reluctance.errors import ParameterError
from reluctance.laws.conduction import ConductionAngles
from reluctance.laws.least_copper import ROOM
from reluctance.tables.known import Known
from reluctance.tables.variants import Free, Look, Variant

FloatArray = NDArray[np.float64]

INNER_PART = 0.01  # of tau_max: default inner band
OUTER_PART = 2.0  # of the inner band: default outer band
BRAKE_OFF = 335.0  # electrical: turn-off when braking [deg]
WIDE = float(np.radians(130))  # the widest window, without the angle in which flux is built up
TORQUES = 9  # of srm::TurnOn
# Speed from which on the window follows the torque and the mean is held by feedback at the greatest
# torque too, as part of the one at which the flux of i_max just rises in half a period. Below it
# the window made for that torque holds the mean within 1.5 % (docs/control/quadrants.md).
FAST = 0.28


def overlapping_angles(n_phases: int, x: float, y: float) -> dict[str, float]:
    """Turn-on from 90 deg ahead of unaligned to 60 deg behind it, turn-off from 90 to 175 deg, at
    least a stroke apart."""
    on = -90 + 150 * x
    off = max(90 + 85 * y, on + 360 / n_phases)
    return {"theta_on_deg": round(on, 2), "theta_off_deg": round(off + 0.005, 2)}


class Ditc(ConductionAngles):
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
        inner = INNER_PART * known.tau_max if self.tau_band_Nm is None else self.tau_band_Nm
        outer = OUTER_PART * inner if self.tau_band_outer_Nm is None else self.tau_band_outer_Nm
        window, brake = self._window(known), self.brake_window(known)
        return _core.ditc(
            *self.built_for(known),
            conduction=self.conduction(known, window, brake),
            turn_on=self._turn_on(known, window[1], brake[1]),
            bands=_core.TorqueBands(inner=inner, outer=outer),
            i_max=known.i_max,
            T_s=self.T_s,
        )

    def _turn_on(self, known: Known, off: float, brake_off: float) -> _core.TurnOn:
        """How windows by rule follow torque, speed and voltage; one's own stay."""
        by_rule = self.theta_on_deg is None and self.brake_on_deg is None
        stroke = 2 * np.pi / known.n_phases
        dwell = _dwell(known, off)
        i = np.full(2, known.i_max)
        unaligned, aligned = _core.magnetics(known.magnetics, i, np.array([0, np.pi]))[:, 0]
        corner = np.pi * known.u_dc / (known.N_r * (aligned - unaligned))
        return _core.TurnOn(
            tau_max=known.tau_max if by_rule else 0.0,
            omega_from=FAST * corner if dwell == stroke else 0.0,
            dwell=dwell,
            dwell_brake=stroke,
            psi=_flux_alone(known, off, 1),
            psi_brake=_flux_alone(known, brake_off, -1),
        )

    def _window(self, known: Known) -> tuple[float, float]:
        """By default the turn-off angle of least copper, and a turn-on angle from which flux
        can rise so far that the phase gives the whole torque alone once its predecessor is off."""
        window = self.window(known)
        if self.theta_on_deg is not None:
            return window
        return float(min(window[0], _turn_on(known, window[1], sign=1))), window[1]

    def brake_window(self, known: Known, room: float = ROOM) -> tuple[float, float]:
        """The same from the other end: off when the torque of braking has nearly gone."""
        if self.brake_on_deg is not None:
            return super().brake_window(known, room)
        off = float(np.radians(BRAKE_OFF))
        return _turn_on(known, off, sign=-1), off


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
    at = np.searchsorted(tau, known.tau_max * np.linspace(0, 1, TORQUES))
    return [float(value) for value in psi[np.minimum(at, len(tau) - 1)]]


def _turn_on(known: Known, theta_off: float, sign: int) -> float:
    """From where flux rises so far by one stroke before theta_off that the phase then gives the
    greatest torque of this sign alone [rad]."""
    theta = theta_off - 2 * np.pi / known.n_phases
    psi = _flux_alone(known, theta_off, sign)[-1]
    return float(theta - known.N_r * known.omega_m * psi / known.u_dc)
