"""The [control] table of deadbeat flux control with duty cycles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from reluctance import _core
from reluctance.laws.shared_torque import SharedTorque

if TYPE_CHECKING:
    from reluctance.drive import Drive


class Deadbeat(SharedTorque):
    """The duty cycle that brings each phase to its share of the torque in one control period,
    which is the carrier's too."""

    law: Literal["deadbeat"]
    carriers: Literal["in_phase", "interleaved"] = "in_phase"

    def controller(self, drive: Drive) -> _core.Controller:
        return _core.deadbeat(
            self.setting(drive),
            sharing=self.shares(drive),
            R=drive.control_machine.R,
            i_max=drive.control_machine.i_max_A,
            T_s=self.T_s,
            delay=drive.sensing.delay_samples,
            carriers=getattr(_core.Carriers, self.carriers),
        )
