"""Processor time of a flux map from a geometry, over the number of unknowns and of nodes.

    python bench/geometry_cost.py [--out FILE.csv]

One thread (OPENBLAS_NUM_THREADS=1 keeps it so). The 8/6 and 12/8 machines of machines/geometry; the
mesh as it is, and with cells half as long again and two thirds as long. Column
`load` is the system's load average at the end: above the number of cores, the times are upper
bounds.
"""

import argparse
import os
import resource
import tempfile
import time
from pathlib import Path

import numpy as np

from reluctance.base.schema import checked
from reluctance.base.table_file import write_table
from reluctance.base.toml_file import read_toml
from reluctance.machine.geometry.file import Geometry
from reluctance.machine.geometry.mesh import Grid
from reluctance.machine.geometry.solved import solved
from reluctance.machine.library import flattened

ROOT = Path(__file__).parents[1]
MACHINES = ("emdlab_8_6", "own_12_8")
NODES = ((31, 20), (31, 11), (16, 11))
LENGTHS = (1.5, 1.0, 2 / 3)  # of the cells, against the usual ones


def measured(name: str, length: float, angles: int, currents: int) -> dict[str, float | str]:
    """One map with its forces, as `reluctance machine from-geometry` solves it."""
    table = flattened(read_toml(ROOT / "machines" / "geometry" / f"{name}.toml"))
    del table["model"]
    table["map"] = {**table["map"], "angles": angles, "currents": currents}
    geometry = checked(Geometry, table, name)
    with tempfile.TemporaryDirectory() as cache:
        os.environ["RELUCTANCE_CACHE"] = cache
        began = time.process_time()
        solution = solved(geometry, grid=Grid(length * Grid().cell, length * Grid().growth))
        took = time.process_time() - began
    return {
        "machine": name,
        "unknowns": round(solution.unknowns),
        "angles": angles,
        "currents": currents,
        "newton_steps": round(solution.steps),
        "processor_s": round(took, 2),
        "memory_MB": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024),
        "load": round(os.getloadavg()[0], 1),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path(__file__).with_name("geometry_cost.csv"))
    options = parser.parse_args()
    rows = []
    for name in MACHINES:
        cases = [(1.0, *nodes) for nodes in NODES] + [(length, 13, 6) for length in LENGTHS]
        for case in cases:
            rows.append(measured(name, *case))
            print(rows[-1], flush=True)
    write_table(options.out, {key: np.array([row[key] for row in rows]) for key in rows[0]})


if __name__ == "__main__":
    main()
