"""The village of docs/pumping.md: its day, the sizes of its array, and machines for pumps.

Writes docs/pumping/village.csv (the figures of `reluctance pump examples/sun_village.toml`),
village_sizes.csv (modules in series), village_tanks.csv (volumes of the tank), module.csv
(voltages of one module at 1000 W/m2), and motors.csv:
greatest torque, shaft power and efficiency of library machines over voltage, by the loss map.

    python studies/sun_village.py
"""

import csv
import math
from dataclasses import replace
from pathlib import Path

import numpy as np

import reluctance as rl
from reluctance.plant.solar.single_diode import power_point
from reluctance.pumping import load_system, pump, sizes, with_units
from reluctance.pumping.loss_map import Box, loss_map
from reluctance.pumping.sizing import Values

ROOT = Path(__file__).parents[1]
OUT = ROOT / "docs" / "pumping"
VOLTAGES = (75.0, 100.0), (150.0, 300.0)  # of the dc link, two for each loss map [V]
MACHINES = {  # speed [rpm], end of the torques [N m]
    "generic_1hp_8_6": (1500, 4.0),
    "design_10_8": (2900, 12.0),
    "design_12_8": (1500, 40.0),
    "paper_6_4": (1500, 45.0),
}


def machine_rows() -> list[dict[str, object]]:
    """Greatest torque and efficiency at it, at each voltage."""
    return [
        row
        for name, (rpm, tau_max) in MACHINES.items()
        for ends in VOLTAGES
        for row in machine_row(name, rpm, tau_max, ends)
    ]


def machine_row(
    name: str, rpm: float, tau_max: float, ends: tuple[float, float]
) -> list[dict[str, object]]:
    """A row for each end of the voltages."""
    omega = rpm * math.pi / 30
    own = rl.load(
        ROOT / "examples" / "village_drive.toml",
        [f"machine={name}", f"reference.tau_Nm={0.5 * tau_max}", f"load.speed_rpm={rpm}"],
    )
    losses = loss_map(own, Box(ends, (0.5 * omega, omega), tau_max), shape=(2, 2, 5))
    rows: list[dict[str, object]] = []
    for u in ends:
        at = np.full(1, u), np.full(1, omega)
        tau = losses.greatest_torque(*at)
        p_in = float(losses.p_in(*at, tau)[0])
        p_shaft = float(tau[0]) * omega
        rows.append(
            {
                "case": f"{name} {u:.0f} V",
                "speed_rpm": rpm,
                "tau_Nm": f"{tau[0]:.5g}",
                "p_shaft_W": f"{p_shaft:.5g}",
                "eta_pct": f"{100 * p_shaft / p_in:.4g}",
            }
        )
    return rows


def written(name: str, rows: list[dict[str, object]]) -> None:
    """One table as CSV."""
    with (OUT / name).open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


def main() -> None:
    """Writes the four tables."""
    system = load_system(ROOT / "examples" / "sun_village.toml")
    sharing = rl.load(
        ROOT / "examples" / "village_drive.toml",
        ["control.law=torque_sharing", "control.sharing=cubic", "control.i_band_A=0.5"],
    )
    cases = {
        "village": system,
        "sharing": replace(system, drive=sharing),
        "empty": system.with_values({"tank.start_m3": 0.0}),
    }
    found = {name: with_units(pump(case)) for name, case in cases.items()}
    written(
        "village.csv",
        [
            {"case": name, **{k: "" if v is None else f"{v:.6g}" for k, v in figures.items()}}
            for name, figures in found.items()
        ],
    )
    varied: list[tuple[Values, str]] = [
        ({"array.n_series": [2, 3, 4, 5, 6, 7]}, "village_sizes.csv"),
        ({"tank.volume_m3": [0.0, 10.0, 20.0, 40.0]}, "village_tanks.csv"),
    ]
    for values, name in varied:
        table = sizes(system, values).rename(columns=lambda name: name.rpartition(".")[2])
        (OUT / name).write_text(
            table.to_csv(index=False, float_format="%.6g", lineterminator="\n"), encoding="utf-8"
        )
    one = system.array.model_copy(update={"n_series": 1})
    found_at = {t: power_point(one.diode(np.full(1, 1e3), np.full(1, t))) for t in (0.0, 65.0)}
    written(
        "module.csv",
        [
            {
                "case": f"cell_{t:.0f}_degC",
                "u_mp_V": f"{point.u[0]:.5g}",
                "u_oc_V": f"{point.u_oc[0]:.5g}",
            }
            for t, point in found_at.items()
        ],
    )
    written("motors.csv", machine_rows())


if __name__ == "__main__":
    main()
