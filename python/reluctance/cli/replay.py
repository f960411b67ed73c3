"""`reluctance replay`: a dump of the firmware's recorder, computed again on the desk."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from reluctance import load
from reluctance.base.errors import ParameterError
from reluctance.base.figures import check_figure
from reluctance.base.phases import phase_name
from reluctance.cli.options import AsJson, Overrides, Plot, Trust
from reluctance.drive.run.events import told
from reluctance.targets.export.replay_dump import Replayed, replay_dump


def replay(
    dump: Annotated[Path, typer.Argument(metavar="DUMP", help="What the recorder held.")],
    drive_file: Annotated[
        Path, typer.Option("--drive", metavar="DRIVE.toml", help="What was exported and flashed.")
    ],
    overrides: Overrides = None,
    trust: Trust = False,
    plot: Plot = None,
    as_json: AsJson = False,
) -> None:
    """Compute a dump of the recorder again, bit for bit."""
    drive = load(drive_file, overrides, trust=trust)
    if plot is not None:
        check_figure(plot)
    found = replay_dump(dump, drive)
    if plot is not None and not found.dump.samples:
        raise ParameterError(f"{dump} holds no samples; without --plot it is told what it holds")
    if plot is not None:
        from reluctance.targets.export import dump_plot  # Matplotlib: half of the start-up time

        dump_plot.save_dump_plot(found, drive.name, plot)
    if as_json:
        print(json.dumps(_figures(found)))
    else:
        print(_trigger(found))
        if found.exact:
            print(f"all {found.dump.samples} orders equal")
        if plot is not None:
            print(plot)
    if found.first is not None:
        at = found.first
        raise ParameterError(
            f"{found.different} of {found.dump.samples} samples differ, first sample {at.sample}: "
            f"`{at.field}` is {at.target} of the target, {at.desk} of the desk"
        )


def _trigger(found: Replayed) -> str:
    dump = found.dump
    if dump.trigger is None:
        return f"{dump.samples} samples, no trigger"
    text = f"{dump.samples} samples, trigger at sample {dump.trigger}: {found.cause}"
    if dump.status:
        of = f"{phase_name(dump.phase)}: " if dump.phase >= 0 else ""
        text += f" ({of}{told(dump.status, dump.phase, dump.value, dump.limit)})"
    return text


def _figures(found: Replayed) -> dict[str, object]:
    dump = found.dump
    return {
        "samples": dump.samples,
        "different": found.different,
        "first": None if found.first is None else asdict(found.first),
        "trigger": dump.trigger,
        "status": dump.status,
        "cause": found.cause,
        "fingerprint": f"0x{dump.fingerprint:08X}",
    }
