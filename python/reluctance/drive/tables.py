"""The tables of a drive file: converter, source, load, reference, sensing, simulation."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from pydantic import Field, model_validator

from reluctance.drive.loss_data import SwitchingEnergies
from reluctance.drive.schema import Section
from reluctance.units import to_si


class OverTime(Section):
    """A quantity over time: points joined by lines, held before the first and after the last. Two
    points at the same time make a step."""

    t_s: list[float] = Field(default_factory=list)
    values: list[float] = Field(default_factory=list)  # as many, in the unit that the table says

    @model_validator(mode="after")
    def points_have_rising_times(self) -> OverTime:
        if len(self.t_s) != len(self.values):
            raise ValueError(f"t_s has {len(self.t_s)} points, values {len(self.values)}")
        if any(b < a for a, b in zip(self.t_s, self.t_s[1:], strict=False)):
            raise ValueError(f"t_s = {self.t_s}, need rising times")
        return self

    def points(self, otherwise: float, unit: str | None = None) -> tuple[list[float], list[float]]:
        """Times [s] and values in SI; the constant where no points are given."""
        if not self.values:
            return [0.0], [otherwise]
        return self.t_s, [to_si(value, unit) for value in self.values]


class Converter(SwitchingEnergies):
    """Power converter: the drops of switches and diodes, and the energies of switching."""

    bridge: Literal["asymmetric", "shared_switch"] = "asymmetric"
    u_dc_V: float = Field(gt=0)  # nominal dc-link voltage; [source] says what feeds it
    v_switch_V: float = Field(0.0, ge=0)
    R_switch_ohm: float = Field(0.0, ge=0)
    v_diode_V: float = Field(0.0, ge=0)
    R_diode_ohm: float = Field(0.0, ge=0)
    dead_time_us: float = Field(0.0, ge=0)  # a switch turns on this much later than ordered

    @property
    def t_dead(self) -> float:
        """From the order to turn on until a switch is on [s]."""
        return to_si(self.dead_time_us, "us")


class Source(OverTime):
    """What feeds the dc link. Its voltage is the nominal one of [converter], or a course in V."""

    kind: Literal["stiff", "battery"] = "stiff"
    R_ohm: float | None = Field(None, gt=0)  # battery: of the battery and its cable
    C_uF: float | None = Field(None, ge=20)  # battery: dc-link capacitor
    one_way: bool = False  # battery: a rectifier, which takes no energy back

    @model_validator(mode="after")
    def numbers_belong_to_the_kind(self) -> Source:
        for key in ("R_ohm", "C_uF"):
            if self.kind == "battery" and getattr(self, key) is None:
                raise ValueError(f"kind = 'battery' needs {key}")
            if self.kind == "stiff" and getattr(self, key) is not None:
                raise ValueError(f"{key} has no effect with kind = 'stiff'; remove it")
        if self.kind == "stiff" and self.one_way:
            raise ValueError("one_way has no effect with kind = 'stiff'; remove it")
        if any(u <= 0 for u in self.values):
            raise ValueError(f"values = {self.values}, need voltages > 0")
        return self


class Load(OverTime):
    """What is on the shaft. `speed_rpm` is held by a locked shaft and starts the others. The course
    over time is the held speed in rpm, or the torque in N m."""

    kind: Literal["locked", "pump", "fan", "torque"]
    speed_rpm: float = Field(0.0, ge=-1e6, le=1e6)
    J_kgm2: float = Field(0.0, ge=0)  # in addition to the rotor's
    k_pump_Nms2: float = Field(0.0, ge=0)  # pump torque k omega^2
    k_fan_Nms2: float = Field(0.0, ge=0)  # fan torque k omega |omega|
    tau_Nm: float = 0.0  # constant torque against positive rotation

    @model_validator(mode="after")
    def numbers_belong_to_the_kind(self) -> Load:
        for kind in ("pump", "fan"):
            key = f"k_{kind}_Nms2"
            if self.kind == kind and getattr(self, key) == 0:
                raise ValueError(f"kind = {kind!r} needs {key} > 0")
            if self.kind != kind and getattr(self, key) != 0:
                raise ValueError(f"{key} has no effect with kind = {self.kind!r}; remove it")
        if self.kind != "torque" and self.tau_Nm != 0:
            raise ValueError(f"tau_Nm has no effect with kind = {self.kind!r}; remove it")
        if self.values and self.kind not in ("locked", "torque"):
            raise ValueError(f"values have no effect with kind = {self.kind!r}; remove them")
        constant = "speed_rpm" if self.kind == "locked" else "tau_Nm"
        if self.values and getattr(self, constant) != 0:
            raise ValueError(f"need either {constant} or t_s and values")
        return self

    @property
    def k(self) -> float:
        """Of the torque k omega |omega| of a pump or fan [N m s^2]."""
        return self.k_pump_Nms2 + self.k_fan_Nms2

    def torque(self, omega_m: float) -> float:
        """Greatest load torque at a speed [N m]."""
        return self.k * omega_m * abs(omega_m) + max(self.tau_0[1], key=abs)

    @property
    def omega(self) -> tuple[list[float], list[float]]:
        """Times [s] and speeds [rad/s]: held by a locked shaft, else the one at the start."""
        start = to_si(self.speed_rpm, "rpm")
        return self.points(start, "rpm") if self.kind == "locked" else ([0.0], [start])

    @property
    def tau_0(self) -> tuple[list[float], list[float]]:
        """Times [s] and load torques that do not depend on the speed [N m]."""
        return self.points(self.tau_Nm) if self.kind == "torque" else ([0.0], [0.0])


class Reference(OverTime):
    """What the drive is asked for: a constant, or a course in N m or rpm, as `kind` says."""

    kind: Literal["torque", "speed", "none"]  # none: the law fixes its current itself
    tau_Nm: float | None = None
    speed_rpm: float | None = None

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
            wrong = "speed_rpm" if self.kind == "torque" else "tau_Nm"
            raise ValueError(f"kind = {self.kind!r} takes {key}; remove {wrong}")
        if (constant is None) == (not self.values):
            raise ValueError(f"need either {key} or t_s and values")
        return self

    @property
    def course(self) -> tuple[list[float], list[float]]:
        """Times [s] and references [N m or rad/s]; 1, to motor, for a law with its own current."""
        if self.kind == "none":
            return [0.0], [1.0]
        unit = None if self.kind == "torque" else "rpm"
        constant = self.tau_Nm if self.kind == "torque" else self.speed_rpm
        return self.points(to_si(constant or 0.0, unit), unit)


class Sensing(Section):
    """Sensors, computing time, and who compares currents. Zero bits or counts mean ideal."""

    delay_samples: int = Field(0, ge=0, le=1)
    adc_bits: int = Field(0, ge=0, le=24)
    i_range_A: float = Field(0.0, ge=0)  # full scale of the current converter
    encoder_counts: int = Field(0, ge=0)  # per revolution
    tracker_bandwidth_Hz: float = Field(80.0, gt=0)  # of the observer on a counted angle
    comparators: Literal["analog", "sampled"] = "analog"  # at any instant; or at the samples only

    @property
    def sampling(self) -> dict[str, Any]:
        """What the core is told of the sensors, in SI."""
        return {
            "delay": self.delay_samples,
            "adc_bits": self.adc_bits,
            "i_range": self.i_range_A,
            "encoder_counts": self.encoder_counts,
        }

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
    dt_max_us: float = Field(10.0, gt=0, le=1000)  # largest integration step
    theta_start_deg: float = 0.0  # mechanical rotor angle at the start
