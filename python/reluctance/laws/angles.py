"""The [control] table of conduction angles with hysteresis current control, or with none."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from reluctance import _core
from reluctance.drive.control import BAND_PART
from reluctance.drive.known import Known
from reluctance.laws import flat_top
from reluctance.laws.angle_table import read_angle_table
from reluctance.laws.chopped import chopped
from reluctance.laws.current_table import Currents, FloatArray, Windows
from reluctance.laws.left_earlier import left_earlier
from reluctance.laws.pulse_current import PulseCurrent
from reluctance.laws.pulse_table import pulse_table


class Angles(PulseCurrent):
    """Between turn-on and turn-off the current is held in a band; `regulate = "none"` leaves the
    whole pulse to the voltage (single-pulse operation)."""

    law: Literal["angles"]
    regulate: Literal["current", "none"] = "current"
    i_band_A: float | None = Field(None, gt=0)  # half width; by default 2 % of i_max_A
    chop: Literal["soft", "hard"] = "soft"  # above the band: freewheel or demagnetize
    watch: Literal["compare", "sampled"] = "compare"  # of the angle: by hardware or by the control
    angle_table: str | None = None  # CSV file of turn-on and turn-off over speed and torque

    @model_validator(mode="after")
    def single_pulse_has_no_current(self) -> Angles:
        if self.regulate == "none":
            for key in ("i_ref_A", "i_band_A"):
                if getattr(self, key) is not None:
                    raise ValueError(f"{key} has no effect with regulate = 'none'; remove it")
        return self

    @model_validator(mode="after")
    def table_has_the_angles(self) -> Angles:
        if self.angle_table is None:
            return self
        if self.theta_on_deg is not None:
            raise ValueError("angle_table has the angles; remove theta_on_deg and theta_off_deg")
        return self

    def check_fixed_current(self) -> None:
        if self.angle_table is not None and not self.follows_torque:
            raise ValueError("angle_table needs a torque to follow; remove i_ref_A and regulate")
        super().check_fixed_current()

    @property
    def follows_torque(self) -> bool:
        return self.regulate == "current" and self.i_ref_A is None

    def check(self, known: Known) -> None:
        super().check(known)
        if self.angle_table is not None:
            read_angle_table(self.angle_table)

    def window(self, known: Known, room: float = flat_top.ROOM) -> tuple[float, float]:
        """With a table those of the greatest torque at the working speed."""
        if self.angle_table is None:
            return super().window(known, room)
        return read_angle_table(self.angle_table).at(known.omega_m, known.tau_max)

    def controller(self, known: Known) -> _core.Controller:
        windows = self.windows(known)
        currents = self.currents(known, windows)
        return _core.angles(
            self.setting(known),
            conduction=self.conduction(known, windows.motors, windows.brakes),
            reference=self.reference(known, currents),
            i_band=self.band(known),
            chop=_core.Leg.freewheel if self.chop == "soft" else _core.Leg.demagnetize,
            watch=getattr(_core.AngleWatch, self.watch),
            table=self.table(known, windows, currents),
        )

    def table(self, known: Known, windows: Windows, currents: Currents | None) -> _core.PulseTable:
        """Angles and current over speed and torque; empty where the angles are fixed."""
        hard = self.chop == "hard"
        if self.angle_table is not None:
            return pulse_table(known, read_angle_table(self.angle_table), self.band(known), hard)
        if currents is None or self.theta_on_deg is not None or known.brakes:
            return _core.PulseTable()
        return left_earlier(windows, known.tau_max, currents[0], self.band(known), hard)

    def band(self, known: Known) -> float:
        """Half width [A]."""
        return BAND_PART * known.i_max if self.i_band_A is None else self.i_band_A

    def mean_torque(self, known: Known, windows: Windows) -> FloatArray | None:
        return chopped(windows, self.band(known), self.chop == "hard")
