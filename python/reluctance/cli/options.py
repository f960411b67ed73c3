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
        help="Replace a value of the drive file; without VALUE, remove it.",
    ),
]
Trust = Annotated[
    bool, typer.Option("--trust", help="Run the code that is named: control laws of your own.")
]
Plot = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Figure: .png, .svg, .pdf, or .html with zoom.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]


def help_if_bare(context: typer.Context) -> None:
    """Prints the help of a group that is called without a command."""
    if context.invoked_subcommand is None:
        print(context.get_help())
        raise typer.Exit
