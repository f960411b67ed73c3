"""What the studio's page reads: one blob a drive, and one file about all of them."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.base.files import make_folder, write_together
from reluctance.drive.drive import Drive
from reluctance.drive.run.energy_loop import CURVES_DEG
from reluctance.explore import limits
from reluctance.targets.export.blob import blob
from reluctance.targets.studio.controls import controls_of
from reluctance.targets.studio.starts import STARTS, Start

CURVE_POINTS = 25


def write_data(folder: str | Path) -> list[Path]:
    """Write the drives of the studio into a folder.

    Returns
    -------
    list of Path
        `drives.json` and the blobs: all of them appear, or none does.

    Raises
    ------
    ParameterError
        If the folder cannot be made or written to.
    """
    folder = make_folder(Path(folder))
    files: dict[Path, Callable[[Path], object]] = {}
    told = []
    for start in STARTS:
        drive = start.drive()
        content = blob(drive, record=0.0)
        files[folder / f"{start.name}.srm"] = partial(_put, content)
        told.append(about(start, drive))
    text = json.dumps(told, separators=(",", ":"), ensure_ascii=False)
    index = {folder / "drives.json": partial(_put, text.encode())}
    write_together(index | files)
    return [*index, *files]


def _put(content: bytes, path: Path) -> None:
    path.write_bytes(content)


def about(start: Start, drive: Drive) -> dict[str, Any]:
    """All that the page knows of a drive besides its blob."""
    machine = drive.machine
    return {
        "name": start.name,
        "machine": machine.name,
        "law": drive.control.law,
        "title": start.title or drive.control.title or start.law,
        "N_s": machine.N_s,
        "N_r": machine.N_r,
        "n_phases": machine.n_phases,
        "i_max": machine.i_max_A,
        "R": machine.R_ohm,
        "i_known": min(float(machine.i_known_A), 1e12),
        "follows_torque": drive.control.follows_torque,
        "supervised": drive.supervision.on,
        "until": drive.simulation.until_s,
        "tables": given_tables(start, drive),
        "controls": controls_of(drive),
        "limit": limit(drive),
        "curves": curves(drive),
    }


def given_tables(start: Start, drive: Drive) -> dict[str, Any]:
    """The drive file, with the machine by its name in the library."""
    import tomllib

    from reluctance.base.resources import resources

    example = tomllib.loads((resources("examples") / f"{start.example}.toml").read_text("utf-8"))
    tables = {name: table for name, table in drive.tables().items() if table}
    return {**tables, "machine": start.changes.get("machine", example["machine"])}


def limit(drive: Drive) -> dict[str, Any] | None:
    """`reluctance limit` at the drive's own operating point; None where it asks for no torque."""
    try:
        return dict(limits.limit(drive).with_units())
    except ParameterError:
        return None


def curves(drive: Drive) -> dict[str, Any]:
    """Flux linkage over current at some angles, for the picture behind the energy loop."""
    i = np.linspace(0, drive.machine.i_max_A, CURVE_POINTS)
    psi = [
        _core.magnetics(drive.machine.magnetics, i, np.full_like(i, np.radians(angle)))[:, 0]
        for angle in CURVES_DEG
    ]
    return {
        "deg": CURVES_DEG,
        "i": [float(f"{v:.5g}") for v in i],
        "psi": [[float(f"{v:.5g}") for v in one] for one in psi],
    }
