"""The [control] table of predictive torque control with edges inside the sample."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from reluctance import _core
from reluctance.laws.guided import FluxGuided

if TYPE_CHECKING:
    from reluctance.drive import Drive


class EdgeMpc(FluxGuided):
    """Switching instants as variables; torque in a band, flux near the guide."""

    law: Literal["edge_mpc"]

    def controller(self, drive: Drive) -> _core.Controller:
        machine = drive.control_machine
        table = self.flux_guide(drive)
        return _core.edge_mpc(
            self.setting(drive),
            guide=np.ascontiguousarray(table.psi),
            tau_max=drive.tau_max,
            w_sw=self.switching_weight(drive, table),
            psi_slack=table.u_dc / (2 * self.f_switch),
            R=machine.R,
            i_max=machine.i_max_A,
            T_s=self.T_s,
            delay=drive.sensing.delay_samples,
        )
