"""The [control] table of conduction angles with hysteresis current control, or with none."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from reluctance import _core
from reluctance.drive.control import BAND_PART, NEVER_REACHED
from reluctance.drive.known import Known
from reluctance.laws.chopped import chopped
from reluctance.laws.current_table import FloatArray, Windows
from reluctance.laws.pulse_current import PulseCurrent


class Angles(PulseCurrent):
    """Between turn-on and turn-off the current is held in a band; `regulate = "none"` leaves the
    whole pulse to the voltage (single-pulse operation)."""

    law: Literal["angles"]
    regulate: Literal["current", "none"] = "current"
    i_band_A: float | None = Field(None, gt=0)  # half width; by default 2 % of i_max_A
    chop: Literal["soft", "hard"] = "soft"  # above the band: freewheel or demagnetize
    watch: Literal["compare", "sampled"] = "compare"  # of the angle: by hardware or by the control

    @model_validator(mode="after")
    def single_pulse_has_no_current(self) -> Angles:
        if self.regulate == "none":
            for key in ("i_ref_A", "i_band_A"):
                if getattr(self, key) is not None:
                    raise ValueError(f"{key} has no effect with regulate = 'none'; remove it")
        return self

    @property
    def follows_torque(self) -> bool:
        return self.regulate == "current" and self.i_ref_A is None

    def controller(self, known: Known) -> _core.Controller:
        windows = self.windows(known)
        if self.regulate == "none":
            reference = _core.MeanTorque.constant(NEVER_REACHED)
        else:
            reference = self.reference(known, windows)
        return _core.angles(
            self.setting(known),
            conduction=self.conduction(known, windows.motors, windows.brakes),
            reference=reference,
            i_band=self.band(known),
            chop=_core.Leg.freewheel if self.chop == "soft" else _core.Leg.demagnetize,
            watch=getattr(_core.AngleWatch, self.watch),
        )

    def band(self, known: Known) -> float:
        """Half width [A]."""
        return BAND_PART * known.i_max if self.i_band_A is None else self.i_band_A

    def mean_torque(self, known: Known, windows: Windows) -> FloatArray | None:
        return chopped(windows, self.band(known), self.chop == "hard")
