"""`reluctance map check|fit|plot|import|identify`: from somebody's flux table to a machine file."""

import json
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from reluctance.base.errors import ParameterError
from reluctance.base.figures import check_figure, look, save_figure
from reluctance.base.files import check_ending, check_own_table, refuse_input, write_whole
from reluctance.base.unedited import write_unedited
from reluctance.cli.lines import wrapped
from reluctance.cli.options import AsJson, Style, Width, help_if_bare
from reluctance.cli.stated_map import MaxCurrent, Stated, read, takes_stated
from reluctance.machine.map_file import accept_in, machine_text, phases_of

if TYPE_CHECKING:
    from reluctance.machine.maps import FluxTable

# Rotor inertia over greatest torque: 10 s to 1000 rpm, idle. The library has 3e-5 to 1.1e-3 [s^2].
MOST_INERTIA = 0.1
# Aligned flux linkage over resistive drop, at the greatest current [s]. It grows with the square of
# the size: the library has 18 to 190 ms, a stack of some millimetres one.
SHORTEST_TIME = 5e-4

map_app = typer.Typer(
    invoke_without_command=True,
    callback=help_if_bare,
    rich_markup_mode=None,
    help="Import, judge, repair, fit and plot flux maps.",
)

MapFile = Annotated[
    Path,
    typer.Argument(metavar="FILE", help="Map: .csv, .txt, .xlsx, .mat, .json; or a machine file."),
]
Torque = Annotated[
    Path | None, typer.Option(metavar="FILE", help="A second grid, with the torque.")
]


@map_app.command()
@takes_stated
def check(
    file: MapFile,
    stated: Stated,
    torque: Torque = None,
    i_max: MaxCurrent = None,
    as_json: AsJson = False,
    repair: Annotated[
        Path | None, typer.Option(metavar="OUT.csv", help="Smooth, make flux rise, and write.")
    ] = None,
    accept: Annotated[
        str | None,
        typer.Option(metavar="REASON", help="Use a refused map: the reason goes into FILE.toml."),
    ] = None,
) -> None:
    """Judge a flux map. Exit code 1 if it is refused and not accepted."""
    from reluctance.machine.maps import check_map, repair_map, write_map
    from reluctance.machine.maps.importers import MAP_COLUMNS
    from reluctance.machine.maps.report import check_table

    stated = replace(stated, torque=torque, i_max_A=i_max)
    if repair is not None:
        check_ending(repair, {".csv"})
        refuse_input(repair, [file, torque])
        check_own_table(repair, MAP_COLUMNS)
    if accept is not None and (file.suffix.lower() != ".toml" or not accept.strip()):
        raise ParameterError(
            "--accept stores its reason in a machine file: make one with `reluctance map import`, "
            "then `reluctance map check FILE.toml --accept REASON`"
        )
    table, stated = read(file, stated)
    changed: tuple[str, ...] = ()
    if repair is not None:
        mended = repair_map(table)
        table, changed = replace(mended.table, notes=table.notes), mended.notes
        write_whole(repair, lambda path: write_map(table, path))
    report = check_map(table, i_max=stated.i_max_A)
    if accept is not None and report.verdict != "good":
        accept_in(file, accept)
    if as_json:
        print(json.dumps({**asdict(report), "repair": list(changed)}))
    else:
        Console().print(check_table(file.name, report))
        _tell("read as", report.notes)
        _tell("repair", changed)
        _tell("refused", report.reasons)
        if accept is not None or stated.accepted:
            print(f"accepted: the reason is in {file}" if report.reasons else "nothing to accept")
    if report.reasons and accept is None and not stated.accepted:
        raise typer.Exit(1)


def _tell(what: str, lines: tuple[str, ...]) -> None:
    for line in lines:
        print(wrapped(f"{what}: {line}"))


@map_app.command()
@takes_stated
def fit(
    file: MapFile,
    stated: Stated,
    as_json: AsJson = False,
) -> None:
    """Fit the Le-Huy parameters to a map. And a family with two saturating terms."""
    from reluctance.machine.maps import fit_lehuy, fit_two_term
    from reluctance.machine.maps.report import fit_table

    table, _ = read(file, stated)
    simple, better = fit_lehuy(table), fit_two_term(table)
    if as_json:
        print(json.dumps({"lehuy": asdict(simple), "two_term": asdict(better)}))
    else:
        Console().print(fit_table(file.name, simple, better))


@map_app.command()
@takes_stated
def plot(
    file: MapFile,
    out: Annotated[Path, typer.Option(metavar="FILE", help="Figure: .png, .svg, .pdf or .html.")],
    stated: Stated,
    torque: Torque = None,
    width: Width = None,
    style: Style = None,
) -> None:
    """Magnetisation, torque and inductance curves. Co-energy, too."""
    check_figure(out, style, width)
    stated = replace(stated, torque=torque)
    table, _ = read(file, stated)
    with look(style, width):
        _plot(file, table, out)
    print(out)


def _plot(file: Path, table: "FluxTable", out: Path) -> None:
    from reluctance.base.picture import Picture
    from reluctance.machine import maps

    machine = maps.surface(table)
    figure = Picture(11, 8)
    corners = figure.subplots(2, 2).flat
    maps.plot_magnetisation(machine, table, axes=corners[0])
    maps.plot_torque(machine, table, axes=corners[1])
    maps.plot_inductance(machine, axes=corners[2])
    maps.plot_coenergy(machine, axes=corners[3])
    figure.suptitle(file.name)
    save_figure(figure, out, title=file.name)


@map_app.command("import")
@takes_stated
def import_map(
    file: MapFile,
    out: Annotated[Path, typer.Option(metavar="MACHINE.toml", help="Machine file to write.")],
    N_s: Annotated[int, typer.Option("--N_s", metavar="POLES", help="Stator poles.")],
    R: Annotated[float, typer.Option("--R_ohm", metavar="OHM", help="Phase resistance.")],
    J: Annotated[float, typer.Option("--J_kgm2", metavar="KGM2", help="Rotor inertia.")],
    stated: Stated,
    torque: Torque = None,
    i_max: MaxCurrent = None,
    repair: Annotated[bool, typer.Option("--repair", help="Smooth, make flux rise.")] = False,
    accept: Annotated[
        str | None, typer.Option(metavar="REASON", help="Why a refused map is used all the same.")
    ] = None,
    pairs: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Pairs to take over: of DRIVE.toml, or a pair table."),
    ] = None,
) -> None:
    """Make a machine file of a map. The map is put beside it in the project's convention."""
    from reluctance.machine.maps import check_map, repair_map, write_map

    check_ending(out, {".toml"})
    stated = replace(stated, torque=torque)
    if file.suffix.lower() == ".toml":
        raise ParameterError(f"{file} is a machine file already; import takes the table itself")
    table, _ = read(file, stated)
    if repair:
        mended = repair_map(table)
        table = replace(mended.table, notes=table.notes)
        _tell("repair", mended.notes)
    taken = None
    if pairs is not None:
        from reluctance.cli.map_import_pairs import taken_over

        taken = taken_over(pairs, table.N_r, phases_of(N_s, table.N_r))
    if i_max is None:
        i_max = float(table.i[-1])
        i_max = i_max if taken is None else min(i_max, taken[0].i_last)
    report = check_map(table, i_max=i_max)
    _tell("read as", report.notes)
    if report.reasons and not (accept or "").strip():
        raise ParameterError(
            f"{file.name} is refused: {'; '.join(report.reasons)}. Nothing is written; mend the "
            "map, try --repair, or say --accept REASON"
        )
    if J > (most := MOST_INERTIA * report.tau_max_Nm):
        raise ParameterError(
            f"--J_kgm2 {J:g}, need at most {most:.3g}: the greatest torque of one phase, "
            f"{report.tau_max_Nm:.3g} N m, would not bring the rotor to 1000 rpm in 10 s; check "
            "its unit, 1 kg cm2 is 1e-4 kg m2, 1 g cm2 is 1e-7, and those of the map's currents "
            "and flux linkages"
        )
    if R > (most := report.psi_max_Wb / (SHORTEST_TIME * float(table.i[-1]))):
        raise ParameterError(
            f"--R_ohm {R:g}, need at most {most:.3g}: the largest flux linkage, "
            f"{report.psi_max_Wb:.3g} Wb, would fall within {1e3 * SHORTEST_TIME:g} ms; check its "
            "unit, 1000 milliohm are 1 ohm, and those of the map's currents and flux linkages"
        )
    copy = out.with_suffix(".csv")
    if copy.resolve() == file.resolve():
        copy = out.with_name(out.stem + "_map.csv")
    files: dict[Path, Callable[[Path], object]] = {copy: lambda path: write_map(table, path)}
    keys: tuple[str, float] | None = None
    if pairs is not None and taken is not None:
        from reluctance.machine.coupling import check_pairs
        from reluctance.machine.maps import fit_surface
        from reluctance.machine.pair_file import write_pairs

        coupling, pair_factor = taken
        check_pairs(coupling.times(pair_factor), fit_surface(table).machine, i_max)
        beside = out.with_name(f"{out.stem}_pairs.csv")
        if beside.resolve() != pairs.resolve():
            files[beside] = lambda path: write_pairs(coupling, path)
        keys = beside.name, pair_factor
    text = machine_text(
        name=out.stem,
        source=file.name,
        map_name=copy.name,
        N_s=N_s,
        N_r=table.N_r,
        R_ohm=R,
        i_max_A=i_max,
        J_kgm2=J,
        accepted_because=accept if report.reasons else None,
        pairs=keys,
        notes=(*table.notes, *(f"column named: {name}" for name in stated.name)),
    )
    write_unedited(out, text, files)
    *first, last = map(str, (out, *files))
    print(f"wrote {', '.join(first)} and {last}")
    print(f"next: reluctance run DRIVE.toml --set machine={out}")
