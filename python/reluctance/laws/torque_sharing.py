"""The [control] table of torque sharing with hysteresis current control."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from reluctance import _core
from reluctance.drive.control import BAND_PART
from reluctance.drive.known import Known
from reluctance.laws.flux_lead import flux_lead
from reluctance.laws.shared_torque import SharedTorque


class TorqueSharing(SharedTorque):
    """Each phase's share of the torque as a current reference, held in a band."""

    law: Literal["torque_sharing"]
    i_band_A: float | None = Field(None, gt=0)  # half width; by default 2 % of i_max_A
    chop: Literal["soft", "hard"] = "soft"  # above the band: freewheel or demagnetize

    def controller(self, known: Known) -> _core.Controller:
        machine, sharing = known.machine, self.shares(known)
        return _core.torque_sharing(
            self.setting(known),
            sharing=sharing,
            lead=flux_lead(known, sharing, by_rule=self.theta_on_deg is None),
            i_max=machine.i_max_A,
            i_band=BAND_PART * machine.i_max_A if self.i_band_A is None else self.i_band_A,
            T_s=self.T_s,
            t_ahead=self.T_s * (0.5 + known.delay),  # mid-sample
            chop=_core.Leg.freewheel if self.chop == "soft" else _core.Leg.demagnetize,
        )
