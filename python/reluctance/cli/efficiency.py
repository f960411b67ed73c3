"""`reluctance efficiency`: losses and ripple of a control law over speed and torque."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from reluctance.cli.options import AsJson, DriveFile, Overrides, Plot, Style, Trust, Width


def efficiency(
    drive_file: DriveFile,
    speed: Annotated[
        str | None,
        typer.Option(
            metavar="FROM:TO:COUNT", help="Speeds in rpm, all > 0, or a list as 500,1000."
        ),
    ] = None,
    torque: Annotated[
        str | None,
        typer.Option(
            metavar="FROM:TO:COUNT", help="Torques in N m; positive: motoring, negative: braking."
        ),
    ] = None,
    u_dc: Annotated[
        float | None, typer.Option("--u-dc", metavar="VOLTS", help="Instead of the drive's.")
    ] = None,
    cycle: Annotated[
        Path | None,
        typer.Option(metavar="CSV", help="Drive cycle: t_s, speed_rpm, tau_Nm."),
    ] = None,
    no_envelope: Annotated[
        bool, typer.Option("--no-envelope", help="Leave the limit out of the figure.")
    ] = False,
    overrides: Overrides = None,
    trust: Trust = False,
    as_json: AsJson = False,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Table: .csv, .npz, .parquet or .mat.")
    ] = None,
    plot: Plot = None,
    width: Width = None,
    style: Style = None,
    jobs: Annotated[
        int | None, typer.Option(metavar="N", help="Threads; by default all cores.")
    ] = None,
) -> None:
    """Efficiency, losses and ripple over speed and torque. Energy of a cycle."""
    import numpy as np

    from reluctance.base.figures import check_figures, look
    from reluctance.base.files import check_ending, refuse_input
    from reluctance.base.table_file import TABLES, write_table
    from reluctance.cli.progress import progress_bar
    from reluctance.drive.load import load
    from reluctance.explore.efficiency_map import driven, read_cycle
    from reluctance.explore.efficiency_map import efficiency as efficiency_over
    from reluctance.explore.efficiency_map.envelope import envelope_over
    from reluctance.explore.efficiency_map.text import as_object, rows
    from reluctance.explore.sweeps.vary import parsed

    speeds = None if speed is None else np.array(parsed(f"speed={speed}")[1], float) * np.pi / 30
    torques = None if torque is None else np.array(parsed(f"torque={torque}")[1], float)
    if out is not None:
        check_ending(out, TABLES)
        refuse_input(out, [cycle])
    check_figures([plot], style, width)
    points = None if cycle is None else read_cycle(cycle)
    drive = load(drive_file, overrides, trust=trust, check_torque=torque is None)
    braking = border = None
    with progress_bar(f"mapping {drive.name}", 1.0) as told:
        found = efficiency_over(
            drive, omega=speeds, tau=torques, u_dc=u_dc, jobs=jobs, progress=told
        )
    if points is not None and np.any(points.tau < 0) and found.tau[0] > 0:
        with progress_bar("mapping braking", 1.0) as told:
            braking = efficiency_over(
                drive, omega=found.omega, tau=-found.tau, u_dc=u_dc, jobs=jobs, progress=told
            )
        found = replace(found, ran=found.ran + braking.ran)
    taken = None if points is None else driven(points, found, braking)
    if out is not None:
        write_table(out, found.columns())
    if plot is not None:
        from reluctance.explore.efficiency_map import plots  # Matplotlib: half of the start-up time

        if not no_envelope:
            with progress_bar("searching the envelope", 1.0) as told:
                border = envelope_over(found, progress=told)
        with look(style, width):
            plots.save(found, plot, envelope=border, cycle=points, braking=braking)
    if as_json:
        print(json.dumps(as_object(found, taken)))
        return
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(title=Text(f"{drive.name}, {found.u_dc:g} V"), show_header=False)
    table.add_column("figure")
    table.add_column("value", justify="right")
    for label, value in rows(found, taken):
        table.add_row(label, value)
    Console().print(table)
    for path in (out, plot):
        if path is not None:
            print(path)
