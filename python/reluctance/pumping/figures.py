"""Key figures of a day or year of pumping, and where the energy went."""

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd

from reluctance.base.arrays import FloatArray
from reluctance.plant.hydraulics.curve import GRAVITY, M3PH, RHO, RPM
from reluctance.plant.solar.single_diode import G_REF, power_point
from reluctance.pumping.matching import Limit
from reluctance.pumping.operate import Pumped
from reluctance.pumping.site import MOST_OFF
from reluctance.pumping.system import System
from reluctance.pumping.tank import Storage
from reluctance.pumping.tank import store as storing

KWH = 3.6e6  # [J]
TOLD_OF_START = 0.005  # of the demand: a start that changes the missing water by more is told
GIVES_MORE = 0.05  # than its limit, before it is said
REMEDIES = {
    Limit.speed: "the largest speed; power is left unused, see [pump] speed_max_rpm",
    Limit.torque: "the torque limit; power is left unused, see [limits] tau_max_Nm",
    Limit.voltage: "a voltage too low for more torque at speed; take more modules in series, "
    "or a control law that reaches more",
    Limit.well: "the yield of the well; power is left unused, see [pipe] well_yield_m3ph",
}
FAR_BEYOND = 5.0  # times the array's power in the water of a pump: its flows may be litres
MOST_DAYS = 60.0  # of its demand in a tank: more may be litres
LONG = 600.0  # intervals from here on hide clouds [s]
TROPICS, FLAT = 5.0, 5.0  # up to this latitude, or this tilt, the azimuth matters little [deg]


@dataclass(frozen=True)
class Chain:
    """Energies [J]; from e_mp on each is the one before less the losses between."""

    e_sun: float  # nominal power times insolation on the plane
    e_mp: float  # at the maximum power point
    off_mpp: float  # operating voltage and blocking diode
    converter: float  # dc-dc converter, while the pump runs
    below_threshold: float  # too little to lift water
    above_limit: float  # largest speed, torque, voltage or flow; also where nothing can turn
    e_in: float  # drawn by the drive
    drive: float  # copper, switches, iron
    friction: float  # of the machine
    pump: float
    pipe: float
    e_lift: float  # water lifted over the static head
    overflow: float  # its part that ran over the tank


def chain(found: Pumped) -> Chain:
    """Where the energy of the maximum power point went."""
    s, system = found.samples, found.system
    pipe, on = system.pipe, s.omega > 0
    stuck = ~on & (s.limit != Limit.none)

    def energy(power: FloatArray) -> float:
        return float(power.sum() * found.step)

    p_hyd, p_lift = RHO * GRAVITY * s.Q * s.H, RHO * GRAVITY * s.Q * pipe.H_static_m
    spilt = 0.0 if found.storage is None else float(found.storage.overflow.sum())
    return Chain(
        e_sun=energy(s.poa_global) / G_REF * nominal_power(found),
        e_mp=energy(s.p_mp),
        off_mpp=energy(s.p_mp - s.p_array),
        converter=energy((s.p_array - s.p_link) * on),
        below_threshold=energy(s.p_array * ~(on | stuck)),
        above_limit=energy((s.p_link - s.p_in) * on + s.p_array * stuck),
        e_in=energy(s.p_in),
        drive=energy(s.p_in - s.tau * s.omega),
        friction=energy(system.drive.machine.B_Nms * s.omega**2),
        pump=energy(s.p_shaft - p_hyd),
        pipe=energy(p_hyd - p_lift),
        e_lift=energy(p_lift),
        overflow=RHO * GRAVITY * pipe.H_static_m * spilt,
    )


def nominal_power(found: Pumped) -> float:
    """Of the array at 1000 W/m2 and 25 degC [W]."""
    diode = found.system.array.diode(np.full(1, G_REF), np.full(1, 25.0))
    return float(power_point(diode).p[0])


def with_units(found: Pumped) -> dict[str, float | None]:
    """The figures of `reluctance pump --json`; null where there is no demand or no meaning."""
    s, c, store = found.samples, chain(found), found.storage
    hours = found.step / 3600
    on = s.omega > 0
    e_shaft = float(s.p_shaft.sum() * found.step)
    peak = nominal_power(found)
    days = len(s.Q) * hours / 24
    lost = {
        name: getattr(c, name) / KWH
        for name in (
            "off_mpp converter below_threshold above_limit drive friction pump pipe overflow"
        ).split()
    }
    from_means = found.water_from_means
    return {
        "water_m3": found.water,
        "water_m3_per_day": found.water / days,
        "water_m3_per_kWp": found.water / (peak / 1e3),
        "pumping_h": float(on.sum() * hours),
        "days": days,
        "array_kWp": peak / 1e3,
        "poa_kWh_m2": float(s.poa_global.sum() * hours / 1e3),
        "poa_effective_kWh_m2": float(s.poa_effective.sum() * hours / 1e3),
        "e_mp_kWh": c.e_mp / KWH,
        "e_in_kWh": c.e_in / KWH,
        "e_shaft_kWh": e_shaft / KWH,
        "e_lift_kWh": c.e_lift / KWH,
        **{f"lost_{name}_kWh": value for name, value in lost.items()},
        "used_of_mp": _ratio(c.e_in, c.e_mp),
        "eta_motor": _ratio(e_shaft, c.e_in),
        "eta_pump": _ratio(e_shaft - c.pump, e_shaft),
        "eta": _ratio(c.e_lift, c.e_mp),
        "speed_max_rpm": float(s.omega.max() / RPM),
        "Q_max_m3ph": float(s.Q.max() / M3PH),
        "limited_h": float((s.limit != Limit.none).sum() * hours),
        **{
            f"limited_{limit.name}_h": float((s.limit == limit).sum() * hours)
            for limit in Limit
            if limit != Limit.none
        },
        "u_oc_max_V": float(s.u_oc.max()),
        "u_oc_cold_V": found.system.u_cold,
        "temp_cold_degC": found.system.limits.temp_cold_degC,
        "u_mp_hot_V": float(s.u[np.argmax(np.where(s.u_oc > 0, s.temp_cell, -np.inf))]),
        "demand_m3": None if store is None else float(store.demand.sum()),
        "missing_m3": None if store is None else float(store.missing.sum()),
        "overflow_m3": None if store is None else float(store.overflow.sum()),
        "level_start_m3": None if store is None else store.start,
        "level_end_m3": None if store is None else float(store.level[-1]),
        "loss_of_load_probability": None if store is None else store.loss_of_load,
        "water_from_means_m3": from_means,
        "step_min": found.step / 60,
    }


def per(found: Pumped, rule: str) -> pd.DataFrame:
    """Sums by day ("D"), month ("MS") or year ("YS"), local time."""
    hours, s = found.step / 3600, found.samples
    table = pd.DataFrame(
        {
            "water_m3": s.Q * found.step,
            "pumping_h": (s.omega > 0) * hours,
            "poa_kWh_m2": s.poa_global * hours / 1e3,
            "e_mp_kWh": s.p_mp * found.step / KWH,
            "e_in_kWh": s.p_in * found.step / KWH,
        },
        index=found.t,
    )
    if found.storage is not None:
        table["demand_m3"] = found.storage.demand
        table["missing_m3"] = found.storage.missing
        table["overflow_m3"] = found.storage.overflow
    return table.resample(rule).sum()


def remarks(found: Pumped) -> list[str]:
    """What a reader of these figures must know, each on one line."""
    told, s = of_the_light(found), found.samples
    if found.water_from_means is not None:
        told.append(
            f"minutes were generated within the hours (seed {found.system.weather.seed}): from "
            f"the hourly means it would be {found.water_from_means:.0f} m3, "
            f"{found.water_from_means / max(found.water, 1e-9) - 1:+.1%}"
        )
    if found.water:
        told += [f"{hours:.1f} h at {REMEDIES[limit]}" for limit, hours in at_limits(found).items()]
    told += _of_the_limit(found)
    low = (s.omega > 0) & (s.u_dc < 0.98 * found.losses.u_dc[0])
    if low.any():
        told.append(
            f"{low.sum() * found.step / 3600:.1f} h below {found.losses.u_dc[0]:g} V, where the "
            "loss map ends: its edge is used"
        )
    if found.losses.tau_set_up < found.system.tau_max:
        told.append(_of_the_set_up(found))
    if not found.water:
        told.append(f"no water: {_why_none(found)}{_of_the_flows(found)}")
    told += [*_of_the_tank(found.system), *_of_the_demand(found), *_of_the_hours(found.system)]
    told += _of_the_tilt(found.system)
    if found.storage is not None and found.system.tank.start_m3 is not None:
        told += _of_the_start(found, found.storage)
    if found.system.limits.u_max_V is None:
        told.append(
            f"the open-circuit voltage of {s.u_oc.max():.0f} V was not checked; the switches and "
            "capacitors of the converter must stand it on the coldest morning: set [limits] u_max_V"
        )
    return told


def _of_the_tank(system: System) -> list[str]:
    """A tank so large that it may be in litres."""
    if system.demand is None or system.tank.volume_m3 <= MOST_DAYS * system.demand.m3_per_day:
        return []
    days = system.tank.volume_m3 / system.demand.m3_per_day
    return [
        f"[tank] volume_m3 = {system.tank.volume_m3:g} holds the demand of {days:.4g} days; check "
        "its unit: 1000 litres are 1 m3"
    ]


def _of_the_hours(system: System) -> list[str]:
    """Hours of a demand on a clock that is not that of the place."""
    demand, off = system.demand, system.site.clock_ahead_h
    if demand is None or abs(off) <= MOST_OFF or demand.to_h - demand.from_h == 24:
        return []
    return [
        f"[demand] from_h and to_h are hours of {system.site.timezone}, {abs(off):.1f} h "
        f"{'ahead of' if off > 0 else 'behind'} the sun there: set [site] timezone to that of the "
        "place, and write times of a weather file that are in UTC with their offset, +00:00"
    ]


def _of_the_demand(found: Pumped) -> list[str]:
    """A demand so large that it may be in litres."""
    demand, best = found.system.demand, 86400 * float(found.samples.Q.max())
    if demand is None or not best or demand.m3_per_day <= best:
        return []
    return [
        f"[demand] m3_per_day = {demand.m3_per_day:g} is more than the best flow here gives in 24 "
        f"h, {best:.3g} m3: less demand or a larger system; check its unit: 1000 litres are 1 m3"
    ]


def _of_the_tilt(system: System) -> list[str]:
    """A tilt that may be in radians."""
    tilt = system.array.tilt_deg
    if tilt > math.pi / 2 or tilt == round(tilt):
        return []
    return [
        f"[array] tilt_deg = {tilt:g} is almost flat; check its unit: {tilt:g} rad are "
        f"{math.degrees(tilt):.3g} deg"
    ]


def of_the_light(found: Pumped) -> list[str]:
    """What a reader must know of the weather and of how the array faces."""
    told = [*_of_the_azimuth(found.system), *found.weather.doubts]
    if found.step >= LONG and found.system.weather.kind != "clear":
        told.append(
            f"the weather is means over {found.step / 60:g} min: they overstate the water of "
            "cloudy days, most where a high head leaves little to spare, of clear days by less "
            "than 1 %; [weather] generate_minutes = true generates the minutes within"
        )
    return told


def at_limits(found: Pumped) -> dict[Limit, float]:
    """Hours at each limit that was reached [h]."""
    limits, hours = found.samples.limit, found.step / 3600
    reached = {limit: float((limits == limit).sum() * hours) for limit in REMEDIES}
    return {limit: time for limit, time in reached.items() if time}


def _of_the_set_up(found: Pumped) -> str:
    """How far the control reaches at its nominal voltage, where that is not far enough."""
    system, most = found.system, math.floor(1e3 * found.losses.tau_set_up) / 1e3
    return (
        f"the control law reaches {most:g} of {system.tau_max:g} N m at {system.u_dc:g} V and "
        f"{system.pump.omega_max / RPM:.0f} rpm, and is set up for that: to run or export it, set "
        f"[limits] tau_max_Nm = {most:g}, or take more modules in series"
    )


def _of_the_limit(found: Pumped) -> list[str]:
    """How much more than its limit a control law gives where it is at it."""
    s, tau_max = found.samples, found.losses.tau_set_up
    there = s.limit == Limit.torque
    if not there.any():
        return []
    given = found.losses.given_at_limit(s.u_dc[there], s.omega[there])
    mean = float(given.mean())
    if mean < 1 + GIVES_MORE:
        return []
    return [
        f"at the torque limit the control law gives {mean * tau_max:.3g} N m where it is asked for "
        f"{tau_max:.3g} ({mean - 1:+.0%}): a switched run and firmware pump more there than these "
        "figures; take a law that holds its torque over the voltages of the array"
    ]


def _of_the_azimuth(system: System) -> list[str]:
    """Whether the array faces away from the equator."""
    latitude, array = system.site.latitude_deg, system.array
    equator = 180 if latitude > 0 else 0
    away = abs(math.remainder(array.azimuth_deg - equator, 360))
    if abs(latitude) <= TROPICS or array.tilt_deg <= FLAT or away <= 90:
        return []
    return [
        f"the array faces away from the equator: azimuth_deg = {array.azimuth_deg:g} at latitude "
        f"{latitude:g}; set [array] azimuth_deg = {equator}"
    ]


def _why_none(found: Pumped) -> str:
    """What fails at the least speed that lifts water."""
    s, load, losses = found.samples, found.load, found.losses
    omega, B = load.omega[0], found.system.drive.machine.B_Nms
    tau = float(load.tau[0] + B * omega)
    need = f"the pump needs {tau:.3g} N m at {omega / RPM:.0f} rpm, where it begins to lift water"
    if not (s.limit != Limit.none).any():
        u = np.full(1, np.median(s.u_dc[s.p_mp > 0]))
        least = float(losses.p_in(u, np.full(1, omega), np.full(1, tau))[0])
        best, todo = s.p_mp.max(), "take more modules or less head"
        if best > least:
            todo = f"at its maximum power point it has {best:.0f} W: change [operation]"
        return (
            f"the drive needs {least:.0f} W where the pump begins to lift water, and the array "
            f"gives at most {s.p_link.max():.0f} W; {todo}"
        )
    most = losses.tau_set_up
    if tau > most:
        given = most >= found.system.tau_max
        return f"the torque limit of {most:.3g} N m is too low: {need}; " + (
            "raise [limits] tau_max_Nm"
            if given
            else f"the machine gives no more at {found.system.u_dc:g} V: take more modules in "
            "series, or a larger machine"
        )
    highest = float(s.u_dc.max())
    reach = float(losses.greatest_torque(np.full(1, highest), np.full(1, omega))[0])
    return (
        f"the voltage is too low: {need}, and the machine gives {reach:.3g} N m there at "
        f"{highest:.0f} V; take more modules in series"
    )


def _of_the_flows(found: Pumped) -> str:
    """A pump so large for the array that its flows may be in litres."""
    curve = found.system.pump.curve()
    Q = np.linspace(0.0, curve.Q_end, 401)
    water = RHO * GRAVITY * Q * curve.head_1(Q)
    best = float(water[np.argmax(water / curve.power_1(Q))])
    if best <= FAR_BEYOND * found.samples.p_mp.max():
        return ""
    return (
        f"; the pump's best point has {best:.0f} W in the water: check the unit of its flows, "
        "Q_m3ph; 1000 l/min are 60 m3/h"
    )


def _of_the_start(found: Pumped, store: Storage) -> list[str]:
    """How much of the missing water is the start's."""
    usual = found.system.tank.model_copy(update={"start_m3": None})
    repeated = storing(found.samples.Q * found.step, store.demand, usual)
    more = float(store.missing.sum() - repeated.missing.sum())
    if more < TOLD_OF_START * store.demand.sum():
        return []
    return [
        f"the tank started with {store.start:.3g} m3: {more:.3g} m3 of the missing water are its "
        f"first hours; without [tank] start_m3 it starts as full as it ends, loss of load "
        f"{repeated.loss_of_load:.2%}"
    ]


def _ratio(part: float, whole: float) -> float | None:
    return part / whole if whole > 0 else None
