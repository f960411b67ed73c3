"""The [control] table of conduction angles with PI current control and PWM."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.drive.laws.pulse_current import PulseCurrent, pulse_angles
from reluctance.drive.laws.pulses import PERIODS, FixedLaw, double_precision, period
from reluctance.drive.tables.known import Known
from reluctance.drive.tables.variants import CARRIER, Look, Variant

# Bandwidth times control period: half of it leaves a phase margin of about 60 deg, with the half
# sample of the PWM and one sample of delay taken from 90 deg at 57 deg per radian.
BANDWIDTH_PART = 0.3
AVERAGED = 600  # samples at least, so that they fall on all angles
MOST_SAMPLES = 1500  # of a period: with more of them a current is no nearer to its reference


class PwmCurrent(PulseCurrent):
    """Between turn-on and turn-off the current is held by PI control with feed-forward; the
    carrier's period is the control period."""

    look: ClassVar[Look] = Look("pulses", "#000000", "--")
    title: ClassVar[str] = "PWM current control"
    variants: ClassVar[tuple[Variant, ...]] = (
        Variant(
            name="pwm_current",
            free=CARRIER,
            place=pulse_angles,
            what="Flat current pulses between two angles, held by PI control and PWM.",
            when="As `angles`, where the switching frequency has to be constant.",
            needs="PWM timers",
        ),
    )
    law: Literal["pwm_current"] = "pwm_current"
    bandwidth_Hz: float | None = Field(None, gt=0)  # of the current loop; by default 0.3/T_s rad/s

    def check(self, known: Known) -> None:
        super().check(known)
        if self.bandwidth_Hz is not None and 2 * np.pi * self.bandwidth_Hz * self.T_s > 1:
            raise ParameterError(
                f"[control] bandwidth_Hz = {self.bandwidth_Hz:g}, need <= "
                f"{1 / (2 * np.pi * self.T_s):.5g} (one radian per control period); "
                "lower it or T_s_us"
            )

    def core(self, known: Known) -> _core.Law:
        windows = self.windows(known)
        return _core.pwm_current(
            *self.built_for(known),
            conduction=self.conduction(known, windows[0].ends, windows[1].ends),
            reference=self.reference(known, self.currents(known, windows)),
            R=known.R,
            bandwidth=self.bandwidth,
            T_s=self.T_s,
        )

    def used(self, known: Known) -> dict[str, float]:
        return super().used(known) | {"bandwidth_Hz": self.bandwidth / (2 * np.pi)}

    @property
    def bandwidth(self) -> float:
        """Of the current loop [rad/s]."""
        if self.bandwidth_Hz is not None:
            return float(2 * np.pi * self.bandwidth_Hz)
        return BANDWIDTH_PART / self.T_s

    def fixed(self, known: Known, *, brakes: bool) -> FixedLaw:
        T_s = max(known.T_s, period(known) / MOST_SAMPLES)
        bandwidth = min(self.bandwidth, BANDWIDTH_PART / T_s) if T_s > known.T_s else self.bandwidth

        def controller(known: Known, conduction: _core.Conduction, i: float) -> _core.Controller:
            law = _core.pwm_current(
                *double_precision(known),
                conduction=conduction,
                reference=_core.MeanTorque.constant(i),
                R=known.R,
                bandwidth=bandwidth,
                T_s=known.T_s,
            )
            return _core.Controller(law, _core.Frame(delay=known.delay))

        periods = int(np.ceil(max(AVERAGED * T_s / period(known), PERIODS)))
        return FixedLaw(replace(known, T_s=T_s), brakes, controller, periods)
