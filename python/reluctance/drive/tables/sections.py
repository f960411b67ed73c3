"""The tables of a drive file: converter, reference, sensing, simulation."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from reluctance import _core
from reluctance.base.schema import Section
from reluctance.base.units import to_si
from reluctance.drive.tables.over_time import OverTime
from reluctance.machine.loss_data import SwitchingEnergies

MOST_PHASES = 6


class Converter(SwitchingEnergies):
    """Power converter: the drops of switches and diodes, and the energies of switching."""

    bridge: Literal["asymmetric", "shared_switch"] = "asymmetric"
    u_dc_V: float = Field(gt=0)  # nominal dc-link voltage; [source] says what feeds it
    v_switch_V: float = Field(0.0, ge=0)
    R_switch_ohm: float = Field(0.0, ge=0)
    v_diode_V: float = Field(0.0, ge=0)
    R_diode_ohm: float = Field(0.0, ge=0)
    u_rating_V: float | None = Field(None, gt=0)  # that the switches stand, margin included
    dead_time_us: float = Field(0.0, ge=0)  # a switch turns on this much later than ordered
    min_pulse_us: float = Field(0.0, ge=0)  # no switch is on or off for less

    def core(self) -> _core.AsymmetricBridge | _core.SharedSwitchBridge:
        """The core's part."""
        devices = _core.Devices(
            v_switch=self.v_switch_V,
            R_switch=self.R_switch_ohm,
            v_diode=self.v_diode_V,
            R_diode=self.R_diode_ohm,
        )
        if self.bridge == "asymmetric":
            return _core.AsymmetricBridge(device=devices)
        return _core.SharedSwitchBridge(device=devices)

    @property
    def has_drops(self) -> bool:
        """Whether it has data of the conduction loss of switches and diodes."""
        return any((self.v_switch_V, self.R_switch_ohm, self.v_diode_V, self.R_diode_ohm))

    @property
    def t_dead(self) -> float:
        """From the order to turn on until a switch is on [s]."""
        return to_si(self.dead_time_us, "us")

    @property
    def t_min(self) -> float:
        """The shortest leg state that is ordered [s]: a switch is on for less by the dead time."""
        return to_si(self.min_pulse_us, "us") + self.t_dead if self.min_pulse_us else 0.0


class Reference(OverTime):
    """What the drive is asked for: a constant, or a course in N m or rpm, as `kind` says."""

    # none: the law fixes its current itself; pv: all that the array gives, up to a greatest speed
    kind: Literal["torque", "speed", "none", "pv"]
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
        if constant is not None and self.values:
            raise ValueError(
                f"{key} and values exclude each other; remove one: --set reference.{key}= does"
            )
        if constant is None and not self.values:
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
    """Sensors, computing time, and who compares currents. Zero bits, counts, noise and offsets mean
    ideal."""

    delay_samples: int = Field(0, ge=0, le=1)
    adc_bits: int = Field(0, ge=0, le=24)
    i_range_A: float = Field(0.0, ge=0)  # full scale of the current converter
    i_noise_LSB: float = Field(0.0, ge=0)  # rms, in steps of the current converter
    i_offset_A: list[float] = Field(default_factory=list)  # of each phase's sensor
    i_gain: list[Annotated[float, Field(gt=0)]] = Field(default_factory=list)  # shown over true
    u_dc_noise_V: float = Field(0.0, ge=0)  # rms
    noise_seed: int = Field(1, ge=0, le=2**31 - 1)
    encoder_counts: int = Field(0, ge=0, le=2**30)  # per revolution
    encoder_index: bool = False  # it counts from where it is switched on, until its index passes
    hall: bool = False  # one Hall sensor a phase
    hall_error_deg: float = Field(0.0, ge=-10, le=10)  # electrical: of the place of their edges
    tracker_bandwidth_Hz: float | None = Field(None, gt=0)  # of the observer on a counted angle
    # at any instant; at the samples only; at any instant with a lower and an upper threshold only
    comparators: Literal["analog", "sampled", "two_level"] = "analog"
    blank_us: float = Field(0.0, ge=0)  # before a sample, without edges of timer orders

    def core(self, *, T_s: float, N_r: int, angle_offset: float = 0.0) -> _core.Sampling:
        """The core's part. T_s: control period [s]; N_r: rotor poles; angle_offset: what the angle
        sensor shows less the true angle, electrical [rad]."""
        return _core.Sampling(
            T_s=T_s,
            delay=self.delay_samples,
            adc_bits=self.adc_bits,
            i_range=self.i_range_A,
            i_noise=self.i_noise,
            i_offset=padded(self.i_offset_A, 0.0),
            i_gain=padded(self.i_gain, 1.0),
            u_noise=self.u_dc_noise_V,
            seed=self.noise_seed,
            rotor=_core.RotorSensor(
                counts=self.encoder_counts,
                index=self.encoder_index,
                hall=self.hall,
                hall_error=to_si(self.hall_error_deg, "deg") / N_r,
            ),
            angle_offset=angle_offset,
        )

    @property
    def has_errors(self) -> bool:
        """Whether a current sensor has an offset or a gain."""
        return any(self.i_offset_A) or any(gain != 1 for gain in self.i_gain)

    @property
    def i_step(self) -> float:
        """One step of the current converter; 0 of an ideal one [A]."""
        return self.i_range_A / 2**self.adc_bits if self.adc_bits > 0 else 0.0

    @property
    def t_blank(self) -> float:
        """Before a sample, without edges of timer orders [s]."""
        return to_si(self.blank_us, "us")

    @property
    def i_noise(self) -> float:
        """Noise of the currents, rms [A]."""
        return self.i_noise_LSB * self.i_step

    def angle_step(self, n_phases: int, N_r: int) -> float:
        """Of the angle, mechanical; 0 with an ideal sensor [rad]."""
        if self.encoder_counts > 0:
            return 2 * np.pi / self.encoder_counts
        return np.pi / (n_phases * N_r) if self.hall else 0.0

    @property
    def counted_angle(self) -> bool:
        """True where the angle comes in steps, and an observer tracks it."""
        return self.encoder_counts > 0 or self.hall

    @property
    def tracker_bandwidth(self) -> float | None:
        """Of the observer, where it is given [rad/s]."""
        given = self.tracker_bandwidth_Hz
        return None if given is None else 2 * np.pi * given

    @model_validator(mode="after")
    def keys_belong_together(self) -> Sensing:
        if self.adc_bits > 0 and self.i_range_A == 0:
            raise ValueError(f"adc_bits = {self.adc_bits} needs i_range_A > 0")
        if self.i_noise_LSB > 0 and self.adc_bits == 0:
            raise ValueError(f"i_noise_LSB = {self.i_noise_LSB:g} needs adc_bits > 0")
        if self.encoder_index and not (self.hall and self.encoder_counts > 0):
            raise ValueError(
                "encoder_index needs encoder_counts > 0 and hall = true: until the index passes, "
                "nothing else knows the angle"
            )
        if self.hall and self.encoder_counts > 0 and not self.encoder_index:
            raise ValueError(
                "hall has no effect with an encoder that knows its zero; set encoder_index = true "
                "or remove it"
            )
        if self.hall_error_deg != 0 and not self.hall:
            raise ValueError("hall_error_deg has no effect without hall = true; remove it")
        return self


def padded(values: list[float], otherwise: float) -> list[float]:
    """Values of the phases as the core takes them: for as many phases as a machine can have."""
    return [*values, *[otherwise] * (MOST_PHASES - len(values))]


class SimulationSettings(Section):
    """How long, how fine."""

    called = "simulation"

    until_s: float = Field(0.1, gt=0)
    dt_max_us: float = Field(20.0, gt=0, le=1000)  # largest integration step
    theta_start_deg: float = 0.0  # mechanical rotor angle at the start
