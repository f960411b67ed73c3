"""What the predictive laws on a flux guide share: one free number, the switching frequency."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field

from reluctance import _core
from reluctance.laws.base import Control, guide

if TYPE_CHECKING:
    from reluctance.drive import Drive
    from reluctance.limit import Table

FLUX_POINTS = 360  # angles of the flux guide: the volt-seconds of a sample are its differences


class FluxGuided(Control):
    """A predictive law that follows the flux of the least-copper profile. Every weight is made of
    the wanted switching frequency, the machine and the dc-link voltage (docs/control/best_mpc.md).
    """

    f_switch_kHz: float = Field(16.0, gt=0)  # wanted, per switch; reached to 0.7 to 1.2 of it
    guide_speed_rpm: float | None = Field(None, ge=0)  # by default the speed of the reference

    @property
    def f_switch(self) -> float:
        """Wanted turn-ons per switch and second [Hz]."""
        return self.f_switch_kHz * 1e3

    def flux_guide(self, drive: Drive) -> Table:
        """The profiles that the law follows."""
        return guide(drive, self.guide_speed_rpm, FLUX_POINTS)

    def switching_weight(self, drive: Drive, table: Table) -> float:
        """What a turn-on may cost at the working point [N^2 m^2 s]."""
        machine = drive.control_machine
        asked = drive.reference.course[1] if drive.reference.kind == "torque" else []
        tau_ref = max((abs(tau) for tau in asked), default=0.0) or drive.tau_max
        return _core.switching_weight(
            machine.magnetics,
            guide=np.ascontiguousarray(table.psi),
            tau_max=drive.tau_max,
            R=machine.R,
            tau_ref=tau_ref,
            omega_m=table.omega_m,
            u_dc=table.u_dc,
            i_max=machine.i_max_A,
            f_switch=self.f_switch,
        )
