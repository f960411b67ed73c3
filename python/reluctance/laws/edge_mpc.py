"""The [control] table of predictive torque control with edges inside the sample."""

from __future__ import annotations

from typing import Any, Literal

from reluctance import _core
from reluctance.drive.known import Known
from reluctance.laws.guided import FluxGuided
from reluctance.laws.learning import Learns

MORE_FLUX = 1.2  # than believed


class EdgeMpc(FluxGuided, Learns):
    """Switching instants as variables; torque in a band, flux near the guide."""

    law: Literal["edge_mpc"]

    def guide_speeds(self, known: Known) -> list[float]:
        """A machine with more flux than believed has, in the units of the law, less voltage: as at
        a higher speed."""
        speeds = super().guide_speeds(known)
        if not self.learn or self.guide_speed_rpm is not None or known.omega_m == 0:
            return speeds
        return [*speeds, MORE_FLUX * known.omega_m]

    def controller(self, known: Known) -> _core.Controller:
        guide = self.flux_guide(self.of_tables(known))
        law: dict[str, Any] = {
            "guide": guide.profiles,
            "w_sw": guide.w_sw,
            "psi_slack": guide.psi_slack,
            "R": known.R,
            "i_max": known.i_max,
            "T_s": self.T_s,
            "delay": known.delay,
        }
        if not self.learn:
            return _core.edge_mpc(self.setting(known), **law)
        tau, u = guide.w_sw_powers
        learning = _core.learning_edge_mpc
        return learning(
            self.setting(known), fit=self.fit(known), w_sw_torque=tau, w_sw_voltage=u, **law
        )
