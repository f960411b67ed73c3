"""The command line. It parses, calls one public function, prints; errors are one line, exit 2."""

from typing import Annotated

import typer

import reluctance
from reluctance.base.files import begin_command, end_command
from reluctance.cli.compare import compare
from reluctance.cli.efficiency import efficiency
from reluctance.cli.emulate import emulate
from reluctance.cli.examples import examples
from reluctance.cli.export import export_app
from reluctance.cli.law import law_app
from reluctance.cli.limit import limit
from reluctance.cli.machine_from_geometry import machine_app
from reluctance.cli.machines import machines
from reluctance.cli.map import map_app
from reluctance.cli.map_identify import identify
from reluctance.cli.options import help_if_bare
from reluctance.cli.paper import paper
from reluctance.cli.pump import pump, size
from reluctance.cli.replay import replay
from reluctance.cli.run import run
from reluctance.cli.schema import schema
from reluctance.cli.studio import studio
from reluctance.cli.sweep import sweep
from reluctance.cli.tune import tune

app = typer.Typer(
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Switched-reluctance motor drives: simulate, control, find the physical limit, flash.",
)

FIRST = (run, sweep, tune, efficiency, compare, limit, paper, machines, examples)
for command in (*FIRST, studio, pump, size, emulate, replay, schema):
    app.command()(command)
map_app.command()(identify)
app.add_typer(map_app, name="map")
app.add_typer(machine_app, name="machine")
app.add_typer(export_app, name="export")
app.add_typer(law_app, name="law")


@app.callback(invoke_without_command=True)
def about(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
) -> None:
    begin_command()
    context.call_on_close(end_command)
    if version:
        print(f"reluctance {reluctance.__version__}")
        raise typer.Exit
    help_if_bare(context)
