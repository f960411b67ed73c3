"""`reluctance run`: simulate a drive and print its key figures."""

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from reluctance.base.figures import check_figures, look
from reluctance.base.files import check_ending
from reluctance.base.key_figures import NOT_HELD, Kpis, shown
from reluctance.base.phases import phase_name
from reluctance.base.table_file import TABLES
from reluctance.base.units import from_si
from reluctance.cli.drive_file import load_drive
from reluctance.cli.lines import tell_notes, wrapped
from reluctance.cli.options import AsJson, DriveFile, Overrides, Plot, Style, Trust, Width
from reluctance.cli.progress import progress_bar
from reluctance.drive.drive import Drive
from reluctance.drive.run import simulate
from reluctance.drive.run.array_left import left
from reluctance.drive.run.bounds import MOST_BYTES, waveform_bytes
from reluctance.drive.run.columns import Rows
from reluctance.drive.run.events import tripped, unready
from reluctance.drive.run.radial_force import force_orders
from reluctance.drive.run.safety import (
    beyond_angles,
    coarse_angle,
    coarse_current,
    compared_truly,
    drained,
    exceeded,
    folded_back,
    handed_over,
    never_planted,
    refused_by_firmware,
)

if TYPE_CHECKING:
    from reluctance.drive.run.energy_loop import EnergyLoop

# Of waveforms that only radial forces or an estimate need: so many samples fit into a run.
MOST_SAMPLES = 1e5
FAR_FROM = 0.5  # of a speed reference, where the start is in the mean
CROWDED = 0.01  # of the time, with three phases on: from here on it is said
TOLD_BYTES = 2e8  # of waveforms: from here on their size is said beforehand


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
    plot: Plot = None,
    width: Width = None,
    style: Style = None,
    energy_loop: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Flux over current, area against work; as --plot."),
    ] = None,
    record_us: Annotated[
        float,
        typer.Option(metavar="MICROSECONDS", min=0, help="Sample grid of waveforms; 0 keeps all."),
    ] = 0.0,
) -> None:
    """Simulate a drive and print its key figures."""
    drive = load_drive(drive_file, overrides, trust=trust)
    if out is not None:
        check_ending(out, TABLES)
    check_figures([plot, energy_loop], style, width)
    silent = out is None and plot is None and energy_loop is None
    end = drive.simulation.until_s if until is None else until
    forces = drive.machine.pole_force is not None
    record: float | None = record_us * 1e-6
    if silent:  # forces and estimate alone need waveforms, at the samples of the control
        needed = forces or bool(drive.protection.flux_angle)
        record = max(drive.control.T_s, end / MOST_SAMPLES) if needed else None
    if TOLD_BYTES < (size := waveform_bytes(drive, end, record)) <= MOST_BYTES:
        print(
            f"note: the waveforms take about {size / 1e9:.2g} GB; --record-us 100 keeps a grid",
            file=sys.stderr,
        )
    with progress_bar(f"simulating {drive.name}", end) as told:
        result = simulate(
            drive,
            until=end,
            record=record,
            progress=told,
        )
    found: list[EnergyLoop] = []
    if energy_loop is not None:
        from reluctance.drive.run import (
            energy_loop as loops,  # Matplotlib: half of the start-up time
        )

        with look(style, width):
            found = loops.save_energy_loop(result, energy_loop)
    if out is not None:
        result.save(out)
    if plot is not None:
        from reluctance.drive.run import plots

        with look(style, width):
            plots.save_plot(result, plot)
    rule = drive.by_rule
    steady = is_steady(drive)
    unbegun = unready(result.events, end)
    idle = tripped(result.kpis.t_trip) or unbegun  # for a part of what is evaluated
    # A mean with pauses is no point.
    handed = [] if idle else [*handed_over(drive, result.kpis), *beyond_angles(drive, result.kpis)]
    notes = [
        *undiagnosed(drive),
        *never_planted(drive, end),
        *coarse_angle(drive),
        *coarse_current(drive),
        *compared_truly(drive),
        *(aliased(drive, record_us) if plot or energy_loop else ()),
        *refused_by_firmware(drive),
        *(idle or unmet(drive, result.kpis)),
        *exceeded(drive, result.kpis),
        *(folded_back(drive, result.kpis) or handed if steady else ()),
        *(drained(drive, result.kpis, result.periods) if steady and not unbegun else ()),
        *left(result),
        *crowded(result.periods),
    ]
    if as_json:
        tell_notes(notes, as_json=True)
        learned = {} if result.learned is None else {"learned": result.learned.figures()}
        followed = {} if result.estimate is None else {"flux_angle": result.estimate.figures()}
        entered = (
            {} if result.events is None else {"events": [e.with_units() for e in result.events]}
        )
        faults = [{"t_s": t, "fault": str(fault)} for t, fault in result.faults]
        planted = {"faults": faults} if faults else {}
        ruled = {"by_rule": rule} if rule else {}
        areas = {"energy_loop": [loop.with_units() for loop in found]} if found else {}
        radial = {"radial_force": [x.with_units() for x in force_orders(result)]} if forces else {}
        more = {**ruled, **learned, **followed, **entered, **planted, **areas, **radial}
        print(json.dumps({**result.kpis.with_units(), **more}))
    else:
        Console().print(kpi_table(drive.name, result.kpis, devices=drive.converter.has_drops))
        seen = [(t, f"planted: {fault}") for t, fault in result.faults]
        seen += [(event.t, str(event)) for event in result.events or []]
        for t, text in sorted(seen, key=lambda one: one[0]):
            print(f"{t:8.4f} s  {text}")
        tell_notes(notes)
        if rule:
            values = ", ".join(f"{key} = {value:.5g}" for key, value in rule.items())
            print(wrapped(f"[control] by rule: {values}"))
        for force in force_orders(result) if forces else []:
            print(wrapped(f"radial force on a stator pole, {force}"))
        if result.learned is not None:
            print(wrapped(f"learned: {result.learned.text()}"))
        if result.estimate is not None:
            print(wrapped(f"angle by the flux linkages: {result.estimate.text()}"))
        for path in (out, plot, energy_loop):
            if path is not None:
                print(path)
        for loop in found:
            print(f"energy loop, {phase_name(loop.k)}: {loops.text(loop)}")


def undiagnosed(drive: Drive) -> list[str]:
    """Where a diagnosis is asked for that does not run."""
    if not drive.protection.diagnosis or drive.supervision.on:
        return []
    return [
        "[protection] diagnosis = true acts in a supervised drive and in firmware, and not in this "
        "run; set [supervision] enable_s"
    ]


def aliased(drive: Drive, record_us: float) -> list[str]:
    """Where the waveforms of a figure are farther apart than the orders of the control."""
    if not record_us > (period := 1e6 * drive.control.T_s):
        return []
    return [
        f"the figure has the waveforms at every {record_us:g} us (--record-us), and the control "
        f"orders at every {period:g} us: ripple and legs in it are not those of the run; leave "
        "--record-us out, with a smaller --until"
    ]


def unmet(drive: Drive, kpis: Kpis) -> list[str]:
    """What is not as the drive was asked for, a constant speed too."""
    sound = not (drive.faults.each or drive.mismatch.given or drive.sensing.has_errors)
    found = kpis.remarks(steady=is_steady(drive), sound=sound)
    asked = drive.reference.speed_rpm
    if drive.reference.kind != "speed" or not asked or not is_steady(drive):
        return found
    held = from_si(kpis.speed_mean, "rpm") / asked
    if abs(held - 1) <= (NOT_HELD if kpis.periods >= 2 else FAR_FROM):
        return found
    most = f"{drive.tau_max:.4g} N m"
    return [
        *found,
        f"the speed reference is not held ({held:.0%} of it): the drive has not come up to it "
        f"(--until), or its load takes more than tau_max_Nm = {most}",
    ]


def crowded(periods: Rows) -> list[str]:
    """Where three phases that couple conduct at once for more than a hundredth of a run."""
    part = periods.rise("three_on") / max(periods.rise("t"), 1e-12)
    if part <= CROWDED:
        return []
    return [
        f"three phases or more conduct at once for {part:.0%} of the time: what a third one adds "
        "to pairs is left out, 1 to 3 % rms and up to 12 % of the torque meanwhile "
        "(docs/geometry.md)"
    ]


def kpi_table(name: str, kpis: Kpis, *, devices: bool) -> Table:
    """Key figures as people read them; devices: whether the loss of switches and diodes counts."""
    table = Table(title=Text(name), show_header=False)
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
        ("peaks of the whole run", f"{k.i_peak_run:.2f} A, {k.u_dc_peak_run:.1f} V at the dc link"),
        ("rms current of the dc-link capacitor", f"{k.i_cap_rms:.2f} A"),
        ("copper loss", f"{k.p_cu:.1f} W"),
        ("device conduction loss", loss(k.p_dev if devices else None, "converter.v_switch_V")),
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
    if k.u_dc_min < k.u_dc_max:
        table.add_row(
            "dc-link voltage, least to greatest", f"{k.u_dc_min:.1f} to {k.u_dc_max:.1f} V"
        )
    if kpis.tracking is not None:
        table.add_row("energy from the array, of the available", f"{kpis.tracking:.2%}")
    if kpis.Q_mean is not None:
        table.add_row("mean flow", f"{from_si(kpis.Q_mean, 'm3ph'):.2f} m3/h")
    if kpis.beyond_map > 0:
        table.add_row("peak current beyond the flux map", f"{kpis.beyond_map:.1%} extrapolated")
    return table


def is_steady(drive: Drive) -> bool:
    """Whether all that acts on the drive is constant over the run."""
    courses = (drive.reference.values, drive.load.values, drive.source.values)
    return drive.reference.kind != "pv" and not any(courses)


def loss(value: float | None, needs: str) -> str:
    """A loss that is counted only where the drive has its data."""
    return f"not counted: no {needs}" if value is None else f"{value:.1f} W"
