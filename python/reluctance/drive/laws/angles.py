"""The [control] table of conduction angles with hysteresis current control, or with none."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field, model_validator

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.base.schema import FileName
from reluctance.drive.laws.angle_table import read_angle_table
from reluctance.drive.laws.current_table import Window
from reluctance.drive.laws.least_copper import ROOM
from reluctance.drive.laws.left_earlier import left_earlier
from reluctance.drive.laws.pulse_current import Currents, PulseCurrent, pulse_angles
from reluctance.drive.laws.pulse_table import pulse_table
from reluctance.drive.laws.pulses import FixedLaw, chopped
from reluctance.drive.tables.known import Known
from reluctance.drive.tables.variants import CURRENT_BAND, Look, Variant


class Angles(PulseCurrent):
    """Between turn-on and turn-off the current is held in a band; `regulate = "none"` leaves the
    whole pulse to the voltage (single-pulse operation)."""

    look: ClassVar[Look] = Look("pulses", "#777777", "--")
    title: ClassVar[str] = "hysteresis between fixed angles"
    variants: ClassVar[tuple[Variant, ...]] = (
        Variant(
            name="angles",
            free=CURRENT_BAND,
            place=pulse_angles,
            what="Flat current pulses between two angles, held in a band by soft chopping.",
            when="Ripple does not matter; or speed is so high that one pulse fills the voltage.",
            needs="one current comparator per phase, position compare",
        ),
    )
    law: Literal["angles"] = "angles"
    regulate: Literal["current", "none"] = "current"
    i_band_A: float | None = Field(None, gt=0)  # half width; by default 2 % of i_max_A
    chop: Literal["soft", "hard"] = "soft"  # above the band, motoring: freewheel or demagnetize
    watch: Literal["compare", "sampled"] = "compare"  # of the angle: by hardware or by the control
    angle_table: FileName | None = None  # CSV file of turn-on and turn-off over speed and torque

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

    @property
    def current_band(self) -> float | None:
        return self.i_band_A

    @property
    def uses_comparators(self) -> bool:
        return True

    def check(self, known: Known) -> None:
        super().check(known)
        if self.angle_table is None:
            return
        least, most = read_angle_table(self.angle_table).tau[0], known.machine.greatest_torque
        if least > most:
            raise ParameterError(
                f"{self.angle_table}: torque_Nm begins at {least:.4g}, and the greatest torque of "
                f"the machine is {most:.4g} N m; are torque_Nm and speed_rpm exchanged?"
            )

    def window(self, known: Known, room: float = ROOM) -> tuple[float, float]:
        """With a table those of the greatest torque at the working speed."""
        if self.angle_table is None:
            return super().window(known, room)
        return read_angle_table(self.angle_table).at(known.omega_m, known.tau_max)

    def core(self, known: Known) -> _core.Law:
        windows = self.windows(known)
        currents = self.currents(known, windows)
        return _core.angles(
            *self.built_for(known),
            conduction=self.conduction(known, windows[0].ends, windows[1].ends),
            reference=self.reference(known, currents),
            i_band=self.band(known),
            chop=_core.Leg.freewheel if self.chop == "soft" else _core.Leg.demagnetize,
            watch=getattr(_core.AngleWatch, self.watch),
            table=self.table(known, windows[0], currents),
        )

    def table(self, known: Known, window: Window, currents: Currents | None) -> _core.PulseTable:
        """Angles and current over speed and torque; empty where the angles are fixed."""
        if self.angle_table is not None:
            angles = read_angle_table(self.angle_table)
            return pulse_table(known, angles, self.band(known), hard=self.chop == "hard")
        if currents is None or self.theta_on_deg is not None or known.brakes:
            return _core.PulseTable()
        return left_earlier(window, known.tau_max, currents[0])

    def used(self, known: Known) -> dict[str, float]:
        used = super().used(known) | {"i_band_A": self.band(known)}
        idle = ["i_band_A"] if self.regulate == "none" else []
        if self.angle_table is not None:
            idle += ["theta_on_deg", "theta_off_deg"]
        return {key: value for key, value in used.items() if key not in idle}

    def fixed(self, known: Known, *, brakes: bool) -> FixedLaw:
        return chopped(known, self.band(known), brakes=brakes, hard=self.chop == "hard")
