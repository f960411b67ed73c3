"""`reluctance sweep`: a drive over grids, lists and samples of its values."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import typer

from reluctance.base.errors import ParameterError
from reluctance.base.units import to_si
from reluctance.cli.lines import tell_notes
from reluctance.cli.options import AsJson, DriveFile, Overrides, Plot, Style, Trust, Width
from reluctance.drive.drive import Drive
from reluctance.explore.sweeps import Sweep

Vary = Annotated[
    list[str],
    typer.Option(
        metavar="SECTION.KEY=VALUES",
        help="FROM:TO:COUNT, FROM:TO for samples, or a list as 1,2,5; also machine=A,B. Repeat it "
        "for more keys.",
    ),
]
Until = Annotated[
    float | None, typer.Option(metavar="SECONDS", help="End of each run, instead of the file's.")
]
Store = Annotated[
    Path | None,
    typer.Option(
        metavar="STORE", help="Store of all runs, .sqlite or .db; by default one in the cache."
    ),
]
Jobs = Annotated[int | None, typer.Option(metavar="N", help="Threads; by default all cores.")]
TRIP = "t_trip_s"
SHARING = "control.sharing"
MOST_LOOKED_AT = 100  # points whose sharing function is held against their voltage
SHOWN = (
    *("tau_mean_Nm", "torque_ripple_pp", "torque_error_rms"),
    *("efficiency", "i_rms_A", "f_switch_Hz"),
)
MOST_ROWS = 40  # of the table on the terminal


def sweep(
    drive_file: DriveFile,
    vary: Vary,
    sobol: Annotated[
        int | None, typer.Option(metavar="N", help="N points of a Sobol sequence, no grid.")
    ] = None,
    random: Annotated[
        int | None, typer.Option(metavar="N", help="N random points, no grid.")
    ] = None,
    seed: Annotated[int, typer.Option(metavar="N", min=0, help="Of the samples.")] = 0,
    until: Until = None,
    overrides: Overrides = None,
    trust: Trust = False,
    as_json: AsJson = False,
    out: Store = None,
    table: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Table: .csv, .npz, .parquet or .mat.")
    ] = None,
    plot: Plot = None,
    width: Width = None,
    style: Style = None,
    figure: Annotated[
        str | None, typer.Option(metavar="A,B", help="Key figures to show, as in `run --json`.")
    ] = None,
    kind: Annotated[
        str | None,
        typer.Option(metavar="KIND", help="Of the plot: lines, heat, parallel or pareto."),
    ] = None,
    jobs: Jobs = None,
    cluster: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Dask scheduler that runs the points.")
    ] = None,
) -> None:
    """Key figures over grids and samples of any values. Goes on where it was interrupted."""
    import reluctance
    from reluctance.base.figures import check_figures, look
    from reluctance.base.files import check_ending
    from reluctance.base.table_file import TABLES
    from reluctance.cli.progress import progress_bar
    from reluctance.drive.laws.own_code import refuse_untrusted
    from reluctance.explore.sweeps.store import ENDINGS
    from reluctance.explore.sweeps.swept import figure_name, start_of
    from reluctance.explore.sweeps.vary import is_range, parsed_all

    values = parsed_all(vary)
    names = [figure_name(name.strip()) for name in figure.split(",")] if figure else None
    if out is not None and out.suffix.lower() in TABLES:
        raise ParameterError(
            f"--out {out}: it takes the store of all runs, {' or '.join(ENDINGS)}; for their table "
            f"write --table {out}"
        )
    if table is not None:
        check_ending(table, TABLES)
    check_figures([plot], style, width)
    refuse_untrusted(values.get("control.law", []), trust)
    drive = reluctance.load(drive_file, overrides, trust=trust)
    with progress_bar(f"sweeping {drive.name}", 1.0) as told:
        found = reluctance.sweep(
            drive,
            values,
            sobol=sobol,
            random=random,
            seed=seed,
            until=until,
            out=out,
            jobs=jobs,
            cluster=cluster,
            progress=told,
        )
    if table is not None:
        found.save(table)
    if plot is not None:
        from reluctance.explore.sweeps.plots import (
            save_plot,  # Matplotlib: half of the start-up time
        )

        with look(style, width):
            save_plot(found, plot, names, kind)
    points = [found.point(n) for n in range(len(found))]
    notes = tripped(found) + without_effect(drive, found)
    if sobol is None and random is None:
        notes += [
            f"--vary {text} has no COUNT: without --sobol and --random these are its two ends; "
            f"{text}:13 would be 13 values"
            for text in vary
            if is_range(text)
        ]
    notes += with_start([({name: x[name] for name in found.values}, start_of(x)) for x in points])
    if found.failed:
        notes.insert(0, f"{found.failed} of them failed; the first: {found.reason()}")
    if as_json:
        tell_notes(notes, as_json=True)
        print(json.dumps(as_object(found)))
        return
    _print_table(found, names)
    print(f"{len(found)} points: {found.ran} run now, {found.known} from the store")
    tell_notes(notes)
    for path in (out, table, plot):
        if path is not None:
            print(path)


def tripped(found: Sweep) -> list[str]:
    """A note where points trip: the first of them, and when."""
    import numpy as np

    trips = np.flatnonzero(~np.isnan(found.figures[TRIP]))
    if not len(trips):
        return []
    point = found.point(int(trips[0]))
    values = ", ".join(f"{name} = {point[name]}" for name in found.values)
    return [
        f"{len(trips)} of them trip, marked `!`: their figures are of drives that do not "
        f"work throughout; the first: {values}, at {point[TRIP]:.4g} s"
    ]


def without_effect(drive: Drive, found: Sweep) -> list[str]:
    """A note where sharing functions are varied and points do not use them."""
    if SHARING not in found.values:
        return []
    points = [found.point(n) for n in range(min(len(found), MOST_LOOKED_AT)) if not found.why[n]]
    unused = [
        point
        for point in points
        if drive.with_values({name: point[name] for name in found.values}).unused(
            tau=point["tau_ref_mean_Nm"],
            omega_m=to_si(point["speed_mean_rpm"], "rpm"),
            u_dc=(point["u_dc_min_V"] + point["u_dc_max_V"]) / 2,
        )
    ]
    if not unused:
        return []
    values = ", ".join(f"{name} = {unused[0][name]}" for name in found.values)
    return [
        f"{len(unused)} of {len(points)} points do not use their {SHARING}, since voltage or "
        "current do not suffice for it: the law follows the profile of the limit there "
        f"(docs/control/voltage.md); the first: {values}"
    ]


def with_start(rows: Sequence[tuple[Mapping[str, object], str]]) -> list[str]:
    """Notes where figures include the start of their run, one for each reason.

    Parameters
    ----------
    rows : of each point its values, and why its figures include the start; empty where not.
    """
    found: dict[str, list[str]] = {}
    for values, why in rows:
        shown = ", ".join(f"{name} = {value}" for name, value in values.items())
        found.setdefault(why, []).append(shown)
    return [
        f"{why}; so it is at {len(points)} of {len(rows)} points, the first: {points[0]}"
        for why, points in found.items()
        if why
    ]


def as_object(found: Sweep) -> dict[str, object]:
    """The sweep as `--json` prints it."""
    points = []
    for n in range(len(found)):
        point = {k: None if v != v else v for k, v in found.point(n).items()}
        points.append(point | {"why": found.why[n] or None})
    return {"ran": found.ran, "known": found.known, "failed": found.failed, "points": points}


def _print_table(found: Sweep, names: list[str] | None) -> None:
    """The points as rows; of many, those where a figure is least or most."""
    import numpy as np
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from reluctance.base.key_figures import shown
    from reluctance.explore.sweeps.vary import key_of

    columns = [
        n for n in dict.fromkeys((*(names or SHOWN), TRIP)) if not np.isnan(found.figures[n]).all()
    ]
    rows = list(range(len(found)))
    title = found.name
    if len(rows) > MOST_ROWS:
        rows = sorted(
            {int(pick(found.figures[c])) for c in columns for pick in (np.nanargmin, np.nanargmax)}
        )
        title += ": where a figure is least or most"
    heads = [key_of(name).replace("_", " ") for name in (*found.values, *columns)]
    cells = []
    for n in rows:
        point = found.point(n)
        varied = [point[name] for name in found.values]
        row = [f"{v:.5g}" if isinstance(v, float) else str(v) for v in varied]
        row[0] += "" if np.isnan(point[TRIP]) else " !"
        row += [shown(None if np.isnan(point[c]) else point[c], "{:.4g}") for c in columns]
        cells.append(row)
    texts = [[head, *column] for head, *column in zip(heads, *cells, strict=True)]
    # Where they do not fit, a head breaks between words, and no number does.
    narrow = [max(map(len, [*head.split(), *column])) for head, *column in texts]
    whole = sum(max(map(len, column)) + len("|  ") for column in texts) + 1
    fits = whole <= Console().width
    table = Table(title=Text(title))
    for head, least in zip(heads, narrow, strict=True):
        table.add_column(Text(head), justify="right", width=None if fits else least)
    for row in cells:
        table.add_row(*map(Text, row))
    Console(width=max(sum(narrow) + len("|  ") * len(heads) + 1, Console().width)).print(table)
