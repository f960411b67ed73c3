"""The village of docs/pumping.md: its day, the sizes of its array, and machines for pumps.

Writes docs/pumping/village.csv (the figures of `reluctance pump examples/sun_village.toml`),
village_sizes.csv (modules in series), village_tanks.csv (volumes of the tank), module.csv
(voltages of one module at 1000 W/m2), motors.csv: greatest torque, shaft power and efficiency of
library machines over voltage, by the loss map, and size_time.csv: what the first `reluctance size`
of each example takes.

    python studies/sun_village.py
"""

import csv
import math
import os
import subprocess
import sys
import tempfile
import time
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
VOLTAGES = (75.0, 100.0, 150.0, 300.0)  # of the dc link, a loss map for each [V]
SHORT = 3  # modules in series, whose voltage is short for the pump
EXAMPLES = ("sun_village", "sun_day", "sun_year")  # that `size` is timed with
MACHINES = {  # speed [rpm], end of the torques [N m]
    "generic_1hp_8_6": (1500, 4.0),
    "design_10_8": (2900, 12.0),
    "design_12_8": (1500, 40.0),
    "paper_6_4": (1500, 45.0),
}


def machine_row(name: str, rpm: float, tau_max: float, u: float) -> dict[str, object]:
    """Greatest torque, and efficiency at it, of a machine whose law is set up for a voltage."""
    omega = rpm * math.pi / 30
    values = [f"machine={name}", f"converter.u_dc_V={u}"]
    values += [f"reference.tau_Nm={0.5 * tau_max}", f"load.speed_rpm={rpm}"]
    own = rl.load(ROOT / "examples" / "village_drive.toml", values)
    box = Box((u, 1.01 * u), (0.9 * omega, omega), tau_max)
    losses = loss_map(own, box, shape=(2, 2, 5))
    at = np.full(1, u), np.full(1, omega)
    tau = losses.greatest_torque(*at)
    p_in = float(losses.p_in(*at, tau)[0])
    p_shaft = float(tau[0]) * omega
    return {
        "case": f"{name} {u:.0f} V",
        "speed_rpm": rpm,
        "tau_Nm": f"{tau[0]:.5g}",
        "p_shaft_W": f"{p_shaft:.5g}",
        "eta_pct": f"{100 * p_shaft / p_in:.4g}",
    }


def time_row(example: str) -> dict[str, object]:
    """What the first `reluctance size` of an example takes, without a cache."""
    line = [sys.executable, "-m", "reluctance", "size", f"examples/{example}.toml"]
    with tempfile.TemporaryDirectory() as folder:
        before, start = os.times(), time.monotonic()
        subprocess.run(
            line,
            cwd=ROOT,
            env={**os.environ, "RELUCTANCE_CACHE": folder},
            stdout=subprocess.DEVNULL,
            check=True,
        )
        wall, after = time.monotonic() - start, os.times()
    used = after.children_user + after.children_system
    used -= before.children_user + before.children_system
    return {"example": example, "processor_s": f"{used:.1f}", "wall_s": f"{wall:.1f}"}


def written(name: str, rows: list[dict[str, object]]) -> None:
    """One table as CSV."""
    with (OUT / name).open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


def main() -> None:
    """Writes the tables."""
    system = load_system(ROOT / "examples" / "sun_village.toml")
    sharing = rl.load(
        ROOT / "examples" / "village_drive.toml",
        ["control.law=torque_sharing", "control.sharing=cubic", "control.i_band_A=0.5"],
    )
    cases = {
        "village": system,
        "sharing": replace(system, drive=sharing),
        "empty": system.with_values({"tank.start_m3": 0.0}),
        "short": system.with_values({"array.n_series": SHORT}),
        "short_sharing": replace(system, drive=sharing).with_values({"array.n_series": SHORT}),
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
    machines = [machine_row(name, *of, u) for name, of in MACHINES.items() for u in VOLTAGES]
    written("motors.csv", machines)
    written("size_time.csv", [time_row(example) for example in EXAMPLES])


if __name__ == "__main__":
    main()
