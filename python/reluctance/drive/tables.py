"""The tables of a drive file: converter, load, reference, sensing, simulation."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from reluctance.drive.loss_data import SwitchingEnergies
from reluctance.drive.schema import Section
from reluctance.units import to_si


class Converter(SwitchingEnergies):
    """Asymmetric half bridges on a stiff dc link, with the drops of switches and diodes, and the
    energies of switching."""

    u_dc_V: float = Field(gt=0)
    v_switch_V: float = Field(0.0, ge=0)
    R_switch_ohm: float = Field(0.0, ge=0)
    v_diode_V: float = Field(0.0, ge=0)
    R_diode_ohm: float = Field(0.0, ge=0)
    dead_time_us: float = Field(0.0, ge=0)  # a switch turns on this much later than ordered

    @property
    def t_dead(self) -> float:
        """From the order to turn on until a switch is on [s]."""
        return to_si(self.dead_time_us, "us")


class Load(Section):
    """What is on the shaft. `speed_rpm` is held by a locked shaft and starts the others."""

    kind: Literal["locked", "pump", "torque"]
    speed_rpm: float = Field(0.0, ge=-1e6, le=1e6)
    J_kgm2: float = Field(0.0, ge=0)  # beside the rotor's
    k_pump_Nms2: float = Field(0.0, ge=0)  # pump torque k omega^2
    tau_Nm: float = 0.0  # constant torque against positive rotation

    @model_validator(mode="after")
    def numbers_belong_to_the_kind(self) -> Load:
        if self.kind == "pump" and self.k_pump_Nms2 == 0:
            raise ValueError("kind = 'pump' needs k_pump_Nms2 > 0")
        if self.kind != "pump" and self.k_pump_Nms2 != 0:
            raise ValueError(f"k_pump_Nms2 has no effect with kind = {self.kind!r}; remove it")
        if self.kind != "torque" and self.tau_Nm != 0:
            raise ValueError(f"tau_Nm has no effect with kind = {self.kind!r}; remove it")
        return self


class Reference(Section):
    """What the drive is asked for: a constant, or points over time joined by lines."""

    kind: Literal["torque", "speed", "none"]  # none: the law fixes its current itself
    tau_Nm: float | None = None
    speed_rpm: float | None = None
    t_s: list[float] = Field(default_factory=list)  # with `values`: a course over time
    values: list[float] = Field(default_factory=list)  # in N m or rpm, as `kind` says

    @model_validator(mode="after")
    def has_one_meaning(self) -> Reference:
        if self.kind == "none":
            for key in sorted(self.model_fields_set - {"kind"}):
                raise ValueError(f"{key} has no effect with kind = 'none'; remove it")
            return self
        constant = self.tau_Nm if self.kind == "torque" else self.speed_rpm
        other = self.speed_rpm if self.kind == "torque" else self.tau_Nm
        key = "tau_Nm" if self.kind == "torque" else "speed_rpm"
        if other is not None:
            raise ValueError(f"kind = {self.kind!r} takes {key}; remove the other")
        if (constant is None) == (not self.values):
            raise ValueError(f"need either {key} or t_s and values")
        if len(self.t_s) != len(self.values):
            raise ValueError(f"t_s has {len(self.t_s)} points, values {len(self.values)}")
        if any(b < a for a, b in zip(self.t_s, self.t_s[1:], strict=False)):
            raise ValueError(f"t_s = {self.t_s}, need rising times")
        return self

    @property
    def course(self) -> tuple[list[float], list[float]]:
        """Times [s] and references [N m or rad/s]; zero where there is none."""
        if self.kind == "none":
            return [0.0], [0.0]
        constant = self.tau_Nm if self.kind == "torque" else self.speed_rpm
        t_s, values = (self.t_s, self.values) if constant is None else ([0.0], [constant])
        unit = "Nm" if self.kind == "torque" else "rpm"
        return t_s, [to_si(value, unit) for value in values]


class Sensing(Section):
    """Sensors, computing time, and who compares currents. Zero bits or counts mean ideal."""

    delay_samples: int = Field(0, ge=0, le=1)
    adc_bits: int = Field(0, ge=0, le=24)
    i_range_A: float = Field(0.0, ge=0)  # full scale of the current converter
    encoder_counts: int = Field(0, ge=0)  # per revolution
    tracker_bandwidth_Hz: float = Field(80.0, gt=0)  # of the observer on a counted angle
    comparators: Literal["analog", "sampled"] = "analog"  # at any instant; or at the samples only

    @property
    def tracker_bandwidth(self) -> float:
        """Of the observer on a counted angle; 0 with an ideal sensor [rad/s]."""
        return 2 * np.pi * self.tracker_bandwidth_Hz if self.encoder_counts > 0 else 0.0

    @model_validator(mode="after")
    def converter_has_a_range(self) -> Sensing:
        if self.adc_bits > 0 and self.i_range_A == 0:
            raise ValueError(f"adc_bits = {self.adc_bits} needs i_range_A > 0")
        return self


class SimulationSettings(Section):
    """How long, how fine."""

    until_s: float = Field(gt=0)
    dt_max_us: float = Field(10.0, gt=0)  # largest integration step
    theta_start_deg: float = 0.0  # mechanical rotor angle at the start
