"""`reluctance machine from-geometry`: from a lamination to a machine file."""

import json
from pathlib import Path
from typing import Annotated

import typer

from reluctance.cli.options import AsJson, Plot, help_if_bare

machine_app = typer.Typer(
    invoke_without_command=True,
    callback=help_if_bare,
    rich_markup_mode=None,
    help="Make a machine file from a geometry.",
)


@machine_app.command("from-geometry")
def from_geometry(
    geometry: Annotated[Path, typer.Argument(metavar="GEOMETRY.toml", help="Geometry file.")],
    out: Annotated[
        Path | None, typer.Option(metavar="MACHINE.toml", help="Machine file to write.")
    ] = None,
    plot: Plot = None,
    convergence: Annotated[
        bool, typer.Option("--convergence", help="Solve three points on a doubled mesh, too.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Solve the field of a cross-section and write flux map, resistance and inertia."""
    from reluctance.cli.progress import progress_bar
    from reluctance.figures import check_figure
    from reluctance.files import check_ending
    from reluctance.geometry import convergence as doubled
    from reluctance.machine.from_geometry import machine_from_geometry

    if out is not None:
        check_ending(out, {".toml"})
    if plot is not None:
        check_figure(plot)
    with progress_bar(f"solving {geometry.name}", 1.0) as told:
        found = machine_from_geometry(geometry, progress=told)
    points = doubled(found.geometry) if convergence else []
    written = found.save(out) if out is not None else []
    if plot is not None:
        found.plot(plot)
        written.append(plot)
    if as_json:
        print(json.dumps({**found.figures, "convergence": points}))
        return
    for line in found.lines():
        print(line)
    for point in points:
        print(
            f"mesh doubled at {point['theta_e_deg']:g} deg el.: flux linkage moves by "
            f"{100 * point['psi_change']:+.3f} %, torque by {100 * point['tau_change']:+.3f} %"
        )
    for path in written:
        print(path)
    if out is not None:
        print(f"next: reluctance run DRIVE.toml --set machine={out}")
