"""The [control] table of conduction angles with PI current control and PWM."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from reluctance import _core
from reluctance.drive.known import Known
from reluctance.errors import ParameterError
from reluctance.laws.current_table import FloatArray, Windows
from reluctance.laws.pulse_current import PulseCurrent
from reluctance.laws.sampled_pwm import PiLoop, sampled

# Bandwidth times control period: half of it leaves a phase margin of about 60 deg, with the half
# sample of the PWM and one sample of delay taken from 90 deg at 57 deg per radian.
BANDWIDTH_PART = 0.3


class PwmCurrent(PulseCurrent):
    """Between turn-on and turn-off the current is held by PI control with feed-forward; the
    carrier's period is the control period."""

    law: Literal["pwm_current"]
    bandwidth_Hz: float | None = Field(None, gt=0)  # of the current loop; by default 0.3/T_s rad/s

    def check(self, known: Known) -> None:
        super().check(known)
        if self.bandwidth_Hz is not None and 2 * np.pi * self.bandwidth_Hz * self.T_s > 1:
            raise ParameterError(
                f"[control] bandwidth_Hz = {self.bandwidth_Hz:g}, need <= "
                f"{1 / (2 * np.pi * self.T_s):.5g} (one radian per control period); "
                "lower it or T_s_us"
            )

    def controller(self, known: Known) -> _core.Controller:
        windows = self.windows(known)
        return _core.pwm_current(
            self.setting(known),
            conduction=self.conduction(known, windows.motors, windows.brakes),
            reference=self.reference(known, self.currents(known, windows)),
            R=known.R,
            bandwidth=self.bandwidth,
            T_s=self.T_s,
        )

    @property
    def bandwidth(self) -> float:
        """Of the current loop [rad/s]."""
        if self.bandwidth_Hz is not None:
            return float(2 * np.pi * self.bandwidth_Hz)
        return BANDWIDTH_PART / self.T_s

    def mean_torque(self, known: Known, windows: Windows) -> FloatArray | None:
        return sampled(windows, PiLoop(self.bandwidth, self.T_s, known.delay))
