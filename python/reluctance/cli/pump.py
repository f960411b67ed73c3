"""`reluctance pump` and `reluctance size`: from the sun to the tank."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from reluctance.base.errors import named
from reluctance.cli.lines import tell_notes, wrapped
from reluctance.cli.options import AsJson

if TYPE_CHECKING:
    from pandas import DataFrame

SystemFile = Annotated[Path, typer.Argument(metavar="SYSTEM.toml", help="Pumping system.")]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="SECTION.KEY=VALUE",
        help="Replace a value of the system file; SECTION.KEY= removes it.",
    ),
]


def pump(
    system_file: SystemFile,
    overrides: Overrides = None,
    as_json: AsJson = False,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder of report, tables and figures.")
    ] = None,
    write_drive: Annotated[
        Path | None,
        typer.Option(
            metavar="DRIVE.toml",
            help="Write the drive on its array as a drive file, and do not simulate.",
        ),
    ] = None,
) -> None:
    """Water of a photovoltaic pumping system over a day or a year."""
    from reluctance.cli.progress import progress_bar
    from reluctance.pumping import load_system, remarks, with_units
    from reluctance.pumping import pump as pumped
    from reluctance.pumping.text import rows

    system = load_system(system_file, overrides or [])
    if write_drive is not None:
        from reluctance.pumping import drive_of

        comment = f"The drive of the pumping system {system_file.name} on its array."
        with named(system_file):
            drive_of(system).save(write_drive, comment=comment)
        print(write_drive)
        return
    with named(system_file), progress_bar("simulating the drive's loss map", 1.0) as told:
        found = pumped(system, progress=told)
    files: list[Path] = []
    if out is not None:
        from reluctance.pumping.write import write  # Matplotlib takes half of the start-up time

        files = write(found, out)
    if as_json:
        tell_notes(remarks(found), as_json=True)
        print(json.dumps(with_units(found)))
        return
    _print_table(system.name, rows(with_units(found)))
    tell_notes(remarks(found))
    for path in files:
        print(path)


def size(
    system_file: SystemFile,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            metavar="SECTION.KEY=FROM:TO:COUNT",
            help="Value to vary, as array.n_series=4:9; by default array size and head, and the "
            "modules in series.",
        ),
    ] = None,
    overrides: Overrides = None,
    llp: Annotated[
        float,
        typer.Option(
            min=0,
            max=1,
            help="Loss of load probability (part of the demand that is not met) allowed for the "
            "smallest array.",
        ),
    ] = 0.02,
    as_json: AsJson = False,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder of tables and figures.")
    ] = None,
) -> None:
    """Water over the sizes of a pumping system. Array, head, modules in series, ..."""
    from reluctance.cli.progress import progress_bar
    from reluctance.pumping import load_system, sizes
    from reluctance.pumping.sizing import (
        Values,
        is_size,
        meets,
        parsed,
        smallest,
        usual,
        write_sizes,
    )
    from reluctance.pumping.text import size_table

    system = load_system(system_file, overrides or [])
    chosen: list[Values] = [dict(parsed(text, system) for text in vary)] if vary else usual(system)
    tables: list[DataFrame] = []
    with named(system_file), progress_bar("sizing", len(chosen)) as told:
        for values in chosen:
            tables.append(sizes(system, values, progress=lambda part: told(len(tables) + part)))
    demand = None
    if system.demand is not None:  # over all days of the weather
        demand = next((float(m) for table in tables for m in table["demand_m3"].dropna()), None)
    files = [] if out is None else write_sizes(tables, chosen, out, demand)
    notes = dict.fromkeys(note for table in tables for note in table.attrs["notes"])
    if as_json:
        tell_notes(notes, as_json=True)
        print(json.dumps([json.loads(table.to_json(orient="records")) for table in tables]))
        return
    for table, values in zip(tables, chosen, strict=True):
        best = meets(table, llp, system)
        starred = best if any(map(is_size, values)) else None
        print(*map(wrapped, size_table(table, list(values), starred)), sep="\n")
        if system.demand is not None:
            print(*map(wrapped, smallest(table, best, llp, system)), sep="\n")
        print()
    tell_notes(notes)
    for path in files:
        print(path)


def _print_table(title: str, rows: list[tuple[str, str]]) -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(title=Text(title), show_header=False)
    table.add_column("figure")
    table.add_column("value", justify="right")
    for label, value in rows:
        table.add_row(Text(label), Text(value))  # [limits] is the name of a table, no markup
    Console().print(table)
