"""The [pv_control] table: voltage control and power tracking of a drive on an array."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.base.schema import Section
from reluctance.base.units import to_si

LOWEST, HIGHEST = 0.6, 1.3  # of the nominal dc-link voltage: default limits of the reference
FULL, STOP = 0.55, 0.45  # torque is whole above, none below
WAKES = 0.7
LEAD = 0.05  # of the greatest speed: the start ramp is never further ahead of the speed
SETTLE = 0.4  # of the tracking interval: left out of the means
LONGEST = 4.0  # tracking intervals that a mean may take where the rotor creeps
# Gains in per unit of the greatest torque or speed and of the nominal dc-link voltage: 1 N m/V and
# 50 N m/(V s), or 5 rpm/V and 200 rpm/(V s), at 240 V, 55 N m and 1700 rpm, where they were found
# (examples/sun_cloud.toml). tests/drive/test_pv_per_unit.py has drives of three sizes on this
# one set.
K_P_TORQUE, K_I_TORQUE = 240 / 55, 50 * 240 / 55  # [1], [1/s]
K_P_SPEED, K_I_SPEED = 5 * 240 / 1700, 200 * 240 / 1700  # [1], [1/s]
STEP = 1 / 120  # of the nominal voltage
DRY_SPEED = 0.7  # of the greatest speed: below it nothing tells a dry pump


class PvControl(Section):
    """Voltages that are left out follow from the nominal dc-link voltage of [converter], gains also
    from the greatest torque or speed."""

    called = "pv_control"

    tracking: Literal["perturb_observe", "incremental_conductance", "constant"] = "perturb_observe"
    actuator: Literal["torque", "speed"] = "torque"  # what the voltage controller moves
    current: Literal["sensor", "legs"] = "sensor"  # of the array; legs: from phase currents
    u_ref_V: float | None = Field(None, gt=0)  # at the start, or throughout
    u_ref_min_V: float | None = Field(None, gt=0)
    u_ref_max_V: float | None = Field(None, gt=0)
    step_V: float | None = Field(None, gt=0)  # of the reference; by default 1/120 of the nominal
    interval_ms: float = Field(50.0, gt=0)  # from step to step; ends with an electrical period
    K_p_NmpV: float | None = Field(None, gt=0)  # actuator = "torque"; by default per unit
    K_i_NmpVs: float | None = Field(None, ge=0)
    K_p_rpmpV: float | None = Field(None, gt=0)  # actuator = "speed"; by default per unit
    K_i_rpmpVs: float | None = Field(None, ge=0)
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
        tau_max: float,
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
        tau_max : float
            Greatest torque [N m].
        omega_most : float
            Greatest speed [rad/s].
        strokes : int
            Of a revolution.
        T_s, delay
            Control period [s], samples from measurement to effect.
        """
        values, u = self.si, self.voltages(u_dc)
        interval = values["interval"]
        return _core.PvControl(
            actuator=getattr(_core.Actuator, self.actuator),
            current=getattr(_core.ArrayCurrent, self.current),
            link=self._link(T_s, tau_max / u_dc, omega_most / u_dc),
            tracker=_core.PowerTracker(
                method=getattr(_core.Tracking, self.tracking),
                u_start=u["u_ref"],
                u_min=u["u_ref_min"],
                u_max=u["u_ref_max"],
                step=_given(self.step_V, STEP * u_dc),
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
            u_stop=u["u_stop"],
            u_full=u["u_full"],
            u_wake=u["u_wake"],
            t_wake=self.wake_s,
            p_sleep=self.p_sleep_W,
            t_sleep=self.sleep_s,
            k_dry=self.k_dry_Nms2,
            omega_dry=values["dry_speed"] or DRY_SPEED * omega_most,
            t_dry=self.dry_s,
            t_rest=self.rest_s,
        )

    def _link(self, T_s: float, torque_per_V: float, speed_per_V: float) -> _core.LimitedPi:
        """The voltage controller: gains as given, else in per unit of these."""
        if self.actuator == "torque":
            K_p = _given(self.K_p_NmpV, K_P_TORQUE * torque_per_V)
            return _core.LimitedPi(
                K_p=K_p, K_iT=T_s * _given(self.K_i_NmpVs, K_I_TORQUE * torque_per_V)
            )
        K_p, K_i = (
            default * speed_per_V if given is None else to_si(given, unit)
            for given, unit, default in (
                (self.K_p_rpmpV, "rpmpV", K_P_SPEED),
                (self.K_i_rpmpVs, "rpmpVs", K_I_SPEED),
            )
        )
        return _core.LimitedPi(K_p=K_p, K_iT=T_s * K_i)

    def voltages(self, u_dc: float) -> dict[str, float]:
        """Voltages of the controller at the nominal dc-link voltage [V]."""
        return {
            "u_stop": _given(self.u_stop_V, STOP * u_dc),
            "u_full": _given(self.u_full_V, FULL * u_dc),
            "u_ref_min": _given(self.u_ref_min_V, LOWEST * u_dc),
            "u_ref": _given(self.u_ref_V, u_dc),
            "u_ref_max": _given(self.u_ref_max_V, HIGHEST * u_dc),
            "u_wake": _given(self.u_wake_V, WAKES * u_dc),
        }

    def check(self, u_dc: float) -> None:
        """Voltages in their order, at the nominal dc-link voltage [V].

        Raises
        ------
        ParameterError
            If they are not.
        """
        u = self.voltages(u_dc)
        if not u["u_stop"] < u["u_full"] <= u["u_ref_min"] <= u["u_ref"] <= u["u_ref_max"]:
            told = ", ".join(f"{k}_V = {v:g}" for k, v in u.items() if k != "u_wake")
            raise ParameterError(f"[pv_control] {told}: need rising voltages")


def _given(value: float | None, default: float) -> float:
    return default if value is None else value
