"""`reluctance tune`: values for which a figure is best while others keep their bounds."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from reluctance.cli.lines import tell_notes, wrapped
from reluctance.cli.options import AsJson, DriveFile, Overrides, Plot, Style, Trust, Width


def tune(
    drive_file: DriveFile,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            metavar="SECTION.KEY=FROM:TO", help="Range, or choices as A,B,C. Repeat it for more."
        ),
    ] = None,
    over: Annotated[
        list[str] | None,
        typer.Option(
            metavar="AXIS=FROM:TO:COUNT",
            help="Conduction angles over speed_rpm=... and torque_Nm=..., both given, as a table.",
        ),
    ] = None,
    minimise: Annotated[
        str | None, typer.Option(metavar="FIGURE", help="Key figure to make least.")
    ] = None,
    maximise: Annotated[
        str | None, typer.Option(metavar="FIGURE", help="Key figure to make greatest.")
    ] = None,
    keep: Annotated[
        list[str] | None,
        typer.Option(metavar="FIGURE<VALUE", help="Bound, as f_switch_Hz<15e3 or efficiency>0.8."),
    ] = None,
    at: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=VALUE,KEY=VALUE",
            help="Operating point, as load.speed_rpm=1000,reference.tau_Nm=20. Repeat it for more.",
        ),
    ] = None,
    budget: Annotated[
        int | None, typer.Option(metavar="N", help="Trials: 100, or 40 at each node of a table.")
    ] = None,
    optuna: Annotated[
        bool, typer.Option("--optuna", help="Search with Optuna, instead of Sobol and COBYLA.")
    ] = False,
    study: Annotated[
        str | None, typer.Option(metavar="STORE", help="Optuna's store, to go on with later.")
    ] = None,
    until: Annotated[float | None, typer.Option(metavar="SECONDS", help="End of each run.")] = None,
    overrides: Overrides = None,
    trust: Trust = False,
    as_json: AsJson = False,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="The tuned drive file, .toml; with --over the .csv."),
    ] = None,
    table: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Trials: .csv, .npz, .parquet or .mat.")
    ] = None,
    plot: Plot = None,
    width: Width = None,
    style: Style = None,
    jobs: Annotated[
        int | None, typer.Option(metavar="N", help="Threads; by default all cores.")
    ] = None,
) -> None:
    """Values for which a figure is best within bounds of others. Exit code 1 if none keeps them."""
    from reluctance.base.errors import ParameterError
    from reluctance.base.figures import check_figures, look
    from reluctance.base.files import check_ending
    from reluctance.base.table_file import TABLES
    from reluctance.base.unedited import check_unedited
    from reluctance.cli.progress import progress_bar
    from reluctance.cli.sweep import with_start
    from reluctance.cli.tune_over import tune_over
    from reluctance.drive.laws.own_code import refuse_untrusted
    from reluctance.drive.load import load
    from reluctance.explore.sweeps.vary import parsed_all
    from reluctance.explore.tuning import tune as tuned

    if out is not None:
        check_ending(out, {".toml"} if over is None else {".csv"})
        if over is None:
            check_unedited(out)
    if table is not None:
        check_ending(table, TABLES)
    check_figures([plot], style, width)
    points = [_point(text) for text in at or []]
    values = parsed_all(vary or [])
    for laws in (values.get("control.law", []), [x.get("control.law") for x in points]):
        refuse_untrusted(laws, trust)
    budgeted: dict[str, Any] = {} if budget is None else {"budget": budget}
    if over is not None:
        alone = {"--at": at, "--optuna": optuna, "--study": study, "--until": until}
        for name, given in (alone | {"--table": table}).items():
            if given:
                raise ParameterError(f"{name} has no effect with --over; leave it out")
        drive = load(drive_file, overrides, trust=trust, check_torque=False)
        options = {"maximise": maximise, "keep": keep or [], "vary": values or None, "jobs": jobs}
        options |= budgeted
        axes = parsed_all(over)
        with look(style, width):
            tune_over(drive, axes, minimise, options, out=out, plot=plot, as_json=as_json)
        return
    if not values:
        raise ParameterError("need --vary SECTION.KEY=FROM:TO, or --over for a table of angles")
    drive = load(drive_file, overrides, trust=trust)
    with progress_bar(f"tuning {drive.name}", 1.0) as told:
        found = tuned(
            drive,
            values,
            minimise,
            maximise=maximise,
            keep=keep or [],
            at=points,
            method="optuna" if optuna else "cobyla",
            study=study,
            until=until,
            jobs=jobs,
            progress=told,
            **budgeted,
        )
    if out is not None:
        found.drive.save(out, comment=f"Tuned for the {found.goal}.")
    if table is not None:
        found.table.save(table)
    if plot is not None:
        from reluctance.explore.tuning.plots import save  # Matplotlib: half of the start-up time

        with look(style, width):
            save(found, plot)
    notes = at_the_end(found.best.values, values)
    if not found.best.kept:
        notes.append(
            "no trial keeps all bounds; this one misses them by least: widen --vary, or loosen "
            "--keep"
        )
    if (t_trip := found.best.figures.get("t_trip_s", float("nan"))) == t_trip:
        notes.append(f"this drive trips at {t_trip:.4g} s, and its figures mean little")
    notes += with_start([(trial.values, trial.start) for trial in found.tried])
    if as_json:
        tell_notes(notes, as_json=True)
        figures = {k: None if v != v else v for k, v in found.best.figures.items()}
        told_best = {"values": found.best.values, "figures": figures, "kept": found.best.kept}
        print(json.dumps({"goal": str(found.goal), "trials": len(found.tried)} | told_best))
        if not found.best.kept:
            raise typer.Exit(1)
        return
    print(f"{found.goal}: {len(found.tried)} trials, {found.ran} runs made now")
    failed = [trial for trial in found.tried if trial.why]
    if failed:
        print(wrapped(f"{len(failed)} trials gave no figures; the first: {failed[0].why}"))
    for name, value in found.best.values.items():
        print(f"  {name} = {value}")
    shown = [found.goal.figure, *(bound.figure for bound in found.goal.bounds)]
    for name in dict.fromkeys(shown):
        print(f"  {name} {found.best.figures[name]:.5g}")
    tell_notes(notes)
    for path in (out, table, plot):
        if path is not None:
            print(path)
    if not found.best.kept:
        raise typer.Exit(1)


def at_the_end(best: Mapping[str, Any], ranges: Mapping[str, Sequence[Any]]) -> list[str]:
    """A note for each value that lies at an end of its range: the best may lie beyond it."""
    found = []
    for name, value in best.items():
        ends = ranges.get(name, ())
        if len(ends) == 2 and all(isinstance(end, int | float) for end in ends):
            low, high = sorted(ends)
            if min(value - low, high - value) <= NEAR_AN_END * (high - low):
                found.append(
                    f"{name} = {value:g} is at the end of its range {low:g}:{high:g}; "
                    "the best may lie beyond it: widen the range"
                )
    return found


NEAR_AN_END = 0.02  # of the range: COBYLA ends within a hundredth of a bound that holds it


def _point(text: str) -> dict[str, Any]:
    """An operating point."""
    from reluctance.base.errors import ParameterError
    from reluctance.base.toml_file import toml_value

    pairs = [pair.partition("=") for pair in text.split(",")]
    if not all(name.strip() and value.strip() for name, _, value in pairs):
        raise ParameterError(f"--at {text}: need KEY=VALUE,KEY=VALUE")
    return {name.strip(): toml_value(value.strip()) for name, _, value in pairs}
