"""Figures of a pumping system. Each function draws on Axes that it is given and returns them."""

from dataclasses import fields, replace

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter

from reluctance.base.arrays import FloatArray
from reluctance.base.phases import BLUE, GREEN, ORANGE, RED, SKY
from reluctance.plant.hydraulics.curve import GRAVITY, M3PH, RHO, RPM
from reluctance.plant.hydraulics.pipe import flow
from reluctance.plant.solar.single_diode import current, power_point
from reluctance.pumping.figures import KWH, chain, per
from reluctance.pumping.operate import Pumped
from reluctance.pumping.text import CAUSES

MANY_DAYS = 60  # more are shown by month
MOST_POINTS = 4000  # of a cloud of samples
IRRADIANCES = (200.0, 400.0, 600.0, 800.0, 1000.0)  # of the curves [W/m^2]


def plot_array(ax: Axes, found: Pumped) -> Axes:
    """Current-voltage curves at the cell temperatures met, and the points of all the power that the
    array has at its operating voltage. Where the drive is at a limit it draws less."""
    s, array = found.samples, found.system.array
    light = s.poa_effective > 5
    slope, base = np.polyfit(s.poa_effective[light], s.temp_cell[light], 1)
    for G in IRRADIANCES:
        temp = base + slope * G
        diode = array.diode(np.full(1, G), np.full(1, temp))
        u = np.linspace(0, float(power_point(diode).u_oc[0]), 200)
        ax.plot(u, current(diode, u), color=SKY, lw=1)
        ax.annotate(
            f"{G:g} W/m², {temp:.0f} °C",
            (0, float(current(diode, np.zeros(1))[0])),
            fontsize=7,
            va="bottom",
            xytext=(2, 1),
            textcoords="offset points",
        )
    on = s.omega > 0
    ax.plot(*_thin(s.u[light & ~on], s.i[light & ~on]), ".", ms=2, color=ORANGE, label="no flow")
    ax.plot(*_thin(s.u[on], s.i[on]), ".", ms=2, color=BLUE, label="pumping")
    ax.set(
        title="array: points of all its power; at a limit the drive draws less",
        xlabel="voltage (V)",
        ylabel="current (A)",
        ylim=(0, None),
        xlim=(0, None),
    )
    ax.legend(fontsize=8, loc="lower left", markerscale=4)
    return ax


def plot_heads(ax: Axes, found: Pumped) -> Axes:
    """Head over flow at several speeds, what the pipe asks for, and the pump's efficiency."""
    curve, pipe = found.system.pump.curve(), found.system.pipe
    most = found.load.omega[-1] / curve.omega_ref
    eta = ax.twinx()
    for r in np.linspace(0.6, 1.0, 5) * most:
        Q = np.linspace(0, curve.Q_end * r, 100)
        H = curve.head(Q, np.full_like(Q, r))
        rpm = r * curve.omega_ref / RPM
        ax.plot(Q / M3PH, H, color=SKY, lw=1)
        ax.annotate(f"{rpm:.0f} rpm", (0, H[0]), fontsize=7, va="bottom")
        power = curve.shaft_power(Q, np.full_like(Q, r))
        eta.plot(Q / M3PH, 100 * RHO * GRAVITY * Q * H / power, ":", color=GREEN, lw=0.8)
    Q_max = max(1.2 * float(found.samples.Q.max()), 0.5 * float(flow(curve, pipe, most)))
    Q = np.linspace(0, Q_max, 100)
    ax.plot(
        Q / M3PH, pipe.H_static_m + pipe.friction_head(Q), color=RED, label="static head + pipe"
    )
    on = found.samples.omega > 0
    ax.plot(
        *_thin(found.samples.Q[on] / M3PH, found.samples.H[on]),
        ".",
        ms=3,
        color=BLUE,
        label="pumping",
    )
    ax.set(
        title="pump and pipe",
        xlabel="flow (m³/h)",
        ylabel="head (m)",
        ylim=(0, None),
        xlim=(0, None),
    )
    eta.set(ylabel="efficiency of the pump, dotted (%)", ylim=(0, 100))
    ax.legend(fontsize=8, loc="upper right")
    return ax


def plot_irradiance(ax: Axes, found: Pumped) -> Axes:
    """Irradiance on the plane of the array over time."""
    ax.plot(found.t, found.samples.poa_global, color=ORANGE)
    return _over_time(ax, found, "irradiance (W/m²)")


def plot_power(ax: Axes, found: Pumped) -> Axes:
    """Power at the maximum power point, drawn, and lifted, over time."""
    s = found.samples
    lift = RHO * GRAVITY * s.Q * found.system.pipe.H_static_m
    for power, label, colour in (
        (s.p_mp, "maximum power point", ORANGE),
        (s.p_in, "drawn by the drive", BLUE),
        (s.p_shaft, "shaft", RED),
        (lift, "lifted water", GREEN),
    ):
        ax.plot(found.t, power / 1e3, color=colour, label=label)
    ax.legend(fontsize=8, loc="upper right")
    return _over_time(ax, found, "power (kW)")


def plot_speed(ax: Axes, found: Pumped) -> Axes:
    """Speed over time."""
    ax.plot(found.t, found.samples.omega / RPM, color=BLUE)
    return _over_time(ax, found, "speed (rpm)")


def plot_flow(ax: Axes, found: Pumped) -> Axes:
    """Flow over time."""
    ax.plot(found.t, found.samples.Q / M3PH, color=BLUE)
    return _over_time(ax, found, "flow (m³/h)")


def plot_water(ax: Axes, found: Pumped) -> Axes:
    """Water by month, or by day where there are less than two months."""
    by_month = (found.t[-1] - found.t[0]).days > MANY_DAYS
    table = per(found, "MS" if by_month else "D")
    names = [f"{t:%b}" if by_month else f"{t:%d %b}" for t in table.index]
    place = np.arange(len(table))
    ax.bar(place, table["water_m3"], color=BLUE, label="pumped")
    if "missing_m3" in table:
        ax.bar(place, table["missing_m3"], color=RED, width=0.4, label="missing")
        ax.hlines(table["demand_m3"], place - 0.45, place + 0.45, color="k", label="demand")
        ax.margins(y=0.2)
        ax.legend(fontsize=8, loc="upper right", ncols=3)
    ax.set_xticks(place[:: max(len(place) // 16, 1)], names[:: max(len(place) // 16, 1)])
    middle, half = (len(place) - 1) / 2, max(len(place) + 0.4, 6) / 2  # one day is a bar, too
    ax.set(title=f"water by {'month' if by_month else 'day'}", ylabel="water (m³)")
    ax.set_xlim(middle - half, middle + half)
    return ax


def plot_losses(ax: Axes, found: Pumped) -> Axes:
    """Where the energy of the maximum power point went."""
    c = chain(found)
    left = c.e_mp / KWH
    rows = [("at the maximum power point", 0.0, left, ORANGE)]
    for name, label in CAUSES.items():
        lost = getattr(c, name) / KWH
        left -= lost
        rows.append((label, left, lost, SKY))
    rows.append(("water lifted", 0.0, c.e_lift / KWH, GREEN))
    if c.overflow > 0:
        rows.append(("of it over the tank's rim", 0.0, c.overflow / KWH, RED))
    for k, (_, start, width, colour) in enumerate(rows):
        ax.barh(k, width, left=start, color=colour)
        share = 100 * width / max(c.e_mp / KWH, 1e-12)
        digits = ".0f" if width >= 1e4 else ".4g"
        told = f" {width:{digits}} kWh, {share:.1f} %"
        ax.annotate(told, (start + width, k), fontsize=7, va="center")
    ax.set_yticks(range(len(rows)), [row[0] for row in rows])
    ax.invert_yaxis()
    ax.set(title="where the energy went", xlabel="energy (kWh)", xlim=(0, 1.3 * c.e_mp / KWH))
    return ax


def plot_threshold(ax: Axes, found: Pumped) -> Axes:
    """Flow over irradiance: nothing flows below the threshold that the static head sets."""
    s = found.samples
    light = s.poa_effective > 5
    ax.plot(*_thin(s.poa_effective[light], s.Q[light] / M3PH), ".", ms=3, color=BLUE)
    flows = s.poa_effective[s.omega > 0]
    title = "no flow"
    if len(flows):
        ax.axvline(flows.min(), color=RED, lw=1)
        title = f"flow from {flows.min():.0f} W/m² on"
    ax.set(title=title, xlabel="irradiance in the cells (W/m²)", ylabel="flow (m³/h)")
    return ax


def plot_tank(ax: Axes, found: Pumped) -> Axes:
    """Level of the tank over time; over many days its least and greatest of each day."""
    assert found.storage is not None
    level = pd.Series(found.storage.level, index=found.t)
    if (found.t[-1] - found.t[0]).days > MANY_DAYS:
        day = level.resample("D")
        ax.fill_between(day.min().index, day.min(), day.max(), color=SKY, label="range of a day")
        ax.plot(day.min().index, day.min(), color=BLUE, lw=0.8, label="least of a day")
        ax.legend(fontsize=8)
    else:
        ax.plot(level.index, level, color=BLUE, lw=0.8)
    _over_time(ax, found, "water in the tank (m³)")
    ax.set_title(f"tank: {found.storage.loss_of_load:.1%} of the demand is missing")
    return ax


def plot_efficiency(ax: Axes, found: Pumped) -> Axes:
    """Efficiency of the drive over speed and torque at the median voltage, and the samples."""
    s, losses = found.samples, found.losses
    on = s.omega > 0
    u = float(np.median(s.u_dc[on])) if on.any() else float(losses.u_dc.mean())
    omega = np.linspace(losses.omega[0], losses.omega[-1], 60)
    tau = np.linspace(losses.tau[0], losses.tau[-1], 60)
    w, x = np.meshgrid(omega, tau)
    eta = 100 * w * x / losses.p_in(np.full_like(w, u), w, x)
    reach = losses.greatest_torque(np.full_like(w, u), w) * (1 + 1e-9)
    eta = np.where(x <= reach, eta, np.nan)
    drawn = ax.contourf(w / RPM, x, eta, 12, cmap="viridis")
    ax.figure.colorbar(drawn, ax=ax, label="efficiency of the drive (%)")
    ax.plot(*_thin(s.omega[on] / RPM, s.tau[on]), ".", ms=3, color=RED)
    ax.set(title=f"drive at {u:.0f} V and the samples", xlabel="speed (rpm)", ylabel="torque (N m)")
    return ax


def best_day(found: Pumped) -> Pumped:
    """The day with most water, for the plots over a day."""
    day = per(found, "D")["water_m3"].idxmax().date()
    kept = found.t.date == day
    cut = {f.name: getattr(found.samples, f.name)[kept] for f in fields(found.samples)}
    weather = replace(found.weather, t=found.t[kept])
    return replace(found, weather=weather, samples=type(found.samples)(**cut), storage=None)


def _over_time(ax: Axes, found: Pumped, label: str) -> Axes:
    locator = AutoDateLocator(tz=found.t.tz)  # type: ignore[no-untyped-call]
    ax.xaxis.set_major_locator(locator)
    dates = ConciseDateFormatter(locator, tz=found.t.tz)  # type: ignore[no-untyped-call]
    ax.xaxis.set_major_formatter(dates)
    ax.set(ylabel=label, ylim=(0, None), xlabel="local time", xlim=(found.t[0], found.t[-1]))
    return ax


def _thin(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    every = max(len(x) // MOST_POINTS, 1)
    return x[::every], y[::every]
