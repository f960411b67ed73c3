"""The commands `reluctance export ...`: each parses, calls one public function, prints."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from reluctance.base.errors import ParameterError
from reluctance.base.files import refuse_input
from reluctance.base.key_figures import shown
from reluctance.cli.drive_file import load_drive
from reluctance.cli.lines import tell_notes, wrapped
from reluctance.cli.options import AsJson, DriveFile, Overrides, Trust, help_if_bare
from reluctance.cli.progress import working
from reluctance.cli.run import unmet
from reluctance.drive.drive import Drive
from reluctance.drive.overrides import parsed
from reluctance.targets import export
from reluctance.targets.export.cost import Cost, costs
from reluctance.targets.export.package import FLASH_LIMIT_KIB, PREFIX
from reluctance.targets.export.package_text import gates_of
from reluctance.targets.export.parity import check_parity, in_the_loop
from reluctance.targets.export.port import CLOCK_HZ
from reluctance.targets.export.recording import STEPS
from reluctance.targets.export.target import Cpu, known_cpu
from reluctance.targets.export.verdict import MCUS, left_out, verdict
from reluctance.targets.export.verdict import mcu as find_mcu

export_app = typer.Typer(
    invoke_without_command=True, callback=help_if_bare, help="Hand a drive over to other tools."
)

CpuOption = Annotated[str, typer.Option("--cpu", help="cortex-m4 or cortex-m7, emulated.")]
Steps = Annotated[int, typer.Option(metavar="N", min=1, help="Control steps to replay.")]


@export_app.command("firmware")
def firmware(
    drive_file: DriveFile,
    out: Annotated[Path, typer.Option(metavar="DIR", help="New or empty folder.")],
    overrides: Overrides = None,
    trust: Trust = False,
    flash_limit: Annotated[
        float, typer.Option(metavar="KIB", min=0, help="Most that the tables may take.")
    ] = FLASH_LIMIT_KIB,
    prefix: Annotated[
        str, typer.Option(metavar="NAME", help="Of all symbols: two drives in one image.")
    ] = PREFIX,
    self_test: Annotated[
        bool, typer.Option("--self-test", help="With stored samples and checksums for the boot.")
    ] = False,
    port: Annotated[
        str | None,
        typer.Option(metavar="NAME", help=f"Add a reference port: {', '.join(CLOCK_HZ)}."),
    ] = None,
    cost: Annotated[
        bool, typer.Option("--cost", help="Build it, run it emulated, and print what it costs.")
    ] = False,
    mcu: Annotated[
        str | None, typer.Option(metavar="NAME", help=f"Does it fit? One of {', '.join(MCUS)}.")
    ] = None,
    steps: Steps = STEPS,
    as_json: AsJson = False,
) -> None:
    """Write the controller as a self-contained firmware package."""
    drive = load_drive(drive_file, overrides, trust=trust)
    part = find_mcu(mcu) if mcu is not None else None
    made = export.firmware(
        drive, out, flash_limit_KiB=flash_limit, prefix=prefix, port=port, self_test=self_test
    )
    spent = costs(drive, steps=steps) if cost or part else []
    rows = [c.with_units() for c in spent] if cost else []
    gates = gates_of(drive)
    warnings = left_out(drive, gates) + _lost(drive, drive_file, overrides, trust)
    judged: list[tuple[bool, str]] = []
    if part is not None:
        of_part = _spent_on(spent, part.core)
        judged = verdict(drive, part, of_part, gates, ported=port is not None)
    if as_json:
        figures = {
            "folder": str(made.folder),
            "law": made.law,
            "fingerprint": f"0x{made.fingerprint:08X}",
            "tables_B": made.table_bytes,
        }
        fits = [{"fits": yes, "reason": reason} for yes, reason in judged]
        more = {"warnings": warnings, "verdict": fits, "cost": rows}
        print(json.dumps(figures | {key: value for key, value in more.items() if value}))
        return
    print(f"{made.folder}: {made.law}")
    tables = f"tables {made.table_bytes / 1024:.1f} KiB"
    print(f"fingerprint 0x{made.fingerprint:08X}, {tables}; start with its README.md")
    for line in warnings:
        print(wrapped(f"warning: {line}"))
    if part is not None:
        suits = all(yes for yes, _ in judged)
        print(f"{part.name}: {'fits' if suits else 'does not fit'}")
        for yes, reason in judged:
            answer = "yes" if yes else "NO "
            print(wrapped(f"  {answer}  {reason}", indent=" " * 7))
    if rows:
        table = Table(title="one control step")
        table.add_column("")
        for row in rows:
            table.add_column(str(row["cpu"]), justify="right")
        for key in list(rows[0])[3:]:
            table.add_row(key, *(str(row[key]) for row in rows))
        Console().print(table)
        clock = max(row["instructions_max"] for row in rows) / drive.control.T_s_us
        line = f"worst step within T_s = {drive.control.T_s_us:g} us at one instruction a cycle: "
        print(wrapped(f"{line}{clock:.0f} MHz and more"))


@export_app.command("blob")
def blob(
    drive_file: DriveFile,
    out: Annotated[Path, typer.Option(metavar="FILE", help="File to write.")],
    overrides: Overrides = None,
    trust: Trust = False,
    as_json: AsJson = False,
) -> None:
    """Write the resolved parameters of a drive for the C interface."""
    refuse_input(out, [drive_file])
    of = export.write_blob(load_drive(drive_file, overrides, trust=trust), out)
    if as_json:
        print(json.dumps({"file": str(out), **asdict(of)}))
    else:
        Console().print(f"{out}: {of}", soft_wrap=True, highlight=False)


@export_app.command("fmu")
def fmu(
    drive_file: DriveFile,
    out: Annotated[Path, typer.Option(metavar="FILE", help="File to write: .fmu.")],
    version: Annotated[int, typer.Option(metavar="2|3", help="Of the standard.")] = 2,
    part: Annotated[str, typer.Option(help="drive, stage or controller.")] = "drive",
    overrides: Overrides = None,
    trust: Trust = False,
    as_json: AsJson = False,
) -> None:
    """Write a functional mock-up unit for co-simulation. FMI 2.0 or 3.0."""
    drive = load_drive(drive_file, overrides, trust=trust)
    with working("compiling the unit, about 20 seconds"):
        made = export.fmu(drive, out, version=version, part=part)  # type: ignore[arg-type]
    if as_json:
        print(json.dumps({"file": str(out), "name": made.name, "variables": made.variables}))
    else:
        text = f"{out}: {made.name}, {made.variables} variables"
        Console().print(text, soft_wrap=True, highlight=False)


@export_app.command("parity")
def parity(
    drive_file: DriveFile,
    cpu: CpuOption = "cortex-m7",
    steps: Steps = STEPS,
    overrides: Overrides = None,
    trust: Trust = False,
    as_json: AsJson = False,
) -> None:
    """Replay a simulation on the target, bit for bit. It is emulated."""
    found = check_parity(
        load_drive(drive_file, overrides, trust=trust), cpu=known_cpu(cpu), steps=steps
    )
    if as_json:
        print(json.dumps({"steps": found.steps, "different": found.different, "cpu": cpu}))
    else:
        print(f"{found.steps - found.different} of {found.steps} steps agree in every bit on {cpu}")
    if not found.exact:
        raise ParameterError(
            f"the target's commands differ first at step {found.first}; the status there is "
            f"{found.answers.status[found.first]}"
        )


WITHOUT_STATES = (
    "[supervision] is left out: here the control law steps from the first sample on, on target and "
    "desk, without states and without its fault"
)


@export_app.command("pil")
def pil(
    drive_file: DriveFile,
    cpu: CpuOption = "cortex-m7",
    until: Annotated[
        float | None, typer.Option(metavar="SECONDS", help="End of the run, instead of the file's.")
    ] = None,
    overrides: Overrides = None,
    trust: Trust = False,
    as_json: AsJson = False,
) -> None:
    """Processor in the loop: each control step on the target. It is emulated."""
    drive: Drive = load_drive(drive_file, overrides, trust=trust)
    target, desk = in_the_loop(drive, cpu=known_cpu(cpu), until=until)
    notes = [*([WITHOUT_STATES] if drive.supervision.on else []), *unmet(drive, target)]
    if as_json:
        tell_notes(notes, as_json=True)
        print(json.dumps({"target": asdict(target), "desk": asdict(desk)}))
        return
    table = Table(title=Text(drive.name))
    for column in ("key figure", cpu, "desk, float"):
        table.add_column(column, justify="left" if column == "key figure" else "right")
    for (name, on_target), on_desk in zip(
        target.with_units().items(), desk.with_units().values(), strict=True
    ):
        table.add_row(name, shown(on_target, "{:.9g}"), shown(on_desk, "{:.9g}"))
    Console().print(table)
    tell_notes(notes)


def _lost(drive: Drive, file: Path, overrides: list[str] | None, trust: bool) -> list[str]:
    """A line where the machine of `--set` lacks the pairs of the one that it replaces."""
    given = overrides or []
    others = [text for text in given if parsed(text)[0] != "machine"]
    if drive.machine.coupled or len(others) == len(given):
        return []
    try:
        own = load_drive(file, others, trust=trust).machine
    except ParameterError:  # a drive with the machine of `--set` alone
        return []
    if not own.coupled or (own.N_s, own.N_r) != (drive.machine.N_s, drive.machine.N_r):
        return []
    return [
        f"the phases of the machine of {file} couple, those of the machine of --set do not, and "
        f"the law knows no pairs: `reluctance map import --pairs {file}` takes them over"
    ]


def _spent_on(spent: list[Cost], core: Cpu) -> Cost:
    return next(cost for cost in spent if cost.cpu == core)
