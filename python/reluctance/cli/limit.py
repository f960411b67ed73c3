"""`reluctance limit`: what physics allows at a drive's operating point."""

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from reluctance.base.figures import check_figures, look
from reluctance.base.files import check_ending
from reluctance.base.table_file import TABLES
from reluctance.base.units import hertz, to_si
from reluctance.cli.options import AsJson, DriveFile, Overrides, Plot, Style, Trust, Width
from reluctance.cli.progress import progress_bar
from reluctance.drive.load import load


def limit(
    drive_file: DriveFile,
    tau: Annotated[
        float | None, typer.Option(metavar="NM", help="Torque, instead of the drive's reference.")
    ] = None,
    speed: Annotated[
        float | None, typer.Option(metavar="RPM", help="Speed, instead of the drive's.")
    ] = None,
    at_switching_frequency: Annotated[
        str | None, typer.Option(metavar="FREQUENCY", help="Also the least ripple there: 20kHz.")
    ] = None,
    overrides: Overrides = None,
    trust: Trust = False,
    as_json: AsJson = False,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Profile: .csv, .npz, .parquet or .mat."),
    ] = None,
    envelope: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Torque without ripple from standstill to twice the speed; endings as --out.",
        ),
    ] = None,
    plot: Plot = None,
    width: Width = None,
    style: Style = None,
) -> None:
    """What physics allows at the operating point. It holds for any controller."""
    from reluctance.explore import limits  # here, because SciPy and Matplotlib are slow to import
    from reluctance.explore.limits import envelope_of, files, text

    f_switch = None if at_switching_frequency is None else hertz(at_switching_frequency)
    for path in (out, envelope):
        if path is not None:
            check_ending(path, TABLES)
    check_figures([plot], style, width)
    found = limits.limit(
        load(drive_file, overrides, trust=trust, check_torque=tau is None),
        tau_ref=tau,
        omega_m=None if speed is None else to_si(speed, "rpm"),
        switching_frequency=f_switch,
    )
    if out is not None:
        files.save_profile(found, out)
    if envelope is not None or plot is not None:
        with progress_bar("searching the envelope", 1.0) as told:
            border = envelope_of(found, progress=told)
        if envelope is not None:
            files.save_envelope(border, envelope)
        if plot is not None:
            with look(style, width):
                files.save_figure(found, border, plot)
    if as_json:
        print(json.dumps(found.with_units()))
        return
    table = Table(title=Text(found.drive.name), show_header=False)
    table.add_column("figure")
    table.add_column("value", justify="right")
    for label, value in text.rows(found):
        table.add_row(label, value)
    Console().print(table)
    print(text.basis(found))
