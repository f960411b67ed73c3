"""What does a cloud do to a solar pump without a dc-dc converter, and which control fails?

Writes docs/pumping/cloud.png, latch.png and cloud.csv. About a minute of one core.

    python studies/sun_cloud.py
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

import reluctance as rl
from reluctance import _core
from reluctance.base.figures import save_figure
from reluctance.base.picture import Picture

ROOT = Path(__file__).parents[1]
EXAMPLE = ROOT / "examples" / "sun_cloud.toml"
OUT = ROOT / "docs" / "pumping"
SETTLED = 3.0  # start-up is over [s]
LATCHED = 8.0  # the bad example has found its wrong point [s]
GRID = 0.02  # of the figures [s]
PERTURB_S, PERTURB = 0.1, 1.0  # the bad example: every 100 ms by 1 rad/s
FloatArray = NDArray[np.float64]


def power(result: rl.Result, t: FloatArray) -> FloatArray:
    """Mean power from the array between the instants t and the ones before [W]."""
    energy = np.interp(t, result.periods["t"], result.periods["E_source"])
    return np.asarray(np.gradient(energy, t))


def taken(result: rl.Result, since: float) -> float:
    """Energy taken over the energy at the maximum power point, from `since` on [1]."""
    t, energy = result.periods["t"], result.periods["E_source"]
    fine = np.linspace(since, t[-1], 2001)
    return float(
        (energy[-1] - np.interp(since, t, energy))
        / np.trapezoid(result.drive.source.available(fine), fine)
    )


def row(control: str, result: rl.Result, *, since: float) -> dict[str, object]:
    """Energy taken and range of the dc-link voltage from `since` on, and speed at the end."""
    u_dc = result.u_dc[result.t > since]
    return {
        "control": control,
        "from_s": f"{since:g}",
        "taken_pct": f"{100 * taken(result, since):.2f}",
        "u_min_V": f"{u_dc.min():.1f}",
        "u_max_V": f"{u_dc.max():.1f}",
        "speed_end_rpm": f"{result.omega_m[-1] * 30 / np.pi:.1f}",
    }


class PerturbSpeed:
    """Perturb and observe on the reference of a speed loop: a controller that hands every sample on
    to the drive's own, with a speed reference that climbs while the power does."""

    def __init__(self, drive: rl.Drive, omega_start: float) -> None:
        self.inner = drive.controller()
        self.every = round(PERTURB_S / drive.control.T_s)
        self.omega_ref, self.direction = omega_start, 1.0
        self.energy, self.last, self.n = 0.0, 0.0, 0

    def __call__(self, y: rl.Measurement, reference: float) -> list[float]:
        self.energy += y.u_dc * y.i_source
        self.n += 1
        if self.n % self.every == 0:
            if self.energy < self.last:
                self.direction = -self.direction
            self.omega_ref += PERTURB * self.direction
            self.last, self.energy = self.energy, 0.0
        return _core.step(self.inner, y, self.omega_ref)


def latching() -> rl.Result:
    """800 W/m2 and 45 degC, a pump without static head, speed loop with 60 N m."""
    drive = rl.load(
        EXAMPLE,
        [
            *("reference.kind=speed", "reference.speed_rpm=1000", "control.tau_max_Nm=60"),
            *("source.t_s=[0]", "source.poa_global_Wpm2=[800]", "source.temp_cell_degC=[45]"),
            *(f"load.{key}=" for key in ("pump", "H_static_m", "L_m", "D_mm", "K")),
            *("load.k_pump_Nms2=0.0015", "load.J_kgm2=0.015", "load.speed_rpm=1000"),
            *(f"pv_control.{key}=" for key in ("tracking", "u_ref_V", "wake_s", "p_sleep_W")),
            "pv_control.k_dry_Nms2=",
        ],
    )
    bad = PerturbSpeed(drive, 1000 * np.pi / 30)
    controller = _core.controller_from(3, bad)
    return rl.simulate(drive, until=9.0, record=GRID, controller=controller)


def figure(result: rl.Result, *, title: str) -> Figure:
    """Voltage, power, speed and flow over time."""
    drawn = Picture(8, 8)
    volts, watts, speed, water = drawn.subplots(4, 1, sharex=True)
    t = np.arange(GRID, result.t[-1], GRID)
    volts.plot(result.t, result.u_dc, lw=0.8)
    volts.set(ylabel="dc link (V)", title=title, ylim=(0, None))
    watts.plot(t, result.drive.source.available(t) / 1e3, "k--", lw=0.8, label="maximum")
    watts.plot(t, power(result, t) / 1e3, lw=1.0, label="taken")
    watts.set(ylabel="array power (kW)", ylim=(0, None))
    watts.legend(loc="upper right", frameon=False)
    speed.plot(result.t, result.omega_m * 30 / np.pi, lw=1.0)
    speed.set(ylabel="speed (rpm)", ylim=(0, None))
    if result.drive.load.pump is not None:
        water.plot(result.t, result.Q * 3600, lw=1.0)
        water.set(ylabel="flow (m³/h)", ylim=(0, None))
    else:
        water.plot(result.t, result.tau_ref, lw=0.8)
        water.set(ylabel="torque reference (N m)")
    water.set(xlabel="time (s)")
    for ax in (volts, watts, speed, water):
        ax.grid(alpha=0.3)
    return drawn


def main() -> None:
    """All runs, figures and the table."""
    OUT.mkdir(exist_ok=True)
    rows: list[dict[str, object]] = []
    tracked = "perturb and observe, torque"
    no_notch = "pv_control.notch_damping=0"
    for name, overrides in {
        tracked: [],
        "incremental conductance, torque": ["pv_control.tracking=incremental_conductance"],
        "perturb and observe, speed": ["pv_control.actuator=speed"],
        f"{tracked}, no current sensor on the array": [
            "pv_control.current=legs",
            "sensing.comparators=sampled",
        ],
        "constant 230 V, torque": ["pv_control.tracking=constant"],
        f"{tracked}, no notch at the stroke frequency": [no_notch],
        f"{tracked}, 0.47 mF": ["source.C_uF=470"],
        f"{tracked}, 0.47 mF, no notch": ["source.C_uF=470", no_notch],
    }.items():
        result = rl.simulate(rl.load(EXAMPLE, overrides), record=1e-3 if not rows else GRID)
        if not rows:
            drawn = figure(result, title="1000 to 300 W/m² in a second")
            save_figure(drawn, OUT / "cloud.png")
        rows.append(row(name, result, since=SETTLED))
    bad = latching()
    save_figure(figure(bad, title="Perturb and observe on the speed reference"), OUT / "latch.png")
    rows.append(row("perturb and observe on the speed reference, 800 W/m2", bad, since=LATCHED))
    with (OUT / "cloud.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
