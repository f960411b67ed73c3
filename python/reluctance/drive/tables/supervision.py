"""The [supervision] table: the drive with its states, and a fault that it meets."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from reluctance.base.schema import Section


class Supervision(Section):
    """With `enable_s` the states of the drive and its protection stand around the control, as on a
    target: precharge, calibration of the current sensors, run, fault. Times are of the run."""

    enable_s: float | None = Field(None, ge=0)  # the drive is enabled
    precharge_ms: float = Field(0.0, ge=0)  # from then on the voltage of the dc link rises so long
    fault: Literal[
        "none",
        "over_current",
        "over_voltage",
        "under_voltage",
        "dead_current_sensor",
        "frozen_current_sensor",
        "lost_encoder",
        "no_command",
        "hardware_trip",
    ] = "none"
    fault_phase: Literal["a", "b", "c", "d", "e", "f"] = "a"  # of a current sensor
    fault_s: float | None = Field(None, ge=0)  # it begins
    gone_s: float | None = Field(None, ge=0)  # its cause is gone; by default at clear_s
    clear_s: float | None = Field(None, ge=0)  # the drive is disabled, and the fault cleared
    restart_s: float | None = Field(None, ge=0)  # the drive is enabled again

    @model_validator(mode="after")
    def times_are_in_order(self) -> Supervision:
        if self.enable_s is None:
            for key in sorted(self.model_fields_set):
                raise ValueError(f"{key} has no effect without enable_s; set enable_s = 0.0")
            return self
        if (self.fault == "none") != (self.fault_s is None):
            raise ValueError(f"fault = {self.fault!r}, fault_s = {self.fault_s}: need both or none")
        if self.fault == "none":
            for key in sorted(self.model_fields_set & {"fault_phase", "gone_s"}):
                raise ValueError(f"{key} has no effect without a fault; remove it")
        if self.restart_s is not None and self.clear_s is None:
            raise ValueError("restart_s needs clear_s: a drive starts again after it was disabled")
        for later, earlier in (
            *(("fault_s", "enable_s"), ("gone_s", "fault_s"), ("clear_s", "fault_s")),
            *(("clear_s", "enable_s"), ("restart_s", "clear_s")),
        ):
            at, before = getattr(self, later), getattr(self, earlier)
            if at is not None and before is not None and at <= before:
                raise ValueError(f"{later} = {at:g}, need more than {earlier} = {before:g}")
        return self

    @property
    def on(self) -> bool:
        """True where the states of the drive stand around its control."""
        return self.enable_s is not None
