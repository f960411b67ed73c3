"""Does the quasi-static calculation of a day agree with switched runs of the same pump?

The array of `examples/sun_cloud.toml` at four irradiances, held at the voltage of its maximum
power: speed and shaft power by the balance that `reluctance pump` makes of each sample, and by a
switched run of 2 s of which the last 0.6 s count, ripple of the dc link and voltage controller
included. Writes docs/pumping/static.csv. The same for strings of two examples, with the drive that
`reluctance export firmware` exports: docs/pumping/strings.csv. About half a minute
of one core.

    python studies/sun_static.py
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

import reluctance as rl
from reluctance.base.schema import checked
from reluctance.plant.hydraulics.curve import M3PH, RPM
from reluctance.plant.hydraulics.pipe import Hydraulics, Pipe, hydraulics
from reluctance.plant.hydraulics.pump import pump_from
from reluctance.plant.solar.single_diode import power_point
from reluctance.pumping import drive_of, load_system
from reluctance.pumping.loss_map import Box, LossMap, loss_map
from reluctance.pumping.matching import power_table, speed
from reluctance.pumping.operate import box_of, drive_at_nominal

ROOT = Path(__file__).parents[1]
EXAMPLE = ROOT / "examples" / "sun_cloud.toml"
OUT = ROOT / "docs" / "pumping"
WEATHER = ((1000, 50), (800, 45), (500, 38), (300, 30))  # W/m2, degC of the cells
NOTCH = (0.02, 0.0)  # damping, of the example and none
BOX = (200.0, 280.0)  # of the loss map [V]
UNTIL, SETTLED = 2.0, 1.4  # [s]
STRINGS = (  # modules in series, and weather; at the last two the voltage is short
    *(("sun_village", n, (800, 45)) for n in range(2, 8)),
    *(("sun_day", 4, sun) for sun in ((1000, 50), (1000, 65))),
)
STRINGS_UNTIL, STRINGS_SETTLED = 5.0, 4.0  # [s]


def tables(drive: rl.Drive) -> tuple[Hydraulics, LossMap]:
    """The pump and pipe of a drive file's [load], and the drive's loss map."""
    load = drive.load
    pump = pump_from(load.pump, EXAMPLE.parent)
    keys = ("L_m", "D_mm", "roughness_mm", "K", "H_static_m")
    pipe = checked(Pipe, {key: getattr(load, key) for key in keys}, "[load]")
    box = Box(BOX, (0.2 * pump.omega_max, pump.omega_max), drive.tau_max)
    return hydraulics(pump.curve(), pipe, pump.omega_max), loss_map(drive, box)


def quasi_static(drive: rl.Drive, G: float, T: float) -> tuple[float, float, float]:
    """Voltage of the array's maximum power [V], speed [rad/s] and shaft power [W] there."""
    water, losses = tables(drive)
    best = power_point(drive.source.diode(np.array([G], float), np.array([T], float)))
    table = power_table(losses, water, B=drive.machine.B_Nms, Q_max=np.inf)
    omega = speed(table, best.u, best.p)[0]
    return float(best.u[0]), float(omega[0]), float(np.interp(omega, water.omega, water.p_shaft)[0])


def switched(
    drive: rl.Drive,
    sun: tuple[float, float],
    u: float,
    omega: float,
    *,
    notch: float | None = None,
    until: float = UNTIL,
    settled: float = SETTLED,
) -> tuple[float, float, float]:
    """Mean speed [rad/s], shaft power [W] and rms torque ripple of a switched run held at a
    voltage, under light [W/m2] on cells [degC]."""
    values = {
        "source.t_s": [0],
        "source.poa_global_Wpm2": [sun[0]],
        "source.temp_cell_degC": [sun[1]],
        "load.speed_rpm": omega / RPM,
        "pv_control.tracking": "constant",
        "pv_control.u_ref_V": u,
        "pv_control.wake_s": 0,
    }
    if notch is not None:
        values["pv_control.notch_damping"] = notch
    result = rl.simulate(drive.with_values(values), until=until, record=None)
    late = result.periods.between(int(np.searchsorted(result.periods["t"], settled)), -1)
    span = late.rise("t")
    mean = late.rise("theta_m") / span
    power = late.rise("E_mech") / span - result.drive.machine.B_Nms * mean**2
    square, tau = late.rise("tau_squared") / span, late.rise("tau") / span
    return mean, power, (square / tau**2 - 1) ** 0.5


def string_row(name: str, n: int, sun: tuple[float, float]) -> dict[str, object]:
    """Flow of an example with n modules in series: by the balance, and by a switched run."""
    system = load_system(ROOT / "examples" / f"{name}.toml", [f"array.n_series={n}"])
    water = hydraulics(system.pump.curve(), system.pipe, system.pump.omega_max)
    losses = loss_map(drive_at_nominal(system), box_of(system))
    table = power_table(losses, water, B=system.drive.machine.B_Nms, Q_max=np.inf)
    best = power_point(system.array.diode(*(np.array([x], float) for x in sun)))
    u, static = float(best.u[0]), float(speed(table, best.u, best.p)[0][0])
    given = drive_of(system), sun, u, static
    mean = switched(*given, until=STRINGS_UNTIL, settled=STRINGS_SETTLED)[0]
    Q = [float(np.interp(omega, water.omega, water.Q)) / M3PH for omega in (static, mean)]
    return {
        "case": f"{name} {n} {sun[0]} W/m2 {sun[1]} degC",
        "u_V": f"{u:.1f}",
        "speed_static_rpm": f"{static / RPM:.1f}",
        "speed_switched_rpm": f"{mean / RPM:.1f}",
        "speed_pct": f"{100 * (static / mean - 1):+.3f}",
        "Q_static_m3ph": f"{Q[0]:.3f}",
        "Q_switched_m3ph": f"{Q[1]:.3f}",
        "Q_pct": f"{100 * (Q[0] / Q[1] - 1):+.2f}",
    }


def written(name: str, rows: list[dict[str, object]]) -> None:
    """One table as CSV."""
    with (OUT / name).open("w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def main() -> None:
    """All runs and the tables."""
    rows: list[dict[str, object]] = []
    drive = rl.load(EXAMPLE)
    for G, T in WEATHER:
        u, omega, p_shaft = quasi_static(drive, G, T)
        for notch in NOTCH:
            mean, power, ripple = switched(drive, (G, T), u, omega, notch=notch)
            rows.append(
                {
                    "poa_global_Wpm2": G,
                    "temp_cell_degC": T,
                    "u_V": f"{u:.2f}",
                    "notch_damping": notch,
                    "speed_static_rpm": f"{omega / RPM:.2f}",
                    "speed_switched_rpm": f"{mean / RPM:.2f}",
                    "speed_pct": f"{100 * (mean / omega - 1):+.3f}",
                    "p_shaft_static_W": f"{p_shaft:.1f}",
                    "p_shaft_switched_W": f"{power:.1f}",
                    "p_shaft_pct": f"{100 * (power / p_shaft - 1):+.3f}",
                    "torque_ripple_rms_pct": f"{100 * ripple:.2f}",
                }
            )
    written("static.csv", rows)
    written("strings.csv", [string_row(*of) for of in STRINGS])


if __name__ == "__main__":
    main()
