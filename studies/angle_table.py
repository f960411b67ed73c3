"""What conduction angles from a table over speed and torque gain over fixed ones.

    python studies/angle_table.py [--out DIR]

`examples/angle_table.toml` on a locked shaft, between the nodes of its table and at them; and the
same with the fixed angles that the law's rule chooses for the greatest speed and torque of that
drive. The current for a torque is computed for each speed, so that both give the same mean torque.
Writes angle_table.csv and angle_table.png.
"""

import argparse
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import reluctance as rl
from reluctance.base.table_file import write_table
from reluctance.drive.laws.angles import Angles

ROOT = Path(__file__).parents[1]
DRIVE = ROOT / "examples" / "angle_table.toml"
LOCKED = ["load.kind=locked", "load.k_fan_Nms2=", "load.speed_rpm=3000"]
LOCKED += ["reference.kind=torque", "reference.speed_rpm=", "reference.tau_Nm=45"]
SPEEDS = [500, 750, 1000, 1500, 1750, 2000, 2500, 2750, 3000]
TORQUES = [5, 10, 20, 30, 40, 45]
UNTIL = 0.06  # ten electrical periods at 500 rpm are longer; from there two count
FIGURES = ("p_cu_W", "i_rms_A", "torque_ripple_rms", "tau_mean_Nm")


def fixed(drive: rl.Drive) -> dict[str, object]:
    """The values of the drive with the angles of the law's rule at its own working point."""
    rule = drive.with_values({"control.angle_table": None})
    assert isinstance(rule.control, Angles)
    on, off = np.degrees(rule.control.window(rule.known()))
    return {
        "control.angle_table": None,
        "control.theta_on_deg": round(float(on), 3),
        "control.theta_off_deg": round(float(off), 3),
    }


def compared() -> dict[str, np.ndarray]:
    """Columns over the grid."""
    whole = rl.load(DRIVE)
    held = rl.load(DRIVE, LOCKED)
    grid = {"load.speed_rpm": SPEEDS, "reference.tau_Nm": TORQUES}
    angles = fixed(whole)
    print({k: v for k, v in angles.items() if v is not None})
    drives = {"table": held, "fixed": held.with_values(angles)}
    found = {name: rl.sweep(drive, grid, until=UNTIL) for name, drive in drives.items()}
    columns = {
        "speed_rpm": np.array(found["table"].values["load.speed_rpm"]),
        "torque_Nm": np.array(found["table"].values["reference.tau_Nm"]),
    }
    for figure in FIGURES:
        for name, sweep in found.items():
            stem, _, unit = figure.rpartition("_")
            column = f"{stem}_{name}_{unit}" if unit[:1].isupper() else f"{figure}_{name}"
            columns[column] = sweep.figures[figure]
    columns["copper_saved"] = 1 - columns["p_cu_table_W"] / columns["p_cu_fixed_W"]
    return columns


def drawn(columns: dict[str, np.ndarray], path: Path) -> None:
    shape = (len(SPEEDS), len(TORQUES))
    figure, axes = plt.subplots(1, 2, figsize=(10, 3.8), layout="constrained", sharey=True)
    ripple = columns["torque_ripple_rms_table"] - columns["torque_ripple_rms_fixed"]
    panels = {
        "copper loss saved (%)": 100 * columns["copper_saved"],
        "torque ripple, rms over mean: change (percentage points)": 100 * ripple,
    }
    for ax, (title, values) in zip(axes, panels.items(), strict=True):
        most = float(np.nanmax(np.abs(values)))
        mesh = ax.pcolormesh(
            SPEEDS, TORQUES, values.reshape(shape).T, shading="gouraud", cmap="RdBu_r",
            vmin=-most, vmax=most,
        )  # fmt: skip
        figure.colorbar(mesh, ax=ax)
        lines = ax.contour(SPEEDS, TORQUES, values.reshape(shape).T, colors="k", linewidths=0.6)
        ax.clabel(lines, fontsize=7)
        ax.set(xlabel="speed (rpm)", title=title)
    axes[0].set(ylabel="torque (N m)")
    figure.savefig(path, dpi=120)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "control")
    out = parser.parse_args().out
    columns = compared()
    write_table(out / "angle_table.csv", columns)
    drawn(columns, out / "angle_table.png")


if __name__ == "__main__":
    main()
