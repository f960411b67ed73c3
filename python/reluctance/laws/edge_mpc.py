"""The [control] table of predictive torque control with edges inside the sample."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from reluctance import _core
from reluctance.laws.guided import FluxGuided

if TYPE_CHECKING:
    from reluctance.drive import Drive


class EdgeMpc(FluxGuided):
    """Switching instants as variables; torque in a band, flux near the guide."""

    law: Literal["edge_mpc"]

    def controller(self, drive: Drive) -> _core.Controller:
        guide = self.flux_guide(drive)
        return _core.edge_mpc(
            self.setting(drive),
            guide=guide.profiles,
            w_sw=guide.w_sw,
            psi_slack=guide.psi_slack,
            R=guide.R,
            i_max=guide.i_max,
            T_s=self.T_s,
            delay=drive.sensing.delay_samples,
        )
