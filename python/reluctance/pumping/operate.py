"""A day or a year of a pumping system: from weather to water, sample by sample, quasi-static."""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from reluctance.base.arrays import FloatArray
from reluctance.base.errors import ParameterError
from reluctance.drive.drive import Drive
from reluctance.plant.hydraulics.curve import GRAVITY, M3PH, RHO, RPM
from reluctance.plant.hydraulics.pipe import Hydraulics, hydraulics
from reluctance.plant.solar.single_diode import Diode, PowerPoint, current, power_point
from reluctance.pumping.loss_map import Box, LossMap, loss_map
from reluctance.pumping.matching import limit_of, power_table, speed
from reluctance.pumping.sun import sunlight
from reluctance.pumping.system import Operation, System, load_system, together
from reluctance.pumping.tank import Storage, store
from reluctance.pumping.weather import Weather
from reluctance.pumping.weather_file import read_weather, with_minutes

DARK = 5.0  # below it the array is taken as dark [W/m^2]
HOT_COLD = (75.0, -10.0)  # cell temperatures that bound the array's voltage [degC]
STEP_U = 10.0  # bounds of the loss map are rounded to it, so that its cache is met again [V]
STEP_SPEED = 0.2  # of the largest: the loss map begins at a multiple, below what lifts water
DCDC_SPAN = 0.1  # of a fixed dc-link voltage: the loss map's half width


@dataclass(frozen=True)
class Samples:
    """One value per interval; powers are means over it."""

    poa_global: FloatArray  # on the plane [W/m^2]
    poa_effective: FloatArray  # after dirt and reflection [W/m^2]
    temp_cell: FloatArray  # [degC]
    p_mp: FloatArray  # what the array could give [W]
    p_array: FloatArray  # what it could give at its operating voltage [W]
    u: FloatArray  # operating voltage of the array, if all were taken [V]
    i: FloatArray  # its current likewise; p_in tells what is taken [A]
    u_dc: FloatArray  # of the dc link [V]
    p_link: FloatArray  # what could reach the dc link [W]
    p_in: FloatArray  # what the drive draws [W]
    omega: FloatArray  # [rad/s]
    tau: FloatArray  # of the machine, its friction included [N m]
    p_shaft: FloatArray  # into the pump [W]
    Q: FloatArray  # [m^3/s]
    H: FloatArray  # of the pump [m]
    u_oc: FloatArray  # open-circuit voltage of the array [V]
    limit: FloatArray  # the Limit that keeps power from being drawn, as a number


@dataclass(frozen=True, repr=False)
class Pumped:
    """What a system did."""

    system: System
    weather: Weather
    samples: Samples
    storage: Storage | None
    losses: LossMap
    load: Hydraulics
    water_from_means: float | None = None  # with generated minutes: without them [m^3]

    def __repr__(self) -> str:
        days = len(self.t) * self.step / 86400
        return f"Pumped({self.system.name}: {self.water:.4g} m3 in {days:.4g} d)"

    @property
    def t(self) -> pd.DatetimeIndex:
        """Middles of the intervals, local time."""
        return self.weather.t

    @property
    def step(self) -> float:
        """Length of an interval [s]."""
        return self.weather.step

    @property
    def water(self) -> float:
        """Water pumped [m^3]."""
        return float(self.samples.Q.sum() * self.step)


def pump(
    system: System | str | Path,
    *,
    weather: Weather | None = None,
    progress: Callable[[float], None] | None = None,
) -> Pumped:
    """Runs a system over its weather.

    Parameters
    ----------
    system : System, str or Path
        The system, or its file.
    weather : Weather, optional
        Instead of the system's own.
    progress : callable, optional
        Is told the part of the loss map that is done.

    Raises
    ------
    ParameterError
        With one line: an unknown module, weather with gaps, a head out of reach, ...

    Examples
    --------
    >>> import reluctance as rl
    >>> round(rl.pump("examples/sun_day.toml").water, -1)
    570.0
    """
    if not isinstance(system, System):
        system = load_system(system)
    checks: dict[str, Callable[[], object]] = {  # these take no time; the loss map takes seconds
        "load": lambda: hydraulics(system.pump.curve(), system.pipe, system.pump.omega_max),
        "array": system.check_voltage,
        "weather": lambda: weather or read_weather(system.weather, system.site, system.folder),
    }
    found: dict[str, Any] = together(checks)
    load: Hydraulics = found["load"]
    own: Weather = found["weather"]
    losses = loss_map(drive_at_nominal(system), box_of(system), progress=progress)
    if weather is None and system.weather.generate_minutes and own.step > 60:
        means = _over(system, own, losses, load)
        own = with_minutes(own, system.weather, system.site, seed=system.weather.seed)
        return replace(_over(system, own, losses, load), water_from_means=means.water)
    return _over(system, own, losses, load)


def drive_at_nominal(system: System) -> Drive:
    """The system's drive at the voltage that its law is set up for, here and in firmware."""
    drive = system.drive
    return drive.computed(
        converter=drive.converter.model_copy(update={"u_dc_V": system.u_dc}),
    )


def box_of(system: System) -> Box:
    """What the loss map must cover: the array's voltages, the speeds at which the pump lifts."""
    operation = system.operation
    if operation.kind == "dcdc":
        assert operation.u_V is not None
        low, high = (1 - DCDC_SPAN) * operation.u_V, (1 + DCDC_SPAN) * operation.u_V
    else:
        diode = system.array.diode(np.full(2, 1000.0), np.array(HOT_COLD))
        low, high = power_point(diode).u.tolist()
        if operation.u_V is not None:
            low, high = min(low, operation.u_V), max(high, operation.u_V)
    omega_max = system.pump.omega_max
    lifts = hydraulics(system.pump.curve(), system.pipe, omega_max).omega[0] / omega_max
    slowest = max(int(lifts / STEP_SPEED), 1) * STEP_SPEED
    return Box(
        u_dc=(STEP_U * int(low / STEP_U), STEP_U * math.ceil(high / STEP_U)),
        omega=(slowest * omega_max, omega_max),
        tau_max=system.tau_max,
    )


def _over(system: System, weather: Weather, losses: LossMap, load: Hydraulics) -> Pumped:
    light = sunlight(weather, system.array)
    day = light.poa_effective > DARK
    if not day.any():
        raise ParameterError(
            f"{weather.where}: the array stays dark, less than {DARK:g} W/m2 from {weather.t[0]} "
            f"to {weather.t[-1]}; take days with sun, or turn the array"
        )
    samples = _by_day(system, light.poa_effective[day], light.temp_cell[day], losses, load)
    whole = {f.name: np.zeros(len(day)) for f in fields(Samples)}
    for name, values in samples.items():
        whole[name][day] = values
    whole["poa_global"], whole["poa_effective"] = light.poa_global, light.poa_effective
    whole["temp_cell"] = light.temp_cell
    storage = None
    if system.demand is not None:
        demand = system.demand.over(weather.t, weather.step)
        storage = store(whole["Q"] * weather.step, demand, system.tank)
    return Pumped(system, weather, Samples(**whole), storage, losses, load)


def _by_day(
    system: System, poa: FloatArray, temp_cell: FloatArray, losses: LossMap, load: Hydraulics
) -> dict[str, FloatArray]:
    """The samples with light."""
    operation, machine = system.operation, system.drive.machine
    diode = system.array.diode(poa, temp_cell)
    best = power_point(diode)
    u, i = _operating_point(operation, diode, best)
    u_link = np.maximum(u - system.array.blocking_diode_V, 0.0)
    p_array = u_link * i
    p_link, u_dc = p_array, u_link
    if operation.kind == "dcdc":
        assert operation.u_V is not None and operation.efficiency is not None
        p_link, u_dc = operation.efficiency * p_array, np.full_like(u, operation.u_V)
    well = system.pipe.well_yield_m3ph
    table = power_table(
        losses, load, B=machine.B_Nms, Q_max=np.inf if well is None else well * M3PH
    )
    omega, p_in = speed(table, u_dc, p_link)
    on = omega > 0

    def of(values: FloatArray) -> FloatArray:
        return np.where(on, np.interp(omega, load.omega, values), 0.0)

    p_shaft = of(load.p_shaft)
    tau_pump = np.divide(p_shaft, omega, out=np.zeros_like(omega), where=on)
    return {
        "p_mp": best.p,
        "p_array": p_array,
        "u": u,
        "i": i,
        "u_dc": u_dc,
        "p_link": p_link,
        "p_in": p_in,
        "omega": omega,
        "tau": tau_pump + machine.B_Nms * omega,
        "p_shaft": p_shaft,
        "Q": of(load.Q),
        "H": of(load.H),
        "u_oc": best.u_oc,
        "limit": limit_of(table, u_dc, p_link, omega, p_in),
    }


def _operating_point(
    operation: Operation, diode: Diode, best: PowerPoint
) -> tuple[FloatArray, FloatArray]:
    """Voltage and current of the array; behind its blocking diode no current is negative."""
    if operation.kind == "fraction":
        assert operation.fraction is not None
        u = best.u_oc * operation.fraction
    elif operation.kind == "constant":
        assert operation.u_V is not None
        u = np.full_like(best.u, operation.u_V)
    else:
        return best.u, best.i
    return u, np.maximum(current(diode, u), 0.0)


def columns(found: Pumped) -> dict[str, FloatArray]:
    """The samples under their border names."""
    s = found.samples
    table = {
        "poa_global": s.poa_global,
        "poa_effective": s.poa_effective,
        "temp_cell": s.temp_cell,
        "p_mp_W": s.p_mp,
        "u_V": s.u,
        "i_A": s.i,
        "u_dc_V": s.u_dc,
        "p_in_W": s.p_in,
        "speed_rpm": s.omega / RPM,
        "tau_Nm": s.tau,
        "p_shaft_W": s.p_shaft,
        "Q_m3ph": s.Q / M3PH,
        "H_m": s.H,
        "p_hyd_W": RHO * GRAVITY * s.Q * s.H,
    }
    if found.storage is not None:
        table |= {
            "level_m3": found.storage.level,
            "overflow_m3": found.storage.overflow,
            "missing_m3": found.storage.missing,
        }
    return table
