"""The command line. It parses, calls one public function, prints; errors are one line, exit 2."""

import json
import shutil
import signal
import sys
import textwrap
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.table import Table

import reluctance
from reluctance import load, simulate
from reluctance.cli_options import AsJson, DriveFile, Overrides
from reluctance.errors import ParameterError
from reluctance.export_cli import export_app
from reluctance.kpis import Kpis
from reluctance.map_cli import map_app
from reluctance.pump_cli import pump, size
from reluctance.save import WRITERS, check_ending, save

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Switched-reluctance motor drives: simulate, control, find the physical limit, flash.",
)

app.add_typer(map_app, name="map")
app.add_typer(export_app, name="export")
app.command()(pump)
app.command()(size)


@app.callback(invoke_without_command=True)
def about(
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
) -> None:
    if version:
        print(f"reluctance {reluctance.__version__}")
        raise typer.Exit


@app.command()
def run(
    drive_file: DriveFile,
    until: Annotated[
        float | None, typer.Option(metavar="SECONDS", help="End of the run, instead of the file's.")
    ] = None,
    overrides: Overrides = None,
    as_json: AsJson = False,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Waveforms: .csv, .npz, .parquet or .mat."),
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Overview figure: .png, .svg or .html.")
    ] = None,
    energy_loop: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Flux over current, area against work: .png or .svg."),
    ] = None,
    record_us: Annotated[
        float,
        typer.Option(metavar="MICROSECONDS", min=0, help="Sample grid of waveforms; 0 keeps all."),
    ] = 0.0,
) -> None:
    """Simulate a drive and print its key figures."""
    drive = load(drive_file, overrides)
    if out is not None:
        check_ending(out, WRITERS)
    if plot is not None:
        from reluctance import plots  # here, because Matplotlib takes half of the start-up time

        check_ending(plot, plots.ENDINGS)
    if energy_loop is not None:
        from reluctance import energy_loop as loops

        check_ending(energy_loop, loops.ENDINGS)
    silent = out is None and plot is None and energy_loop is None
    end = drive.simulation.until_s if until is None else until
    with progress_bar(f"simulating {drive.name}", end) as told:
        result = simulate(
            drive,
            until=end,
            record=None if silent else record_us * 1e-6,
            progress=told,
        )
    found = [] if energy_loop is None else loops.save_energy_loop(result, energy_loop)
    if out is not None:
        save(result, out)
    if plot is not None:
        plots.save_plot(result, plot)
    if as_json:
        print(json.dumps(result.kpis.with_units()))
    else:
        Console().print(kpi_table(drive.name, result.kpis))
        for remark in result.kpis.remarks():
            print(f"note: {remark}")
        for path in (out, plot, energy_loop):
            if path is not None:
                print(path)
        for loop in found:
            print(f"energy loop, phase {'abcdef'[loop.k]}: {loops.text(loop)}")


@app.command()
def paper(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder of the report.")] = Path(
        "out/paper"
    ),
) -> None:
    """The source paper, claim by claim: figures, claims.json, report.html."""
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


@app.command()
def machines(as_json: AsJson = False) -> None:
    """List the machine library."""
    from reluctance.library import entries  # reads every map

    found = entries()
    if as_json:
        print(json.dumps([entry.with_units() for entry in found]))
        return
    for entry in found:
        m = entry.machine
        print(f"{entry.key}: {m.name}")
        torque = f"{entry.tau_peak:.3g} N m static from one phase at {m.i_max_A:g} A"
        print(f"  model {m.model}, {torque}")
        print(f"  source: {m.source}")
        print(f"  licence: {m.licence}")


@app.command()
def compare(
    drive_file: DriveFile,
    controls: Annotated[
        str | None, typer.Option(metavar="A,B,C", help="Laws to compare, instead of all.")
    ] = None,
    at_switching_frequency: Annotated[
        str, typer.Option(metavar="FREQUENCY", help="Mean per switch, that every law is tuned to.")
    ] = "20kHz",
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for table and figure.")
    ] = None,
    overrides: Overrides = None,
    as_json: AsJson = False,
    as_markdown: Annotated[
        bool, typer.Option("--markdown", help="Print the table as Markdown.")
    ] = False,
) -> None:
    """Control laws side by side, at equal switching frequency and under equal conditions."""
    from reluctance import compare as contest  # here, for the start-up time of other commands
    from reluctance.compare import conditions, table

    f_switch = conditions.hertz(at_switching_frequency)
    drive = load(drive_file, overrides)
    names = None if controls is None else [name.strip() for name in controls.split(",")]
    with progress_bar("tuning control laws", 1.0) as told:
        found = contest.compare(drive, names, f_switch=f_switch, progress=told)
    files = [] if out is None else contest.write(found, out)
    if as_json:
        print(json.dumps(table.as_json(found)))
        return
    for line in (*conditions.in_words(found.point, f_switch), table.limit_line(found), ""):
        print(wrapped(line))
    if as_markdown:
        print(table.markdown(found), end="")
    else:
        print(*table.plain(found), sep="\n")
    for path in files:
        print(path)


@app.command()
def limit(
    drive_file: DriveFile,
    tau: Annotated[
        float | None, typer.Option(metavar="NM", help="Torque, instead of the drive's reference.")
    ] = None,
    speed: Annotated[
        float | None, typer.Option(metavar="RPM", help="Speed, instead of the drive's.")
    ] = None,
    at_switching_frequency: Annotated[
        str | None, typer.Option(metavar="FREQUENCY", help="Also the least ripple there: 20kHz.")
    ] = None,
    overrides: Overrides = None,
    as_json: AsJson = False,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Profile: .csv, .npz, .parquet or .mat."),
    ] = None,
    envelope: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Ripple-free torque over speed; endings as --out."),
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Profile and envelope: .png, .svg or .pdf.")
    ] = None,
) -> None:
    """What physics allows at the drive's operating point, under any controller."""
    from reluctance.compare.conditions import hertz  # CasADi is slow to import
    from reluctance.limit import envelope_of, files, limit_of, text

    f_switch = None if at_switching_frequency is None else hertz(at_switching_frequency)
    for path, endings in ((out, set(WRITERS)), (envelope, set(WRITERS)), (plot, files.ENDINGS)):
        if path is not None:
            check_ending(path, endings)
    found = limit_of(
        load(drive_file, overrides),
        tau_ref=tau,
        omega_m=None if speed is None else speed / 9.549296585513721,
        switching_frequency=f_switch,
    )
    if out is not None:
        files.save_profile(found, out)
    if envelope is not None or plot is not None:
        with progress_bar("searching the envelope", 1.0) as told:
            border = envelope_of(found, progress=told)
        if envelope is not None:
            files.save_envelope(border, envelope)
        if plot is not None:
            files.save_figure(found, border, plot)
    if as_json:
        print(json.dumps(found.with_units()))
        return
    table = Table(title=found.drive.name, show_header=False)
    table.add_column("figure")
    table.add_column("value", justify="right")
    for label, value in text.rows(found):
        table.add_row(label, value)
    Console().print(table)
    print(text.basis(found))


def kpi_table(name: str, kpis: Kpis) -> Table:
    """Key figures as people read them."""
    table = Table(title=name, show_header=False)
    table.add_column("key figure")
    table.add_column("value", justify="right")
    rpm = kpis.speed_mean * 9.549296585513721
    for label, value in (
        ("mean torque", f"{kpis.tau_mean:.3f} N m"),
        ("mean torque reference", f"{kpis.tau_ref:.3f} N m" if kpis.tau_ref else "none"),
        ("torque ripple, peak to peak", f"{kpis.torque_ripple:.2%}"),
        ("torque ripple, rms", f"{kpis.torque_ripple_rms:.2%}"),
        ("torque error, rms", f"{kpis.torque_error_rms:.2%}"),
        ("switching frequency, mean per switch", f"{kpis.switching_frequency / 1e3:.2f} kHz"),
        ("rms phase current", f"{kpis.i_rms:.2f} A"),
        ("peak phase current", f"{kpis.i_peak:.2f} A"),
        ("copper loss", f"{kpis.p_cu:.1f} W"),
        ("device conduction loss", f"{kpis.p_dev:.1f} W"),
        ("switching loss", loss(kpis.p_sw, "converter.E_on_mJ")),
        ("iron loss, estimate", loss(kpis.p_fe, "machine.iron")),
        ("mechanical power", f"{kpis.p_mech:.1f} W"),
        ("power from the dc link", f"{kpis.p_in:.1f} W"),
        ("efficiency", f"{kpis.efficiency:.2%}"),
        ("mean speed", f"{rpm:.2f} rpm"),
        ("speed ripple, peak to peak", f"{kpis.speed_ripple:.3%}"),
        ("energy balance, left open", f"{kpis.energy_residual:.1e}"),
        ("control period", f"{kpis.control_period * 1e6:g} us"),
        ("electrical periods evaluated", f"{kpis.periods}"),
        ("wall time per simulated time", f"{kpis.wall_time_ratio:.3f}"),
    ):
        table.add_row(label, value)
    if kpis.beyond_map > 0:
        table.add_row("peak current beyond the flux map", f"{kpis.beyond_map:.1%} extrapolated")
    return table


def wrapped(line: str) -> str:
    """Broken between words on a terminal, whole in a pipe."""
    return textwrap.fill(line, shutil.get_terminal_size().columns) if sys.stdout.isatty() else line


def loss(value: float | None, needs: str) -> str:
    """A loss that is counted only where the drive has its data."""
    return f"not counted: no {needs}" if value is None else f"{value:.1f} W"


@contextmanager
def progress_bar(title: str, total: float) -> Iterator[Callable[[float], None]]:
    """A bar on a terminal for work that takes over a second; silent in a pipe."""
    console = Console(stderr=True)
    with Progress(
        TextColumn(title),
        BarColumn(),
        TaskProgressColumn(),
        TimeRemainingColumn(),
        console=console,
        disable=not console.is_terminal,
        transient=True,
    ) as progress:
        task = progress.add_task(title, total=total, visible=False)

        def told(reached: float) -> None:
            elapsed = progress.tasks[task].elapsed or 0.0
            progress.update(task, completed=reached, visible=elapsed > 1.0)

        yield told


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
