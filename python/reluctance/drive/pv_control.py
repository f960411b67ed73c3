"""The [pv_control] table: voltage control and power tracking of a drive on an array."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from reluctance import _core
from reluctance.drive.schema import Section
from reluctance.errors import ParameterError
from reluctance.units import to_si

LOWEST, HIGHEST = 0.6, 1.3  # of the nominal dc-link voltage: default limits of the reference
FULL, STOP = 0.55, 0.45  # torque is whole above, none below
WAKES = 0.7
LEAD = 0.05  # of the greatest speed: the start ramp is never further ahead of the speed
SETTLE = 0.4  # of the tracking interval: left out of the means
LONGEST = 4.0  # tracking intervals that a mean may take where the rotor creeps
DRY_SPEED = 0.7  # of the greatest speed: below it nothing tells a dry pump


class PvControl(Section):
    """Voltages that are left out follow from the nominal dc-link voltage of [converter]."""

    tracking: Literal["perturb_observe", "incremental_conductance", "constant"] = "perturb_observe"
    actuator: Literal["torque", "speed"] = "torque"  # what the voltage controller moves
    current: Literal["sensor", "legs"] = "sensor"  # of the array; legs: from phase currents
    u_ref_V: float | None = Field(None, gt=0)  # at the start, or throughout
    u_ref_min_V: float | None = Field(None, gt=0)
    u_ref_max_V: float | None = Field(None, gt=0)
    step_V: float = Field(2.0, gt=0)  # of the reference
    interval_ms: float = Field(50.0, gt=0)  # from step to step; ends with an electrical period
    K_p_NmpV: float = Field(1.0, gt=0)  # actuator = "torque"
    K_i_NmpVs: float = Field(50.0, ge=0)
    K_p_rpmpV: float = Field(5.0, gt=0)  # actuator = "speed"
    K_i_rpmpVs: float = Field(200.0, ge=0)
    notch_damping: float = Field(0.02, ge=0, le=0.2)  # at the stroke frequency; 0: no notch
    acceleration_rpmps: float = Field(1000.0, gt=0)  # of the start ramp
    u_full_V: float | None = Field(None, gt=0)  # torque folds back below
    u_stop_V: float | None = Field(None, gt=0)  # to none here
    u_wake_V: float | None = Field(None, gt=0)
    wake_s: float = Field(1.0, ge=0)  # above u_wake_V before a start
    p_sleep_W: float = Field(0.0, ge=0)
    sleep_s: float = Field(60.0, gt=0)  # below p_sleep_W before a stop
    k_dry_Nms2: float = Field(0.0, ge=0)  # dry: torque below k_dry omega^2; 0: not watched
    dry_speed_rpm: float | None = Field(None, gt=0)  # above this speed
    dry_s: float = Field(5.0, gt=0)  # for so long
    rest_s: float = Field(600.0, gt=0)  # before the next try

    @model_validator(mode="after")
    def gains_belong_to_the_actuator(self) -> PvControl:
        other = (
            ("K_p_rpmpV", "K_i_rpmpVs") if self.actuator == "torque" else ("K_p_NmpV", "K_i_NmpVs")
        )
        for key in other:
            if key in self.model_fields_set:
                raise ValueError(
                    f"{key} has no effect with actuator = {self.actuator!r}; remove it"
                )
        return self

    def core(
        self,
        *,
        u_dc: float,
        C: float,
        omega_most: float,
        strokes: int,
        T_s: float,
        delay: int,
    ) -> _core.PvControl:
        """The core's part.

        Parameters
        ----------
        u_dc : float
            Nominal dc-link voltage [V].
        C : float
            Of the dc link [F].
        omega_most : float
            Greatest speed [rad/s].
        strokes : int
            Of a revolution.
        T_s, delay
            Control period [s], samples from measurement to effect.
        """
        values = self.si
        by_torque = self.actuator == "torque"
        interval = values["interval"]
        return _core.PvControl(
            actuator=getattr(_core.Actuator, self.actuator),
            current=getattr(_core.ArrayCurrent, self.current),
            link=_core.LimitedPi(
                K_p=self.K_p_NmpV if by_torque else to_si(self.K_p_rpmpV, "rpmpV"),
                K_iT=T_s * (self.K_i_NmpVs if by_torque else to_si(self.K_i_rpmpVs, "rpmpVs")),
            ),
            tracker=_core.PowerTracker(
                method=getattr(_core.Tracking, self.tracking),
                u_start=_given(self.u_ref_V, u_dc),
                u_min=_given(self.u_ref_min_V, LOWEST * u_dc),
                u_max=_given(self.u_ref_max_V, HIGHEST * u_dc),
                step=self.step_V,
            ),
            mean=_core.WholePeriods(
                T_s=T_s,
                t_settle=SETTLE * interval,
                t_least=(1 - SETTLE) * interval,
                t_most=LONGEST * interval,
            ),
            ripple=_core.StrokeRipple(learning=2 * self.notch_damping * strokes * T_s),
            C=C,
            delay=delay,
            acceleration=values["acceleration"],
            omega_lead=LEAD * omega_most,
            u_stop=_given(self.u_stop_V, STOP * u_dc),
            u_full=_given(self.u_full_V, FULL * u_dc),
            u_wake=_given(self.u_wake_V, WAKES * u_dc),
            t_wake=self.wake_s,
            p_sleep=self.p_sleep_W,
            t_sleep=self.sleep_s,
            k_dry=self.k_dry_Nms2,
            omega_dry=values["dry_speed"] or DRY_SPEED * omega_most,
            t_dry=self.dry_s,
            t_rest=self.rest_s,
        )

    def check(self, u_dc: float) -> None:
        """Voltages in their order, at the nominal dc-link voltage [V].

        Raises
        ------
        ParameterError
            If they are not.
        """
        stop, full = _given(self.u_stop_V, STOP * u_dc), _given(self.u_full_V, FULL * u_dc)
        least = _given(self.u_ref_min_V, LOWEST * u_dc)
        most = _given(self.u_ref_max_V, HIGHEST * u_dc)
        start = _given(self.u_ref_V, u_dc)
        if not stop < full <= least <= start <= most:
            raise ParameterError(
                f"[pv_control] u_stop_V = {stop:g}, u_full_V = {full:g}, u_ref_min_V = {least:g}, "
                f"u_ref_V = {start:g}, u_ref_max_V = {most:g}: need rising voltages"
            )


def _given(value: float | None, default: float) -> float:
    return default if value is None else value
