"""The [control] table of conduction angles with PI current control and PWM."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from reluctance import _core
from reluctance.drive.known import Known
from reluctance.errors import ParameterError
from reluctance.laws.pulse_current import PulseCurrent

# Bandwidth times the dead time of the loop: half a sample of the PWM, and what the orders are late.
# It leaves a phase margin of about 64 deg: 90 deg less 57 deg per radian.
BANDWIDTH_PART = 0.45


class PwmCurrent(PulseCurrent):
    """Between turn-on and turn-off the current is held by PI control with feed-forward; the
    carrier's period is the control period."""

    law: Literal["pwm_current"]
    bandwidth_Hz: float | None = Field(None, gt=0)  # of the current loop; by default see above

    def check(self, known: Known) -> None:
        super().check(known)
        if self.bandwidth_Hz is not None and 2 * np.pi * self.bandwidth_Hz * self.T_s > 1:
            raise ParameterError(
                f"[control] bandwidth_Hz = {self.bandwidth_Hz:g}, need <= "
                f"{1 / (2 * np.pi * self.T_s):.5g} (one radian per control period); "
                "lower it or T_s_us"
            )

    def controller(self, known: Known) -> _core.Controller:
        window, brake = self.window(known), self.brake_window(known)
        bandwidth = BANDWIDTH_PART / ((0.5 + known.delay) * self.T_s)
        if self.bandwidth_Hz is not None:
            bandwidth = 2 * np.pi * self.bandwidth_Hz
        return _core.pwm_current(
            self.setting(known),
            conduction=self.conduction(known, window, brake),
            reference=self.reference(known, window, brake),
            R=known.R,
            bandwidth=bandwidth,
            T_s=self.T_s,
        )
