"""`reluctance run`: simulate a drive and print its key figures."""

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from reluctance.cli.options import AsJson, DriveFile, Overrides, Trust
from reluctance.cli.progress import progress_bar
from reluctance.files import TABLES, check_ending
from reluctance.load import load
from reluctance.run import Kpis, simulate
from reluctance.run.kpis import shown
from reluctance.run.save import save
from reluctance.units import from_si


def run(
    drive_file: DriveFile,
    until: Annotated[
        float | None, typer.Option(metavar="SECONDS", help="End of the run, instead of the file's.")
    ] = None,
    overrides: Overrides = None,
    trust: Trust = False,
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
    drive = load(drive_file, overrides, trust=trust)
    if out is not None:
        check_ending(out, TABLES)
    if plot is not None:
        from reluctance.run import plots  # here, because Matplotlib takes half of the start-up time

        check_ending(plot, plots.ENDINGS)
    if energy_loop is not None:
        from reluctance.run import energy_loop as loops

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


def kpi_table(name: str, kpis: Kpis) -> Table:
    """Key figures as people read them."""
    table = Table(title=name, show_header=False)
    table.add_column("key figure")
    table.add_column("value", justify="right")
    k = kpis
    for label, value in (
        ("mean torque", f"{k.tau_mean:.3f} N m"),
        ("mean torque reference", shown(k.tau_ref_mean, "{:.3f} N m")),
        ("torque ripple, peak to peak", shown(k.torque_ripple_pp, "{:.2%}")),
        ("torque ripple, rms", shown(k.torque_ripple_rms, "{:.2%}")),
        ("torque error, rms", shown(k.torque_error_rms, "{:.2%}")),
        ("switching frequency, mean per switch", f"{k.f_switch / 1e3:.2f} kHz"),
        ("rms phase current", f"{k.i_rms:.2f} A"),
        ("peak phase current", f"{k.i_peak:.2f} A"),
        ("copper loss", f"{k.p_cu:.1f} W"),
        ("device conduction loss", f"{k.p_dev:.1f} W"),
        ("switching loss", loss(k.p_sw, "converter.E_on_mJ")),
        ("iron loss, estimate", loss(k.p_fe, "machine.iron")),
        ("mechanical power", f"{k.p_mech:.1f} W"),
        ("power from the dc link", f"{k.p_in:.1f} W"),
        ("efficiency", shown(k.efficiency, "{:.2%}")),
        ("mean speed", f"{from_si(k.speed_mean, 'rpm'):.2f} rpm"),
        ("speed ripple, peak to peak", shown(k.speed_ripple_pp, "{:.3%}")),
        ("energy balance, left open", shown(k.energy_residual, "{:.1e}")),
        ("control period", f"{from_si(k.control_period, 'us'):g} us"),
        ("electrical periods evaluated", f"{k.periods}"),
        ("wall time per simulated time", f"{k.wall_s_per_sim_s:.3f}"),
    ):
        table.add_row(label, value)
    if kpis.beyond_map > 0:
        table.add_row("peak current beyond the flux map", f"{kpis.beyond_map:.1%} extrapolated")
    return table


def loss(value: float | None, needs: str) -> str:
    """A loss that is counted only where the drive has its data."""
    return f"not counted: no {needs}" if value is None else f"{value:.1f} W"
