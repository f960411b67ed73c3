"""Question: what does each example drive achieve, and what would the machine allow?

    python studies/results.py [--out DIR]

Writes results.csv, one row per example: the key figures of the run, and the rms current and copper
loss of the limit (`reluctance limit`) where the example has a torque reference at held speed.
Writes overview.png, the picture of the README: torque of one electrical period under three laws.
"""

from __future__ import annotations

import argparse
import csv
import json
import subprocess
import sys
from pathlib import Path

from matplotlib.figure import Figure

import reluctance as rl
from reluctance.base.key_figures import definite
from reluctance.base.picture import Picture

ROOT = Path(__file__).parents[1]
EXAMPLES = sorted(p for p in (ROOT / "examples").glob("*.toml") if "[site]" not in p.read_text())
# Of the computer, zero, or of drives that trip
LEFT_OUT = ("wall_s_per_sim_s", "control_period_s", "energy_residual", "t_trip_s")
LIMIT = {"i_rms_A": "limit_i_rms_A", "p_cu_W": "limit_p_cu_W"}
LAWS = {
    "pwm_current": "flat current pulses",
    "sharing_cubic": "cubic torque sharing",
    "edge_mpc_mcu": "predictive law edge_mpc",
}
COLOURS = ("#d1495b", "#edae49", "#0b5d8f")


def limit(path: Path) -> dict[str, float]:
    """Least rms current and copper loss at the drive's operating point."""
    program = Path(sys.executable).with_name("reluctance")
    done = subprocess.run(
        [program, "limit", path, "--json"], capture_output=True, encoding="utf-8", check=True
    )
    figures = json.loads(done.stdout)
    return {name: figures[key] for key, name in LIMIT.items()}


def row(path: Path) -> dict[str, float | str | None]:
    """One example."""
    drive = rl.load(path)
    kpis = rl.simulate(drive, record=None).kpis.with_units()
    kept = {name: value for name, value in kpis.items() if name not in LEFT_OUT}
    held = drive.load.kind == "locked" and drive.reference.kind == "torque"
    held = held and drive.converter.bridge == "asymmetric"  # else there is no limit
    return {"example": path.stem, **kept, **(limit(path) if held else {})}


def written(value: float | str | None) -> str:
    """Six digits: enough for a page, and the same on every computer."""
    return value if isinstance(value, str) else "" if value is None else f"{value:.6g}"


def overview() -> Figure:
    """Torque over one electrical period: three laws at the rated point of the paper's machine."""
    figure = Picture(9, 3.6)
    ax = figure.subplots()
    for (name, label), colour in zip(LAWS.items(), COLOURS, strict=True):
        result = rl.simulate(rl.load(ROOT / "examples" / f"{name}.toml"))
        period = 2 * 3.141592653589793 / result.drive.machine.N_r / result.omega_m[-1]
        last = result.t > result.t[-1] - period
        kpis = result.kpis.with_units()
        error, f_switch = kpis["torque_error_rms"], kpis["f_switch_Hz"]
        text = (
            f"{label}: {100 * definite(error):.2f} % rms error, {definite(f_switch) / 1e3:.0f} kHz"
        )
        time = 1e3 * (result.t[last] - result.t[last][0])
        ax.plot(time, result.tau[last], lw=1, color=colour, label=text)
    ax.axhline(41.339, color="k", ls="--", lw=0.8, label="reference: 41.339 N m")
    ax.set(xlabel="time (ms)", ylabel="torque (N m)", ylim=(20, 58), xlim=(0, 10))
    ax.spines[["top", "right"]].set_visible(False)
    ax.grid(alpha=0.3)
    ax.legend(ncols=2, loc="upper center", frameon=False, fontsize=9)
    return figure


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=ROOT / "docs")
    out: Path = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    rows = [row(path) for path in EXAMPLES]
    columns = list(dict.fromkeys(name for found in rows for name in found))
    with (out / "results.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows([written(found.get(name)) for name in columns] for found in rows)
    overview().savefig(out / "overview.png", dpi=110, metadata={"Software": None})


if __name__ == "__main__":
    main()
