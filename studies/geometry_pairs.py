"""Question: how much do two neighbouring phases change each other, and how small a table holds it?

    python studies/geometry_pairs.py [--out DIR] [--points N]

Two machines of machines/geometry with neighbouring poles of one polarity (NN) and of two (NS). At
random angles and currents up to the last one of the map, fields of both phases and of each alone
give what a pair adds; a table of each rank is held against it. The rated current is two thirds of
the last one. Torques are in per cent of the peak of one phase at rated current, flux linkages in
per cent of the aligned one there.

Writes geometry_pairs.csv, a row for each machine and polarity.
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

import numpy as np

from reluctance.base.schema import checked
from reluctance.base.toml_file import read_toml
from reluctance.machine.coupling import apart
from reluctance.machine.geometry.file import Geometry
from reluctance.machine.geometry.pairs import ANGLES, currents, kind_of, sample_pair
from reluctance.machine.geometry.position import at_angle
from reluctance.machine.geometry.samples import rotor_angle, sample
from reluctance.machine.geometry.solve import solve
from reluctance.machine.geometry.solved import system_of
from reluctance.machine.geometry.steel import Array
from reluctance.machine.geometry.system import System
from reluctance.machine.library import flattened
from reluctance.machine.maps.pairs import pair_table

ROOT = Path(__file__).parents[1]
MACHINES = ("onelab_6_4", "own_12_8")
RANKS = (1, 2, 3, 4)
RATED = 2 / 3  # of the last current
POINTS = 60
SEED = 1


def kinds() -> list[tuple[str, str, Geometry, int]]:
    """Machine, NN or NS, geometry, and the first pole of such a pair. The poles stand in groups, so
    that a winding has both."""
    found = []
    for name in MACHINES:
        table = flattened(read_toml(ROOT / "machines" / "geometry" / f"{name}.toml"))
        geometry = checked(Geometry, {k: v for k, v in table.items() if k != "model"}, name)
        first = {all(kind_of(geometry, k)): k for k in reversed(range(geometry.phases))}
        found += [(name, "NN", geometry, first[True]), (name, "NS", geometry, first[False])]
    return found


def of_fields(system: System, pole: int, phi: float, a: float, b: float) -> Array:
    """Torque [N m] and flux linkage of the first phase [Wb] with both less each phase alone."""
    n = system.winding.n_phases
    delta = apart(0, system.section.N_r * n // system.section.N_s, n)
    position = at_angle(system, rotor_angle(system, phi + delta / 2, pole))
    first, second = np.eye(n)[pole % n], np.eye(n)[(pole + 1) % n]
    both, one, other = (
        solve(position, i, tolerance=1e-6) for i in (a * first + b * second, a * first, b * second)
    )
    return np.array([both.tau - one.tau - other.tau, (both.psi - one.psi) @ first])


def row(
    name: str, polarity: str, geometry: Geometry, pole: int, n_points: int
) -> dict[str, str | int]:
    """What the tables of all ranks leave at random points."""
    random = np.random.default_rng(SEED)
    system, i_max = system_of(geometry), geometry.map.current_max_A
    samples = sample_pair(system, pole, np.linspace(0, np.pi, ANGLES), currents(i_max))
    alone = sample(system, np.array([0, RATED * i_max]), np.linspace(0, np.pi, 31))
    phi = random.uniform(-np.pi, np.pi, n_points)
    a, b = random.uniform(0, i_max, (2, n_points))
    exact = np.array([of_fields(system, pole, *x) for x in zip(phi, a, b, strict=True)]).T
    found: dict[str, str | int] = {
        "pair": f"{geometry.stator_poles}/{geometry.rotor_poles} {polarity}",
        "machine": name,
        "points": n_points,
    }

    def put(key: str, tau: Array, psi: Array) -> None:
        error = 100 * tau / alone.tau.max()
        found[f"tau_{key}_rms_pct"] = f"{np.sqrt(np.mean(error**2)):.3g}"
        found[f"tau_{key}_max_pct"] = f"{np.abs(error).max():.3g}"
        found[f"psi_{key}_rms_pct"] = f"{100 * np.sqrt(np.mean(psi**2)) / alone.psi.max():.3g}"

    put("none", *exact)
    for rank in RANKS:
        table = pair_table(samples, geometry.rotor_poles, rank=rank)
        state = table.at(phi, a, b)
        put(f"rank{rank}", state.tau - exact[0], state.psi_first - exact[1])
        found[f"numbers_rank{rank}"] = table.numbers
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=ROOT / "docs")
    parser.add_argument("--points", type=int, default=POINTS, help="random points of each pair")
    arguments = parser.parse_args()
    rows = []
    for kind in kinds():
        rows.append(row(*kind, arguments.points))
        print(rows[-1], flush=True)
    with (arguments.out / "geometry_pairs.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
