"""The current of laws with fixed conduction angles: from the torque reference, or fixed itself."""

from __future__ import annotations

import numpy as np
from pydantic import Field, model_validator

from reluctance import _core
from reluctance.drive.known import Known
from reluctance.errors import ParameterError
from reluctance.laws import flat_top
from reluctance.laws.conduction import ConductionAngles

FEEDBACK = 1.5  # of the torque: what the feedback of the mean may ask for


class PulseCurrent(ConductionAngles):
    """`i_ref_A` fixes the current; without it a table made at set-up gives it from the torque."""

    i_ref_A: float | None = Field(None, gt=0)

    @model_validator(mode="after")
    def fixed_current_has_fixed_angles(self) -> PulseCurrent:
        if not self.follows_torque and self.theta_on_deg is None:
            raise ValueError("without a torque reference needs theta_on_deg and theta_off_deg")
        return self

    @property
    def follows_torque(self) -> bool:
        return self.i_ref_A is None

    def check(self, known: Known) -> None:
        if self.i_ref_A is not None and self.i_ref_A > known.i_max:
            raise ParameterError(
                f"[control] i_ref_A = {self.i_ref_A:g}, need <= [machine] i_max_A = "
                f"{known.i_max:g}; lower one or raise the other"
            )

    def reference(
        self,
        known: Known,
        window: tuple[float, float],
        brake: tuple[float, float],
        *,
        band: float = 0.0,
        hard: bool = False,
    ) -> _core.MeanTorque:
        """The current over the torque reference; held, or chopped in a band of that half width
        [A]."""
        if self.i_ref_A is not None:
            return _core.MeanTorque.constant(self.i_ref_A)
        tau_end = known.tau_max if band else FEEDBACK * known.tau_max
        i_ref, i_brake = flat_top.current_tables(
            self.point(known),
            window,
            brake,
            known.tau_max,
            tau_end=tau_end,
            own=self.theta_on_deg is not None,
            band=band,
            hard=hard,
        )
        return _core.MeanTorque(tau_max=tau_end, i_ref=i_ref, i_brake=i_brake)

    def brake_window(self, known: Known) -> tuple[float, float]:
        """Where no torque is asked for, no angle has the least copper for it: the motoring window,
        mirrored about the aligned angle and the one of most torque."""
        if self.follows_torque or self.brake_on_deg is not None:
            return super().brake_window(known)
        on, off = self.window(known)
        return on + np.pi, off + np.pi
