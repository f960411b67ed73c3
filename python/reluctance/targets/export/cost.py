"""What a control period costs on a Cortex-M: instructions, flash, RAM, stack, outside symbols.

Instructions are counted by the emulator, exactly and repeatably; they are not cycles. On a
Cortex-M4F with zero wait states expect 1.6 to 2.1 cycles for each.
"""

from __future__ import annotations

import re
import subprocess
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from reluctance.base.errors import ParameterError
from reluctance.base.files import scratch
from reluctance.drive.drive import Drive
from reluctance.targets.export.package import firmware
from reluctance.targets.export.parity import parity
from reluctance.targets.export.recording import STEPS, Recording, record
from reluctance.targets.export.target import Cpu, build

CPUS: tuple[Cpu, ...] = ("cortex-m4", "cortex-m7")


@dataclass(frozen=True)
class Cost:
    """One controller on one processor, as exported, protection included."""

    drive: str
    law: str
    cpu: str
    steps: int  # replayed
    bit_exact: bool  # against the desk
    instructions_mean: float  # of reluctance_run in `run`
    instructions_max: int
    text: int  # [B]
    rodata: int  # tables included [B]
    data: int  # data and bss [B]
    stack: int  # of that call [B]
    outside: tuple[str, ...]  # symbols that the object needs from elsewhere

    def with_units(self) -> dict[str, Any]:
        """The same under the names of files and the command line."""
        names = {"text": "text_B", "rodata": "rodata_B", "data": "data_B", "stack": "stack_B"}
        row = {names.get(key, key): value for key, value in asdict(self).items()}
        row["instructions_mean"] = round(self.instructions_mean, 1)
        row["outside"] = " ".join(self.outside)
        return row


def cost(drive: Drive, cpu: Cpu, recording: Recording, folder: Path) -> Cost:
    """The cost of an exported package on one processor.

    Parameters
    ----------
    recording : Recording
        What the controller answers; the worst call is the worst of these.
    folder : Path
        The exported package; compiled here.
    """
    program = build(folder, cpu)
    found = parity(program, cpu, recording)
    controller = program.parent / "controller.o"
    text, rodata, data = sizes(controller)
    tree = re.search(r"srm::DriveControl<(.*)> control =", (folder / "parameters.hpp").read_text())
    if tree is None:
        raise ParameterError(f"{folder} is not an exported package")
    taken = found.answers.run
    return Cost(
        drive=drive.name,
        law=tree[1],
        cpu=cpu,
        steps=found.steps,
        bit_exact=found.exact,
        instructions_mean=float(taken.mean()),
        instructions_max=int(taken.max()),
        text=text,
        rodata=rodata,
        data=data,
        stack=found.answers.stack,
        outside=outside_symbols(controller),
    )


def costs(drive: Drive, *, steps: int = STEPS) -> list[Cost]:
    """The cost of a drive's controller on both processors."""
    recording = record(drive, steps=steps)
    with scratch() as place:
        folder = firmware(drive, place / "package").folder
        return [cost(drive, cpu, recording, folder) for cpu in CPUS]


def sizes(obj: Path) -> tuple[int, int, int]:
    """Bytes of code, of constants, and of data with bss in an object file."""
    totals = {"text": 0, "rodata": 0, "data": 0, "bss": 0}
    for line in _tool("size", "-A", str(obj)).splitlines():
        match = re.match(r"\.(text|rodata|data|bss)\S*\s+(\d+)", line)
        if match:
            totals[match[1]] += int(match[2])
    return totals["text"], totals["rodata"], totals["data"] + totals["bss"]


def outside_symbols(obj: Path) -> tuple[str, ...]:
    """Undefined symbols of an object file."""
    return tuple(sorted(line.split()[-1] for line in _tool("nm", "-u", str(obj)).splitlines()))


def _tool(name: str, *arguments: str) -> str:
    return subprocess.run(
        [f"arm-none-eabi-{name}", *arguments], capture_output=True, text=True, check=True
    ).stdout
