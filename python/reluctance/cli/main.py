"""The command line. It parses, calls one public function, prints; errors are one line, exit 2."""

import signal
import sys
from typing import Annotated

import typer

import reluctance
from reluctance.cli.compare import compare
from reluctance.cli.export import export_app
from reluctance.cli.law import law_app
from reluctance.cli.limit import limit
from reluctance.cli.machines import machines
from reluctance.cli.map import map_app
from reluctance.cli.paper import paper
from reluctance.cli.pump import pump, size
from reluctance.cli.run import run
from reluctance.errors import ParameterError

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Switched-reluctance motor drives: simulate, control, find the physical limit, flash.",
)

for command in (run, paper, machines, compare, limit, pump, size):
    app.command()(command)
app.add_typer(map_app, name="map")
app.add_typer(export_app, name="export")
app.add_typer(law_app, name="law")


@app.callback(invoke_without_command=True)
def about(
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
) -> None:
    if version:
        print(f"reluctance {reluctance.__version__}")
        raise typer.Exit


class Interrupted(BaseException):
    """Ctrl-C, as an exception that only `main` catches."""


def _interrupt(*_: object) -> None:
    raise Interrupted


def main() -> None:
    """Entry point of the `reluctance` command."""
    signal.signal(signal.SIGINT, _interrupt)
    try:
        code = app(standalone_mode=False)  # usage errors come here too, to be told on one line
        sys.exit(code if isinstance(code, int) else 0)
    except ParameterError as fault:
        print(f"error: {fault}", file=sys.stderr)
        sys.exit(2)
    except Exception as fault:
        if not hasattr(fault, "format_message"):  # what the command line library raises has it
            raise
        print(f"error: {' '.join(fault.format_message().split())}", file=sys.stderr)
        sys.exit(2)
    except Interrupted:
        print("interrupted; no file is left half-written", file=sys.stderr)
        sys.exit(130)


if __name__ == "__main__":
    main()
