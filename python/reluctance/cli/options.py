"""Arguments and options that several commands share."""

from pathlib import Path
from typing import Annotated

import typer

DriveFile = Annotated[Path, typer.Argument(metavar="DRIVE.toml", help="Drive file.")]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="SECTION.KEY=VALUE",
        help="Replace a value of the drive file; SECTION.KEY= removes it.",
    ),
]
Trust = Annotated[
    bool, typer.Option("--trust", help="Run the code that is named: control laws of your own.")
]
Plot = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Figure: .png, .svg, .pdf, or .html with zoom.")
]
Width = Annotated[
    str | None, typer.Option(metavar="WIDTH", help="Of the figure, as 3.5in or 88mm.")
]
Style = Annotated[
    str | None, typer.Option(metavar="STYLE", help="Of Matplotlib, by name or as a .mplstyle file.")
]
AsJson = Annotated[
    bool, typer.Option("--json", help="Print one JSON object; notes go to standard error.")
]


def help_if_bare(context: typer.Context) -> None:
    """Prints the help of a group that is called without a command."""
    if context.invoked_subcommand is None:
        print(context.get_help())
        raise typer.Exit
