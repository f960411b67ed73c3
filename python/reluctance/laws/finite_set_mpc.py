"""The [control] table of finite-control-set predictive torque control."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from reluctance import _core
from reluctance.drive.known import Known
from reluctance.laws.flux_guide import FluxGuide
from reluctance.laws.guided import FluxGuided

PULSES_PER_TURN_ON = 4.8  # pulses a second of the phase in charge, of a turn-on of one switch
# When motoring, a guide that conducts in more than this part of the period is followed closer, by
# this factor on the weight: flux that is left past alignment to win torque now brakes later.
# Measured at the speeds of docs/control/quadrants.md on two of its machines and twelve others that
# were drawn: with 1 the torque of two collapses at three times base speed, 4 and 16 hold all, and 4
# has less ripple.
CONDUCTS_MOST = 0.9  # [1]
CLOSER = 4.0  # [1]
NO_GUIDE = _core.Guide(np.zeros((1, 2, 3)), tau_max=1.0, omega_m=[0.0], u_dc=1.0)


class FiniteSetMpc(FluxGuided):
    """One leg combination a sample, by branch and bound over the horizon."""

    law: Literal["finite_set_mpc"]
    horizon: int = Field(1, ge=1, le=4)  # samples
    guided: bool = True  # without its guide the law is short-sighted: for comparison only
    w_i: float = Field(0.0, ge=0)  # weight of copper [N^2 m^2/A^2]

    def controller(self, known: Known) -> _core.Controller:
        guide = self.flux_guide(known)
        pulse = 1 / (PULSES_PER_TURN_ON * self.f_switch)
        return _core.finite_set_mpc(
            self.setting(known),
            guide=guide.profiles if self.guided else NO_GUIDE,
            horizon=self.horizon,
            w_psi=self.w_psi(guide, known) if self.guided else [0.0],
            conducts=guide.conducts if self.guided else [0.0],
            w_i=self.w_i,
            w_sw=guide.w_sw,
            t_end=pulse**2 / (24 * self.horizon * self.T_s),
            R=known.R,
            i_max=known.i_max,
            T_s=self.T_s,
            delay=known.delay,
        )

    def w_psi(self, guide: FluxGuide, known: Known) -> list[float]:
        """Weight of the distance to the guide, (n_speeds,) [N^2 m^2/Wb^2]."""
        return [
            CLOSER * w if conducts > CONDUCTS_MOST and not known.brakes else w
            for w, conducts in zip(guide.w_psi, guide.conducts, strict=True)
        ]
