"""The commands `reluctance law ...`: control laws of one's own."""

from pathlib import Path
from typing import Annotated

import typer

from reluctance.cli.progress import working
from reluctance.drive.laws.build import build_law

law_app = typer.Typer(no_args_is_help=True, help="Control laws of your own, in C++.")


@law_app.command("build")
def build(
    header: Annotated[Path, typer.Argument(metavar="LAW.hpp", help="Header with the law.")],
    name: Annotated[str, typer.Argument(metavar="NAME", help="Struct of the law.")],
    out: Annotated[
        Path | None, typer.Option(metavar="FILE.so", help="What to make; beside the header.")
    ] = None,
) -> None:
    """Compile a law, for `law = "cpp:FILE.so:NAME"` in a drive file."""
    with working(f"compiling {name}, about half a minute"):
        made = build_law(header, name, out)
    print(f'{made}: law = "cpp:{made.name}:{name}"')


@law_app.callback()
def laws() -> None:
    """One command so far, but named: `law build`."""
