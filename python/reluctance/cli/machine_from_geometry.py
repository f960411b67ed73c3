"""`reluctance machine from-geometry`: from a lamination to a machine file."""

import json
from pathlib import Path
from typing import Annotated

import typer

from reluctance.cli.lines import wrapped
from reluctance.cli.options import AsJson, Plot, help_if_bare

machine_app = typer.Typer(
    invoke_without_command=True,
    callback=help_if_bare,
    rich_markup_mode=None,
    help="Make a machine file from a geometry.",
)


CHANGES = ("psi_change", "tau_change", "tau_rough")
CONVERGED = 0.05  # of the greatest of the points; machines of the library stay below 0.5 %


@machine_app.command("from-geometry")
def from_geometry(
    geometry: Annotated[Path, typer.Argument(metavar="GEOMETRY.toml", help="Geometry file.")],
    out: Annotated[
        Path | None, typer.Option(metavar="MACHINE.toml", help="Machine file to write.")
    ] = None,
    plot: Plot = None,
    convergence: Annotated[
        bool, typer.Option("--convergence", help="Judge the mesh at five angles, too.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Make a machine file from a dimensioned lamination. Solves its field."""
    from reluctance.base.errors import ParameterError
    from reluctance.base.figures import check_figure
    from reluctance.base.files import check_ending
    from reluctance.base.unedited import check_unedited
    from reluctance.cli.progress import progress_bar
    from reluctance.machine.geometry import convergence as doubled
    from reluctance.machine.geometry.from_geometry import machine_from_geometry
    from reluctance.machine.geometry.write_geometry import files_of

    if out is not None:
        check_ending(out, {".toml"})
        check_unedited(out, files_of(out, pairs=False))
    if plot is not None:
        check_figure(plot)
    with progress_bar(f"solving {geometry.name}", 1.0) as told:
        found = machine_from_geometry(geometry, progress=told)
    points = doubled(found.geometry) if convergence else []
    moves = max((abs(point[key]) for point in points for key in CHANGES), default=0.0)
    if moves > CONVERGED:
        raise ParameterError(
            f"{geometry}: a mesh with twice as many cells, or a little turn of the rotor, moves "
            f"flux linkage or torque by {100 * moves:.3g} %, need at most {100 * CONVERGED:g} %: "
            "this map is not to be used; check gap and pole arcs"
        )
    written = found.save(out) if out is not None else []
    if plot is not None:
        found.plot(plot)
        written.append(plot)
    if as_json:
        print(json.dumps({**found.figures, "convergence": points}))
        return
    for line in found.lines():
        print(wrapped(line))
    for point in points:
        line = (
            f"mesh doubled at {point['theta_e_deg']:g} deg el.: flux linkage moves by "
            f"{100 * point['psi_change']:+.3f} %, torque by {100 * point['tau_change']:+.3f} %; "
            f"torque and slope of the co-energy differ by {100 * point['tau_rough']:+.3f} %"
        )
        print(wrapped(line))
    if points:
        print(f"the mesh is fine enough: no change over {100 * CONVERGED:g} %")
    for path in written:
        print(path)
    if out is not None:
        print(f"next: reluctance run DRIVE.toml --set machine={out}")
