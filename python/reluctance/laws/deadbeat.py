"""The [control] table of deadbeat flux control with duty cycles."""

from __future__ import annotations

from typing import Any, Literal

from reluctance import _core
from reluctance.drive.known import Known
from reluctance.laws.flux_lead import flux_lead
from reluctance.laws.learning import Learns
from reluctance.laws.shared_torque import SharedTorque


class Deadbeat(SharedTorque, Learns):
    """The duty cycle that brings each phase to its share of the torque in one control period,
    which is the carrier's too."""

    law: Literal["deadbeat"]
    carriers: Literal["in_phase", "interleaved"] = "in_phase"

    def controller(self, known: Known) -> _core.Controller:
        sharing = self.shares(known)
        law: dict[str, Any] = {
            "sharing": sharing,
            "lead": flux_lead(self.of_tables(known), sharing, by_rule=self.theta_on_deg is None),
            "R": known.R,
            "i_max": known.i_max,
            "T_s": self.T_s,
            "delay": known.delay,
            "carriers": getattr(_core.Carriers, self.carriers),
        }
        if not self.learn:
            return _core.deadbeat(self.setting(known), **law)
        return _core.learning_deadbeat(
            self.setting(known), fit=self.fit(known), w_sw_torque=0.0, w_sw_voltage=0.0, **law
        )
