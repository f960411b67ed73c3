"""The [control] table of deadbeat flux control with duty cycles."""

from __future__ import annotations

from typing import Literal

from reluctance import _core
from reluctance.drive.known import Known
from reluctance.laws.flux_lead import flux_lead
from reluctance.laws.shared_torque import SharedTorque


class Deadbeat(SharedTorque):
    """The duty cycle that brings each phase to its share of the torque in one control period,
    which is the carrier's too."""

    law: Literal["deadbeat"]
    carriers: Literal["in_phase", "interleaved"] = "in_phase"

    def controller(self, known: Known) -> _core.Controller:
        sharing = self.shares(known)
        return _core.deadbeat(
            self.setting(known),
            sharing=sharing,
            lead=flux_lead(known, sharing, by_rule=self.theta_on_deg is None),
            R=known.R,
            i_max=known.i_max,
            T_s=self.T_s,
            delay=known.delay,
            carriers=getattr(_core.Carriers, self.carriers),
        )
