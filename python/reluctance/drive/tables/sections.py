"""The tables of a drive file: converter, source, load, reference, sensing, simulation."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from reluctance import _core
from reluctance.base.schema import Section
from reluctance.base.units import to_si
from reluctance.machine.loss_data import SwitchingEnergies
from reluctance.plant.hydraulics.pump import Pump, PumpName
from reluctance.plant.solar.datasheet import Datasheet
from reluctance.plant.solar.pv_module import CellNumbers, check_one_module
from reluctance.plant.solar.single_diode import MOST_MODULES

MOST_PHASES = 6


class OverTime(Section):
    """A quantity over time: points joined by lines, held before the first and after the last. Two
    points at the same time make a step."""

    t_s: list[float] = Field(default_factory=list)
    values: list[float] = Field(default_factory=list)  # as many, in the unit that the table says

    @model_validator(mode="after")
    def points_have_rising_times(self) -> OverTime:
        for key, values in self.over_time().items():
            if len(self.t_s) != len(values):
                raise ValueError(f"t_s has {len(self.t_s)} points, {key} {len(values)}")
        if any(b < a for a, b in zip(self.t_s, self.t_s[1:], strict=False)):
            raise ValueError(f"t_s = {self.t_s}, need rising times")
        return self

    def over_time(self) -> dict[str, list[float]]:
        """The lists that have a value for each time."""
        return {"values": self.values}

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
    u_rating_V: float | None = Field(None, gt=0)  # that the switches stand, margin included
    dead_time_us: float = Field(0.0, ge=0)  # a switch turns on this much later than ordered
    min_pulse_us: float = Field(0.0, ge=0)  # no shorter leg state is ordered

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
        """The shortest leg state that is ordered [s]."""
        return to_si(self.min_pulse_us, "us")


FASTEST_us = 0.5  # time constant of battery and capacitor: a shorter one makes the steps short


class Source(OverTime):
    """What feeds the dc link. A stiff one and a battery have the nominal voltage of [converter], or
    a course in V; an array has irradiance and cell temperature at the times t_s."""

    kind: Literal["stiff", "battery", "pv"] = "stiff"
    R_ohm: float | None = Field(None, gt=0)  # battery: of the battery and its cable
    C_uF: float | None = Field(None, ge=20)  # battery, pv: dc-link capacitor
    one_way: bool = False  # battery: a rectifier, which takes no energy back
    module: str | None = None  # pv: a name of the CEC table
    datasheet: Datasheet | None = None  # pv: or a module by what its maker prints
    cell: CellNumbers | None = None  # pv: or by the numbers of its diode
    n_series: int | None = Field(None, ge=1, le=MOST_MODULES)  # pv: modules
    n_parallel: int | None = Field(None, ge=1, le=MOST_MODULES)
    poa_global_Wpm2: list[float] | None = Field(None, min_length=1)  # pv: irradiance
    temp_cell_degC: list[float] | None = Field(None, min_length=1)  # pv
    blocking_diode_V: float = Field(0.0, ge=0)  # pv: while it conducts
    temp_cold_degC: float = Field(-10.0, gt=-60, lt=60)  # pv: coldest cell in full sun

    @model_validator(mode="after")
    def numbers_belong_to_the_kind(self) -> Source:
        given = self.model_fields_set - {"kind"}
        for key in sorted(given - KEYS_OF_SOURCE[self.kind]):
            raise ValueError(f"{key} has no effect with kind = {self.kind!r}; remove it")
        for key in NEEDED_OF_SOURCE[self.kind]:
            if getattr(self, key) is None:
                raise ValueError(f"kind = {self.kind!r} needs {key}")
        if any(u <= 0 for u in self.values):
            raise ValueError(f"values = {self.values}, need voltages > 0")
        if self.kind == "battery" and (self.R_ohm or 0) * (self.C_uF or 0) < FASTEST_us:
            raise ValueError(
                f"R_ohm = {self.R_ohm:g} and C_uF = {self.C_uF:g} equalise in less than "
                f"{FASTEST_us:g} us, need R_ohm >= {FASTEST_us / (self.C_uF or 1):.3g}, or "
                "kind = 'stiff'"
            )
        return self

    @model_validator(mode="after")
    def array_is_one_in_the_light(self) -> Source:
        if self.kind != "pv":
            return self
        check_one_module(self.module, self.datasheet, self.cell, "source")
        sun, heat = self.poa_global_Wpm2 or [], self.temp_cell_degC or []
        if not all(0 <= G <= 2000 for G in sun):
            raise ValueError(f"poa_global_Wpm2 = {sun}, need 0 to 2000")
        if max(sun) == 0:
            raise ValueError("poa_global_Wpm2 is 0 throughout: night only, no pump would start")
        if not all(-60 < T < 120 for T in heat):
            raise ValueError(f"temp_cell_degC = {heat}, need -60 to 120")
        return self

    def over_time(self) -> dict[str, list[float]]:
        if self.kind != "pv":
            return super().over_time()
        return {
            "poa_global_Wpm2": self.poa_global_Wpm2 or [],
            "temp_cell_degC": self.temp_cell_degC or [],
        }


NEEDED_OF_SOURCE = {
    "stiff": (),
    "battery": ("R_ohm", "C_uF"),
    "pv": ("t_s", "C_uF", "n_series", "n_parallel", "poa_global_Wpm2", "temp_cell_degC"),
}
KEYS_OF_SOURCE = {
    "stiff": {"t_s", "values"},
    "battery": {"t_s", "values", "R_ohm", "C_uF", "one_way"},
    "pv": {
        *("t_s", "module", "datasheet", "cell", "n_series", "n_parallel", "C_uF"),
        *("poa_global_Wpm2", "temp_cell_degC", "blocking_diode_V", "temp_cold_degC"),
    },
}


class Load(OverTime):
    """What is on the shaft. `speed_rpm` is held by a locked shaft and starts the others. The course
    over time is the held speed in rpm, the torque in N m, or the static head in m."""

    kind: Literal["locked", "pump", "fan", "torque"]
    speed_rpm: float = Field(0.0, ge=-1e6, le=1e6)
    J_kgm2: float = Field(0.0, ge=0)  # in addition to the rotor's
    k_pump_Nms2: float = Field(0.0, ge=0)  # pump torque k omega^2, or
    pump: PumpName | Pump | None = None  # of the library, the path of a file, or its table
    H_static_m: float | None = Field(None, ge=0)  # from the water level to the outlet
    H_dry_m: float | None = Field(None, gt=0)  # from here on the level is below the intake
    dry_part: float = Field(0.1, gt=0, lt=1)  # of the torque without flow: without water
    L_m: float = Field(0.0, ge=0)  # pipe
    D_mm: float | None = Field(None, gt=0)
    roughness_mm: float = Field(0.05, ge=0)
    K: float = Field(0.0, ge=0)  # sum of the minor loss coefficients
    k_fan_Nms2: float = Field(0.0, ge=0)  # fan torque k omega |omega|
    tau_Nm: float = 0.0  # constant torque against positive rotation

    @model_validator(mode="after")
    def numbers_belong_to_the_kind(self) -> Load:
        hydraulic = {
            "pump",
            "H_static_m",
            "H_dry_m",
            "dry_part",
            "L_m",
            "D_mm",
            "roughness_mm",
            "K",
        }
        for key in sorted(self.model_fields_set & hydraulic):
            if self.kind != "pump":
                raise ValueError(f"{key} has no effect with kind = {self.kind!r}; remove it")
            if self.pump is None:
                raise ValueError(
                    f"{key} has no effect without `pump`, a pump of the library or a file"
                )
        for kind in ("pump", "fan"):
            key = f"k_{kind}_Nms2"
            if self.kind == kind and getattr(self, key) == 0 and self.pump is None:
                raise ValueError(f"kind = {kind!r} needs {key} > 0")
            if self.kind != kind and getattr(self, key) != 0:
                raise ValueError(f"{key} has no effect with kind = {self.kind!r}; remove it")
        if self.pump is not None and self.k_pump_Nms2 != 0:
            raise ValueError("need either k_pump_Nms2 or pump")
        if self.pump is not None and self.D_mm is None:
            raise ValueError("pump needs D_mm, the inner diameter of its pipe")
        if self.kind != "torque" and self.tau_Nm != 0:
            raise ValueError(f"tau_Nm has no effect with kind = {self.kind!r}; remove it")
        if self.values and self.kind not in ("locked", "torque") and self.pump is None:
            raise ValueError(f"values have no effect with kind = {self.kind!r}; remove them")
        constant = {"locked": "speed_rpm", "torque": "tau_Nm"}.get(self.kind, "H_static_m")
        if self.values and getattr(self, constant):
            raise ValueError(f"need either {constant} or t_s and values")
        if self.pump is not None and not self.values and self.H_static_m is None:
            raise ValueError("pump needs H_static_m, or t_s and values")
        if self.pump is not None and any(H < 0 for H in self.values):
            raise ValueError(f"values = {self.values}, need static heads >= 0")
        return self

    @property
    def H_static(self) -> tuple[list[float], list[float]]:
        """Times [s] and static heads of a pump [m]."""
        return self.points(self.H_static_m or 0.0) if self.pump is not None else ([0.0], [0.0])

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

    def sampling(self, N_r: int) -> dict[str, Any]:
        """What the core is told of the sensors, in SI. N_r: rotor poles."""
        return {
            "delay": self.delay_samples,
            "adc_bits": self.adc_bits,
            "i_range": self.i_range_A,
            "i_noise": self.i_noise,
            "i_offset": padded(self.i_offset_A, 0.0),
            "i_gain": padded(self.i_gain, 1.0),
            "u_noise": self.u_dc_noise_V,
            "seed": self.noise_seed,
            "rotor": _core.RotorSensor(
                counts=self.encoder_counts,
                index=self.encoder_index,
                hall=self.hall,
                hall_error=to_si(self.hall_error_deg, "deg") / N_r,
            ),
        }

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
