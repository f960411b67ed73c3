"""The [control] table of direct instantaneous torque control."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from reluctance import _core
from reluctance.drive.known import Known
from reluctance.errors import ParameterError
from reluctance.laws.conduction import ConductionAngles
from reluctance.laws.flat_top import ROOM

INNER_PART = 0.01  # of tau_max: default inner band
OUTER_PART = 2.0  # of the inner band: default outer band
BRAKE_OFF = 335.0  # electrical: turn-off when braking [deg]


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
        return _core.ditc(
            self.setting(known),
            conduction=self.conduction(known, self._window(known), self.brake_window(known)),
            bands=_core.TorqueBands(inner=inner, outer=outer),
            i_max=known.i_max,
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


def _turn_on(known: Known, theta_off: float, sign: int) -> float:
    """From where flux rises so far by one stroke before theta_off that the phase then gives the
    torque of this sign alone [rad]."""
    machine = known.machine
    theta = theta_off - 2 * np.pi / machine.n_phases
    i = np.linspace(0, machine.i_max_A, 500)
    magnetics = _core.magnetics(machine.magnetics, i, np.full_like(i, theta))
    tau = np.maximum.accumulate(sign * magnetics[:, 2])
    alone = min(int(np.searchsorted(tau, known.tau_max)), len(i) - 1)
    u = max(known.u_dc - machine.R * i[alone] / 2, known.u_dc / 2)
    return float(theta - machine.N_r * known.omega_m * magnetics[alone, 0] / u)
