"""The current of laws with fixed conduction angles: from the torque reference, or fixed itself."""

from __future__ import annotations

import numpy as np
from pydantic import Field, model_validator

from reluctance import _core
from reluctance.drive.control import NEVER_REACHED
from reluctance.drive.known import Known
from reluctance.errors import ParameterError
from reluctance.laws.conduction import ConductionAngles
from reluctance.laws.current_table import Currents, FloatArray, Windows
from reluctance.laws.flat_top import ROOM

MORE_ROOM = (1.3, 1.6)  # over the torque: for windows whose pulses fall short of the flat top's


class PulseCurrent(ConductionAngles):
    """`i_ref_A` fixes the current; without it a table made at set-up gives it from the torque."""

    i_ref_A: float | None = Field(None, gt=0)

    @model_validator(mode="after")
    def fixed_current_has_fixed_angles(self) -> PulseCurrent:
        self.check_fixed_current()
        return self

    def check_fixed_current(self) -> None:
        """Raises ValueError where the current is fixed and the angles are not."""
        if not self.follows_torque and self.theta_on_deg is None:
            raise ValueError("without a torque reference needs theta_on_deg and theta_off_deg")

    @property
    def follows_torque(self) -> bool:
        return self.i_ref_A is None

    def check(self, known: Known) -> None:
        if self.i_ref_A is not None and self.i_ref_A > known.i_max:
            raise ParameterError(
                f"[control] i_ref_A = {self.i_ref_A:g}, need <= [machine] i_max_A = "
                f"{known.i_max:g}; lower one or raise the other"
            )

    def windows(self, known: Known) -> Windows:
        """Both windows; those by rule have as much room above the greatest torque as the law's own
        pulses need."""
        point = self.point(known)
        motors, brakes = self.window(known), self.brake_window(known)
        windows = Windows(point, motors, brakes)
        if not self.follows_torque:
            return windows
        for room in MORE_ROOM:
            short = windows.short(known.tau_max, self.mean_torque(known, windows))
            motors = self.window(known, room) if short[0] else motors
            brakes = self.brake_window(known, room) if short[1] else brakes
            windows = Windows(point, motors, brakes)
        return windows

    def currents(self, known: Known, windows: Windows) -> Currents | None:
        """Of the torques 0..tau_max in equal steps, motoring and braking [A]; None where the
        current does not follow the torque."""
        if not self.follows_torque:
            return None
        return windows.tables(
            known.tau_max,
            lambda windows: self.mean_torque(known, windows),
            by_rule=self.theta_on_deg is None,
        )

    def reference(self, known: Known, currents: Currents | None) -> _core.MeanTorque:
        """The current over the torque reference."""
        if currents is None:
            return _core.MeanTorque.constant(self.i_ref_A or NEVER_REACHED)
        return _core.MeanTorque(tau_max=known.tau_max, i_ref=currents[0], i_brake=currents[1])

    def mean_torque(self, known: Known, windows: Windows) -> FloatArray | None:
        """What the law's own pulses give [N m]; None where flat-top pulses are known to serve."""
        raise NotImplementedError

    def brake_window(self, known: Known, room: float = ROOM) -> tuple[float, float]:
        """Where no torque is asked for, no angle has the least copper for it: the motoring window,
        mirrored about the aligned angle and the one of most torque."""
        if self.follows_torque or self.brake_on_deg is not None:
            return super().brake_window(known, room)
        on, off = self.window(known)
        return on + np.pi, off + np.pi
