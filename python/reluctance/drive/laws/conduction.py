"""Fixed conduction angles: their keys in a [control] table, and the current that gives a torque."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pydantic import Field, model_validator

from reluctance import _core
from reluctance.base.units import ask_about_radians, from_si, to_si
from reluctance.drive.laws.least_copper import ROOM, least_copper_angles
from reluctance.drive.laws.pulses import full_flux_speed
from reluctance.drive.tables.control import Control
from reluctance.drive.tables.known import Known

START_PART = 0.1  # of the working speed: below it, the window for starting
# Of the speed at which the flux linkage of i_max takes half a period: here it takes 4 deg, and
# pulses are as at standstill, where a period never ends.
SLOWEST = 0.02


class ConductionAngles(Control):
    """Turn-on and turn-off angle, electrical; by default those of least copper."""

    theta_on_deg: float | None = Field(None, ge=-180, lt=180)  # negative: ahead of unaligned
    theta_off_deg: float | None = Field(None, gt=-180, le=360)
    brake_on_deg: float | None = Field(None, ge=0, lt=360)  # braking forwards: 180 is aligned
    brake_off_deg: float | None = Field(None, gt=180, le=540)
    start_speed_rpm: float | None = Field(None, ge=0)  # below: a window centred on 90 deg

    @model_validator(mode="after")
    def angles_are_a_window(self) -> ConductionAngles:
        for what in ("theta", "brake"):
            on, off = getattr(self, f"{what}_on_deg"), getattr(self, f"{what}_off_deg")
            if (on is None) != (off is None):
                raise ValueError(f"needs both {what}_on_deg and {what}_off_deg, or neither")
            if on is not None and off is not None and not on < off < on + 360:
                raise ValueError(
                    f"{what}_on_deg = {on:g}, {what}_off_deg = {off:g}: need {what}_off_deg above "
                    f"{what}_on_deg by less than 360"
                )
        if self.theta_on_deg is not None and self.theta_off_deg is not None:
            ask_about_radians(theta_on_deg=self.theta_on_deg, theta_off_deg=self.theta_off_deg)
        return self

    def window(self, known: Known, room: float = ROOM) -> tuple[float, float]:
        """Turn-on and turn-off angle, electrical [rad]. room: torque of chopped pulses to have,
        over the greatest reference [1]."""
        if self.theta_on_deg is None or self.theta_off_deg is None:
            return least_copper_angles(self.offline(known), known.tau_max, room)
        return float(np.radians(self.theta_on_deg)), float(np.radians(self.theta_off_deg))

    def brake_window(self, known: Known, room: float = ROOM) -> tuple[float, float]:
        """The same for braking in forward motion."""
        if self.brake_on_deg is None or self.brake_off_deg is None:
            return least_copper_angles(self.offline(known), -known.tau_max, room)
        return float(np.radians(self.brake_on_deg)), float(np.radians(self.brake_off_deg))

    def used(self, known: Known) -> dict[str, float]:
        motors, brakes = self.ends(known)
        keys = ["theta_on_deg", "theta_off_deg", "brake_on_deg", "brake_off_deg"]
        never_brakes = known.motors or known.reference in ("none", "pv")
        angles = dict(zip(keys, map(float, np.degrees([*motors, *brakes])), strict=True))
        found = super().used(known) | {key: angles[key] for key in keys[: 2 if never_brakes else 4]}
        return found | {"start_speed_rpm": from_si(self.start_speed(known), "rpm")}

    def ends(self, known: Known) -> tuple[tuple[float, float], tuple[float, float]]:
        """Turn-on and turn-off angle, motoring and braking [rad]."""
        return self.window(known), self.brake_window(known)

    def conduction(
        self, known: Known, window: tuple[float, float], brake: tuple[float, float]
    ) -> _core.Conduction:
        """The windows, and the speed below which they are replaced by one for starting."""
        return _core.Conduction(
            theta_on=window[0],
            theta_off=window[1],
            brake_on=2 * np.pi - brake[1],  # in the frame of positive torque
            brake_off=2 * np.pi - brake[0],
            omega_start=self.start_speed(known),
        )

    def start_speed(self, known: Known) -> float:
        """Below it the windows are replaced [rad/s]."""
        if self.start_speed_rpm is not None:
            return to_si(self.start_speed_rpm, "rpm")
        return START_PART * known.omega_m

    def offline(self, known: Known) -> Known:
        """The drive for which pulses are computed: at the working speed, and not at standstill,
        where a period never ends."""
        return replace(known, omega_m=max(known.omega_m, SLOWEST * full_flux_speed(known)))
