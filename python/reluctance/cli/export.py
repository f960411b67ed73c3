"""The commands `reluctance export ...`: each parses, calls one public function, prints."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from reluctance import export, load
from reluctance.cli.options import AsJson, DriveFile, Overrides, Trust, help_if_bare
from reluctance.drive import Drive
from reluctance.errors import ParameterError
from reluctance.export.cost import costs
from reluctance.export.package import FLASH_LIMIT_KIB
from reluctance.export.parity import STEPS, check_parity, in_the_loop
from reluctance.export.target import MACHINES, Cpu
from reluctance.run.kpis import shown

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
    cost: Annotated[
        bool, typer.Option("--cost", help="Build it, run it emulated, and print what it costs.")
    ] = False,
    steps: Steps = STEPS,
    as_json: AsJson = False,
) -> None:
    """Write the controller as a self-contained firmware package."""
    drive = load(drive_file, overrides, trust=trust)
    made = export.firmware(drive, out, flash_limit_KiB=flash_limit)
    rows = [c.with_units() for c in costs(drive, steps=steps)] if cost else []
    if as_json:
        figures = {
            "folder": str(made.folder),
            "law": made.law,
            "fingerprint": f"0x{made.fingerprint:08X}",
            "tables_B": made.table_bytes,
        }
        print(json.dumps(figures | ({"cost": rows} if rows else {})))
        return
    console = Console()
    console.print(f"{made.folder}: {made.law}", soft_wrap=True, highlight=False)
    console.print(
        f"fingerprint 0x{made.fingerprint:08X}, tables {made.table_bytes / 1024:.1f} KiB; "
        "start with its README.md",
        soft_wrap=True,
        highlight=False,
    )
    if rows:
        table = Table(title="one control step")
        table.add_column("")
        for row in rows:
            table.add_column(str(row["cpu"]), justify="right")
        for key in list(rows[0])[3:]:
            table.add_row(key, *(str(row[key]) for row in rows))
        console.print(table)
        clock = max(row["instructions_max"] for row in rows) / drive.control.T_s_us
        console.print(
            f"worst step within T_s = {drive.control.T_s_us:g} us at one instruction a cycle: "
            f"{clock:.0f} MHz and more",
            soft_wrap=True,
            highlight=False,
        )


@export_app.command("blob")
def blob(
    drive_file: DriveFile,
    out: Annotated[Path, typer.Option(metavar="FILE", help="File to write.")],
    overrides: Overrides = None,
    trust: Trust = False,
    as_json: AsJson = False,
) -> None:
    """Write the resolved parameters of a drive for the C interface."""
    of = export.write_blob(load(drive_file, overrides, trust=trust), out)
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
    """Write a functional mock-up unit for co-simulation (FMI 2.0 or 3.0)."""
    drive = load(drive_file, overrides, trust=trust)
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
    """Replay a simulation on the emulated target and compare its commands bit for bit."""
    found = check_parity(load(drive_file, overrides, trust=trust), cpu=_cpu(cpu), steps=steps)
    if as_json:
        print(json.dumps({"steps": found.steps, "different": found.different, "cpu": cpu}))
    else:
        print(f"{found.steps - found.different} of {found.steps} steps agree in every bit on {cpu}")
    if not found.exact:
        raise ParameterError(
            f"the target's commands differ first at step {found.first}; the status there is "
            f"{found.answers.status[found.first]}"
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
    """Processor in the loop: simulate with every control step on the emulated target."""
    drive: Drive = load(drive_file, overrides, trust=trust)
    target, desk = in_the_loop(drive, cpu=_cpu(cpu), until=until)
    if as_json:
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


def _cpu(name: str) -> Cpu:
    for cpu in ("cortex-m4", "cortex-m7"):
        if name == cpu:
            return cpu
    raise ParameterError(f"--cpu {name}, need one of: {', '.join(MACHINES)}")
