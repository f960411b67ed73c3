"""Question: how smooth is the torque of a machine whose phases couple, and what does it help that
the controller knows the pairs?

    python studies/coupling.py [--out DIR] [--machines 6/4,6/4_6kW] [--laws NAME,NAME]

Four machines of machines/geometry, with all neighbours of one polarity (NN), of two (NS), and with
one NS pair among NN, as a winding in groups has it (groups), at 1500 rpm. The last one has torque
and voltage of the source paper's machine. The poles of a phase
alternate, so that an odd number of pairs is NS: no winding has NN alone, and none of four phases
has NS alone. They are here at their purest, with the tables of the field of the machine. The dc
link has three times the voltage that brings the flux linkage of the aligned pole at rated current
up in half a period, and the rated torque is two thirds of the greatest one without ripple of phases
that do not couple.

Writes coupling.csv: rms torque error in per cent of the reference on phases that do not couple, of
a controller that knows no pairs (blind) and of one that does (aware), the mean torque of both, and
the error with pairs that are believed 20 % too small or too large. Rows of machines and laws that
are not asked for stay as they are. Draws coupling.png of it. The fields of four machines take six
minutes where they are not in the cache.
"""

from __future__ import annotations

import argparse
import csv
import tempfile
from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import reluctance as rl
from reluctance.base.errors import ParameterError
from reluctance.base.schema import checked
from reluctance.base.toml_file import read_toml
from reluctance.machine.coupling import Coupling, Neighbours
from reluctance.machine.geometry.coupling_of import phase_of
from reluctance.machine.geometry.file import Geometry
from reluctance.machine.geometry.pairs import kind_of, pairs_solved
from reluctance.machine.library import flattened, machine_from, machine_table
from reluctance.machine.machine_file import MachineFile
from reluctance.machine.maps.pairs import PairTable, pair_table
from reluctance.machine.optimum import torque_speed_envelope
from reluctance.machine.pair_file import write_pairs

ROOT = Path(__file__).parents[1]
MACHINES = {
    "6/4": "onelab_6_4",
    "8/6": "emdlab_8_6",
    "12/8": "own_12_8",
    "6/4_6kW": "emdlab_6_4_6kw",
}
LAWS = {  # and the example whose [control], [sensing] and [simulation] it has
    "edge_mpc_2us": "edge_mpc_fpga",
    "edge_mpc_20us": "edge_mpc_mcu",
    "finite_set_mpc": "finite_set_mpc",
    "deadbeat": "deadbeat",
    "sharing_cubic": "sharing_cubic",
    "ditc": "ditc",
    "paper_mpc": "paper_rated",
}
LOADS = (1.0, 0.5, 0.25)  # of the rated torque
RANK = 3
RPM = 1500.0
RATED = 2 / 3  # of the last current of the map, and of the greatest torque without ripple
VOLTAGE = 3.0  # over the mean one that builds up the flux of a phase in half a period
WRONG = (0.8, 1.2)
TICKS = (0.1, 0.2, 0.5, 1, 2, 5, 10)  # of the figure [%]
UNTIL = 0.12  # [s]


@dataclass(frozen=True)
class Point:
    """A machine file with its pairs, and where it works."""

    name: str
    kind: str
    path: Path
    u_dc: float  # [V]
    tau: float  # rated [N m]
    i_max: float  # [A]


def tables(name: str) -> tuple[Geometry, dict[str, PairTable]]:
    """The geometry, and the table of each kind of its pairs."""
    given = flattened(read_toml(ROOT / "machines" / "geometry" / f"{name}.toml"))
    geometry = checked(Geometry, {k: v for k, v in given.items() if k != "model"}, name)
    first = {all(kind_of(geometry, k)): k for k in reversed(range(geometry.phases))}
    poles = sorted(first.values())
    solved = pairs_solved(geometry, poles)
    found = {
        kind: pair_table(solved.samples(poles.index(first[like])), geometry.rotor_poles, rank=RANK)
        for kind, like in (("NN", True), ("NS", False))
    }
    return geometry, found


def points(title: str, folder: Path) -> list[Point]:
    """Both polarities of a machine, and groups."""
    name = MACHINES[title]
    geometry, of_kind = tables(name)
    library = ROOT / "machines"
    machine = machine_from(machine_table(name, Path()))
    omega = RPM * np.pi / 30
    u_dc = _rounded(VOLTAGE * float(machine.psi(RATED * machine.i_max_A, np.pi)) * _pace(machine))
    best = torque_speed_envelope(machine.at(u_dc=u_dc, omega_m=omega), omega)
    tau = _rounded(RATED * float(best.tau_max[0]))
    found, n = [], geometry.phases
    kinds = {kind: [kind] * n for kind in of_kind} | {"groups": ["NN"] * (n - 1) + ["NS"]}
    for kind, of_pair in kinds.items():
        pairs = [
            Neighbours(phase_of(geometry, k), phase_of(geometry, k + 1), of_kind[name])
            for k, name in enumerate(of_pair)
        ]
        path = folder / f"{name}_{kind}.toml"
        write_pairs(Coupling(n, tuple(pairs)), path.with_suffix(".csv"))
        text = (library / f"{name}.toml").read_text(encoding="utf-8")
        for file in (f"{name}.csv", f"{name}_force.csv"):
            text = text.replace(f'"{file}"', f'"{library / file}"')
        path.write_text(f'{text.rstrip()}\npairs = "{path.stem}.csv"\n', encoding="utf-8")
        found.append(Point(title, kind, path, u_dc, tau, machine.i_max_A))
    return found


def _pace(machine: MachineFile) -> float:
    """Half periods in a second."""
    return machine.N_r * RPM / 30


def _rounded(value: float) -> float:
    return float(f"{value:.3g}")


def drive(at: Point, example: str, load: float) -> rl.Drive:
    """An example of a law on a machine of this study."""
    given = rl.load(ROOT / "examples" / f"{example}.toml").tables()
    values = {
        "converter.u_dc_V": at.u_dc,
        "load.speed_rpm": RPM,
        "reference.tau_Nm": load * at.tau,
        "control.tau_max_Nm": at.tau,
    }
    if given["sensing"].get("i_range_A"):
        values["sensing.i_range_A"] = _rounded(1.5 * at.i_max)
    if "i_band_A" in given["control"]:
        values["control.i_band_A"] = 0.01 * at.i_max
    return rl.load(
        ROOT / "examples" / f"{example}.toml",
        [f"machine={at.path}", *(f"{key}={value!r}" for key, value in values.items())],
    )


def row(at: Point, law: str, load: float) -> dict[str, str]:
    """Uncoupled, blind, aware, and with wrong pairs."""
    given = drive(at, LAWS[law], load)
    changes: dict[str, dict[str, bool | float]] = {
        "uncoupled": {"machine.pair_factor": 0.0},
        "blind": {"control.pair_torque": False},
        "aware": {},
        **{f"pairs_{x:g}": {"mismatch.pair_factor": x} for x in WRONG},
    }
    found = {"machine": at.name, "pairs": at.kind, "law": law, "load": f"{load:g}"}
    found |= {"u_dc_V": f"{at.u_dc:g}", "tau_Nm": f"{load * at.tau:.4g}"}
    for name, change in changes.items():
        k = rl.simulate(given.with_values(change), until=UNTIL, record=None).kpis
        found[f"{name}_pct"] = f"{100 * (k.torque_error_rms or np.nan):.3g}"
        if name in ("blind", "aware"):
            found[f"{name}_mean_pct"] = f"{100 * (k.tau_mean / (load * at.tau) - 1):+.2f}"
        if name in ("uncoupled", "aware"):
            found[f"{name}_i_rms_A"] = f"{k.i_rms:.4g}"
    return found


def among(path: Path, rows: list[dict[str, str]]) -> list[dict[str, str]]:
    """These rows, in the place of those that a table has of the same machines and laws."""
    names = ("machine", "law")
    new = {tuple(row[name] for name in names) for row in rows}
    if path.exists():
        with path.open(newline="", encoding="utf-8") as file:
            old = [r for r in csv.DictReader(file) if tuple(r[n] for n in names) not in new]
        rows = old + rows
    kinds = ("NN", "NS", "groups")
    titles, laws = list(MACHINES), list(LAWS)
    return sorted(
        rows,
        key=lambda row: (
            *(titles.index(row["machine"]), kinds.index(row["pairs"]), laws.index(row["law"])),
            -float(row["load"]),
        ),
    )


def draw(rows: list[dict[str, str]], path: Path) -> None:
    """Rms torque error of each law at rated torque: three points a machine and kind of pairs."""
    titles = list(dict.fromkeys(row["machine"] for row in rows))
    size = (1 + 3 * len(titles), 5.2)
    figure, grid = plt.subplots(1, len(titles), figsize=size, sharex=True, sharey=True)
    axes = np.atleast_1d(grid)
    marks = (("uncoupled", "o", "#888888"), ("blind", "x", "#D55E00"), ("aware", "s", "#0072B2"))
    for ax, title in zip(axes, titles, strict=True):
        here = [r for r in rows if r["machine"] == title and r["load"] == "1"]
        names = [f"{r['law']}, {r['pairs']}" for r in here]
        for what, mark, colour in marks:
            values = [float(r[f"{what}_pct"]) for r in here]
            ax.plot(values, range(len(here)), mark, color=colour, label=what, markersize=5)
        ax.set_yticks(range(len(here)), names, fontsize=7)
        ax.invert_yaxis()
        ax.set_xscale("log")
        ax.set_xticks(TICKS, [f"{x:g}" for x in TICKS])
        ax.minorticks_off()
        ax.tick_params(axis="x", labelsize=7)
        ax.set_title(f"{title} machine", fontsize=9)
        ax.set_xlabel("rms torque error [%]", fontsize=8)
        ax.grid(True, axis="x", which="both", alpha=0.3)
    axes[0].set_xlim(0.1, 10)
    figure.set_layout_engine("constrained")
    marked = axes[0].get_legend_handles_labels()
    figure.legend(*marked, fontsize=8, loc="outside lower center", ncols=3)
    figure.savefig(path, dpi=130)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "control")
    parser.add_argument("--machines", default=",".join(MACHINES))
    parser.add_argument("--laws", default="")
    given = parser.parse_args()
    laws = [law for law in LAWS if not given.laws or law in given.laws.split(",")]
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for title in given.machines.split(","):
            for at in points(title, Path(folder)):
                for law in laws:
                    for load in LOADS:
                        try:
                            rows.append(row(at, law, load))
                            print(rows[-1], flush=True)
                        except ParameterError as fault:
                            print(f"{title} {at.kind} {law} {load:g}: {fault}", flush=True)
    rows = among(given.out / "coupling.csv", rows)
    with (given.out / "coupling.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    draw(rows, given.out / "coupling.png")


if __name__ == "__main__":
    main()
