"""A solved geometry as a machine file with its flux map next to it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from reluctance.base.errors import ParameterError
from reluctance.base.files import check_ending
from reluctance.base.unedited import write_unedited
from reluctance.machine.coupling import Coupling
from reluctance.machine.geometry.file import Geometry
from reluctance.machine.geometry.geometry_machine import machine_keys
from reluctance.machine.geometry.solved import Solution
from reluctance.machine.map_file import quoted
from reluctance.machine.maps.check import check_map
from reluctance.machine.maps.importers import write_map
from reluctance.machine.maps.pole_force import write_pole_force
from reluctance.machine.pair_file import write_pairs


def write_machine(
    geometry: Geometry,
    solution: Solution,
    out: Path,
    *,
    made_of: str,
    coupling: Coupling | None = None,
) -> list[Path]:
    """Writes MACHINE.toml, MACHINE.csv, MACHINE_force.csv, and with pairs MACHINE_pairs.csv; all
    or none.

    Raises
    ------
    ParameterError
        If a file cannot be put there, or one is there that was edited.
    """
    check_ending(out, {".toml"})
    report = check_map(solution.table(geometry.rotor_poles))
    if report.verdict != "good":
        raise ParameterError(
            f"the map of {geometry.map.angles} angles x {geometry.map.currents} currents cannot be "
            f"used ({report.reasons[0]}); raise [map] angles or currents, or check the dimensions"
        )
    table, force, pairs = files_of(out, pairs=True)
    text = machine_text(geometry, solution, table.name, made_of)
    text += f"force_map = {quoted(force.name)}\n"
    files: dict[Path, Callable[[Path], object]] = {
        table: lambda path: write_map(solution.table(geometry.rotor_poles), path),
        force: lambda path: write_pole_force(solution.force_table, path),
    }
    if coupling is not None:
        text += f"pairs = {quoted(pairs.name)}\n"
        files[pairs] = lambda path: write_pairs(coupling, path)
    write_unedited(out, text, files)
    return [out, *files]


def files_of(out: Path, *, pairs: bool) -> list[Path]:
    """The files beside a machine file: map, radial force, and table of pairs."""
    ends = ("_force", "_pairs") if pairs else ("_force",)
    return [out.with_suffix(".csv"), *(out.with_name(f"{out.stem}{end}.csv") for end in ends)]


def machine_text(geometry: Geometry, solution: Solution, map_name: str, made_of: str) -> str:
    """The machine file. What it has no key for stands in its first lines."""
    s = solution
    values = machine_keys(geometry, s, rounded)
    values["source"] += f"; map computed from {made_of} (2-D field)"
    values |= {"model": "map", "map": map_name, "angle_kind": "electrical", "zero": "unaligned"}
    notes = [
        f"# Computed from {made_of}: 2-D field, {s.unknowns:.0f} unknowns. The map is of one phase "
        "alone.",
        f"# End windings {1e3 * s.L_end_H:.4g} mH a phase (in the map), wire "
        f"{1e6 * s.wire_area_m2:.3g} mm2, copper {s.copper_kg:.3g} kg, iron "
        f"{s.stator_iron_kg:.3g} + {s.rotor_iron_kg:.3g} kg.",
    ]
    lines = [f"{key} = {quoted(v) if isinstance(v, str) else repr(v)}" for key, v in values.items()]
    return "\n".join([*notes, "[machine]", *lines]) + "\n"


def rounded(value: float) -> float:
    """To four digits: more than the estimates are good for."""
    return float(f"{value:.4g}")
