"""`reluctance paper`: the source paper, claim by claim."""

import shutil
import sys
from pathlib import Path
from typing import Annotated

import typer

from reluctance.cli.progress import progress_bar


def paper(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder of the report.")] = Path(
        "out/paper"
    ),
) -> None:
    """The source paper, claim by claim. Writes figures, claims.json and report.html."""
    from reluctance.paper import write  # figures are needed here alone, and slow to import
    from reluctance.paper.claim import HEADING, line

    with progress_bar("simulating the source paper's drive", 1.0) as told:
        report = write(out, progress=told)
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else None
    for text in (HEADING, *(line(row) for row in report.claims)):
        print(text[:width])
    print()
    for path in report.files:
        print(path)
