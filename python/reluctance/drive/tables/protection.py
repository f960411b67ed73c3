"""The [protection] table: at which readings the exported controller switches all legs off."""

from __future__ import annotations

from pydantic import Field, model_validator

from reluctance.base.schema import Section


class Protection(Section):
    """Trip levels; those that are left out follow from the drive."""

    i_trip_A: float | None = Field(None, gt=0)
    i_zero_A: float | None = Field(None, gt=0)  # readings up to this count as no current
    u_dc_min_V: float | None = Field(None, ge=0)
    u_dc_max_V: float | None = Field(None, gt=0)
    speed_max_rpm: float | None = Field(None, gt=0)
    speed_limit_rpm: float | None = Field(None, gt=0)  # no motoring torque from here on
    angle_slack_deg: float | None = Field(None, gt=0)  # electrical, see control/guard/advance.hpp
    u_ready_V: float | None = Field(None, gt=0)  # from here on the dc link is charged
    precharge_max_s: float = Field(5.0, gt=0)  # longest wait for it
    command_timeout_ms: float = Field(100.0, gt=0)  # longest time without a command
    diagnosis: bool = False  # says what broke, see control/guard/diagnosis.hpp
    flux_angle: bool = False  # follows the rotor by the flux linkages, see frame/flux_angle.hpp
    map_error_pct: float = Field(10.0, ge=0, lt=100)  # of the flux linkage, at most
    R_error_pct: float = Field(20.0, ge=0, lt=100)  # of the resistance
    u_error_pct: float = Field(2.0, ge=0, lt=100)  # of the voltage that the winding sees, of u_dc
    zero_error_deg: float = Field(2.0, ge=0, le=45)  # electrical: of the zero of the angle
    phase_error_pct: float = Field(1.0, ge=0, lt=100)  # of a phase, against the mean of all

    @model_validator(mode="after")
    def errors_are_asked_for(self) -> Protection:
        errors = {
            "map_error_pct",
            "R_error_pct",
            "u_error_pct",
            "zero_error_deg",
            "phase_error_pct",
            "flux_angle",
        }
        if not self.diagnosis:
            for key in sorted(self.model_fields_set & errors):
                raise ValueError(f"{key} has no effect without diagnosis = true; remove it")
        return self
