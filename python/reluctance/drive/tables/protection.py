"""The [protection] table: at which readings the exported controller switches all legs off."""

from __future__ import annotations

from pydantic import Field

from reluctance.base.schema import Section


class Protection(Section):
    """Trip levels; those that are left out follow from the drive."""

    i_trip_A: float | None = Field(None, gt=0)
    i_zero_A: float | None = Field(None, gt=0)  # readings up to this count as no current
    u_dc_min_V: float | None = Field(None, ge=0)
    u_dc_max_V: float | None = Field(None, gt=0)
    speed_max_rpm: float | None = Field(None, gt=0)
    speed_limit_rpm: float | None = Field(None, gt=0)  # no motoring torque from here on
    angle_slack_deg: float | None = Field(
        None, gt=0
    )  # electrical, see control/guard/protection.hpp
    u_ready_V: float | None = Field(None, gt=0)  # from here on the dc link is charged
    precharge_max_s: float = Field(5.0, gt=0)  # longest wait for it
    command_timeout_ms: float = Field(100.0, gt=0)  # longest time without a command
