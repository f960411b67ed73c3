"""The current of laws with fixed conduction angles: from the torque reference, or fixed itself."""

from __future__ import annotations

import numpy as np
from pydantic import Field, model_validator

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.base.units import from_si
from reluctance.drive.laws.conduction import ConductionAngles
from reluctance.drive.laws.current_table import Window
from reluctance.drive.laws.least_copper import ROOM
from reluctance.drive.laws.pulses import FixedLaw
from reluctance.drive.tables.control import NEVER_REACHED
from reluctance.drive.tables.known import Known

Currents = tuple[list[float], list[float]]  # over torques, motoring and braking [A]

MORE_ROOM = (1.3, 1.6)  # over the torque: for windows whose pulses fall short of the flat top's


def pulse_angles(n_phases: int, x: float, y: float) -> dict[str, float]:
    """Turn-on from 90 deg ahead of unaligned to 60 deg behind it, turn-off from 90 to 175 deg."""
    return {"theta_on_deg": round(-90 + 150 * x, 2), "theta_off_deg": round(90 + 85 * y, 2)}


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
        super().check(known)
        if self.i_ref_A is not None and self.i_ref_A > known.i_max:
            raise ParameterError(
                f"[control] i_ref_A = {self.i_ref_A:g}, need <= [machine] i_max_A = "
                f"{known.i_max:g}; lower one or raise the other"
            )

    def windows(self, known: Known) -> tuple[Window, Window]:
        """Motoring and braking. Those by rule have as much room above the greatest torque as the
        law's own pulses need."""
        known = self.offline(known)
        return self._roomy(known, brakes=False), self._roomy(known, brakes=True)

    def ends(self, known: Known) -> tuple[tuple[float, float], tuple[float, float]]:
        motors, brakes = self.windows(known)
        return motors.ends, brakes.ends

    def _roomy(self, known: Known, *, brakes: bool) -> Window:
        of, law = self.brake_window if brakes else self.window, self.fixed(known, brakes=brakes)
        window = Window(*of(known), law)
        if self.follows_torque:
            for room in MORE_ROOM:
                if window.curve.tau[-1] < known.tau_max:
                    window = Window(*of(known, room), law)
        return window

    def currents(self, known: Known, windows: tuple[Window, Window]) -> Currents | None:
        """Of the torques 0..tau_max in equal steps, motoring and braking [A]; None where the
        current does not follow the torque.

        Raises
        ------
        ParameterError
            If the window of the direction in which all references are does not give the greatest
            of them at i_max, or none gives tau_max. A pump on an array motors. Angles of one's own
            must motor.
        """
        if not self.follows_torque:
            return None
        motors, brakes = windows
        able = [motors, brakes] if self.theta_on_deg is None else [motors]
        drives = known.motors or known.reference == "pv"
        asked = [motors] if drives else able[-1:] if known.brakes else able
        self._give(known, asked, known.tau_working)
        self._give(known, able, known.tau_max)
        return motors.currents(known.tau_max), brakes.currents(known.tau_max)

    @staticmethod
    def _give(known: Known, windows: list[Window], tau: float) -> None:
        """Raises ParameterError where none of the windows gives this mean torque."""
        best = max(windows, key=lambda window: float(window.curve.tau[-1]))
        most = float(best.curve.tau[-1])
        if most < tau:
            on, off = np.degrees(best.ends)
            names = "tau_max_Nm"
            if known.reference == "torque" and known.tau_working > most:
                names = "[reference] torque, and tau_max_Nm where it is given"
            raise ParameterError(
                f"[control] angles {on:g} to {off:g} deg give a mean torque of at most {most:.4g} "
                f"N m at i_max_A = {known.i_max:g} and {from_si(known.omega_m, 'rpm'):.5g} rpm, "
                f"need {tau:g}; change the angles, lower the speed or the torque ({names}), or "
                "raise the voltage"
            )

    def reference(self, known: Known, currents: Currents | None) -> _core.MeanTorque:
        """The current over the torque reference."""
        if currents is None:
            return _core.MeanTorque.constant(self.i_ref_A or NEVER_REACHED)
        return _core.MeanTorque(tau_max=known.tau_max, i_ref=currents[0], i_brake=currents[1])

    def fixed(self, known: Known, *, brakes: bool) -> FixedLaw:
        """The law with a fixed current, braking or motoring."""
        raise NotImplementedError

    def brake_window(self, known: Known, room: float = ROOM) -> tuple[float, float]:
        """Where no torque is asked for, no angle has the least copper for it: the motoring window,
        mirrored about the aligned angle and the one of most torque."""
        if self.follows_torque or self.brake_on_deg is not None:
            return super().brake_window(known, room)
        on, off = self.window(known)
        return on + np.pi, off + np.pi
