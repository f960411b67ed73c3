"""`reluctance compare`: control laws side by side."""

import json
from pathlib import Path
from typing import Annotated

import typer

from reluctance.base.figures import check_figures, look
from reluctance.base.files import check_folder
from reluctance.base.units import hertz
from reluctance.cli.lines import wrapped
from reluctance.cli.options import AsJson, DriveFile, Overrides, Plot, Style, Trust, Width
from reluctance.cli.progress import progress_bar
from reluctance.drive.laws.own_code import refuse_untrusted
from reluctance.drive.load import load


def compare(
    drive_file: DriveFile,
    controls: Annotated[
        str | None, typer.Option(metavar="A,B,C", help="Laws to compare, instead of all.")
    ] = None,
    at_switching_frequency: Annotated[
        str, typer.Option(metavar="FREQUENCY", help="Mean per switch, that every law is tuned to.")
    ] = "20kHz",
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for table and figure.")
    ] = None,
    plot: Plot = None,
    width: Width = None,
    style: Style = None,
    overrides: Overrides = None,
    trust: Trust = False,
    as_json: AsJson = False,
    as_markdown: Annotated[
        bool, typer.Option("--markdown", help="Print the table as Markdown.")
    ] = False,
) -> None:
    """Control laws side by side at equal switching frequency. Conditions are equal, too."""
    from reluctance.explore import comparison  # here, because SciPy is slow to import
    from reluctance.explore.comparison import conditions, table

    f_switch = hertz(at_switching_frequency)
    if out is not None:
        check_folder(out)
    check_figures([plot], style, width)
    drive = load(drive_file, overrides, trust=trust)
    names = None if controls is None else [name.strip() for name in controls.split(",")]
    refuse_untrusted(names or [], trust)
    with progress_bar("tuning control laws", 1.0) as told:
        found = comparison.compare(drive, names, f_switch=f_switch, progress=told)
    files = [] if out is None else comparison.write(found, out)
    if plot is not None:
        with look(style, width):
            comparison.save_figure(found, plot)
        files.append(plot)
    if as_json:
        print(json.dumps(table.as_json(found)))
        return
    for line in (*conditions.in_words(found.point, f_switch), table.limit_line(found), ""):
        print(wrapped(line))
    if as_markdown:
        print(table.markdown(found), end="")
    else:
        print(*table.plain(found), sep="\n")
    for path in files:
        print(path)
