"""A dump of the recorder, computed again on the desk by the exported package, bit for bit."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reluctance.base.errors import ParameterError
from reluctance.base.files import scratch
from reluctance.drive.drive import Drive
from reluctance.targets.export.dump import Dump, read_dump
from reluctance.targets.export.on_desk import DeskPackage
from reluctance.targets.export.package import firmware

ANSWERS = ("order", "mode", "gate_enable", "precharged", "chopper", "status")
LONGEST = 100  # text of a value that differs


@dataclass(frozen=True)
class Difference:
    """The first sample at which target and desk differ."""

    sample: int
    field: str
    target: str
    desk: str


@dataclass(frozen=True)
class Replayed:
    """A dump and what the desk says of it."""

    dump: Dump
    cause: str  # of the trigger, in words
    different: int  # samples
    first: Difference | None

    @property
    def exact(self) -> bool:
        """True where every bit of every answer agrees."""
        return self.different == 0


def replay_dump(path: str | Path, drive: Drive) -> Replayed:
    """Compute a dump again and compare orders, outputs and status.

    Parameters
    ----------
    path : str or Path
        The dump.
    drive : Drive
        The drive file that the firmware was exported from.

    Raises
    ------
    ParameterError
        If the dump is damaged, or of another drive.
    """
    path = Path(path)
    if drive.control.learns:
        raise ParameterError(
            f"[control] learn = true of {drive.name}: what a law has learned is not replayed; "
            "need a drive that does not learn"
        )
    dump = read_dump(path)
    if dump.n_phases != drive.machine.n_phases:
        raise ParameterError(
            f"{path}: phases = {dump.n_phases}, {drive.name} has {drive.machine.n_phases}; give "
            "the drive file that was flashed"
        )
    with scratch() as place:
        made = firmware(drive, place / "package")
        if made.fingerprint != dump.fingerprint:
            raise ParameterError(
                f"{path} is of fingerprint 0x{dump.fingerprint:08X}, {drive.name} exports "
                f"0x{made.fingerprint:08X}; give the drive file that was flashed"
            )
        desk = DeskPackage(made.folder, dump.n_phases)
        if desk.state_words != dump.state_words:
            raise ParameterError(
                f"{path}: a state of {dump.state_words} words, need {desk.state_words}; replay it "
                "with the release that exported the firmware"
            )
        different, first = 0, None
        for segment in dump.segments:
            desk.restore(segment.state)
            for n in range(len(segment.records)):
                row = segment.records[n : n + 1]
                found = _difference(row, desk.run(row))
                if found is not None:
                    different += 1
                    first = first or Difference(segment.first + n, *found)
        cause = desk.describe(dump.status) if dump.status else "trigger"
    return Replayed(dump=dump, cause=cause, different=different, first=first)


def _difference(target: NDArray[np.void], desk: NDArray[np.void]) -> tuple[str, str, str] | None:
    """The first answer that differs in a bit: its name, and both values."""
    if target.tobytes() == desk.tobytes():
        return None
    for name in ANSWERS:
        a, b = target[name][0], desk[name][0]
        if a.tobytes() != b.tobytes():
            return _innermost(name, a, b)
    return None


def _innermost(name: str, a: Any, b: Any) -> tuple[str, str, str]:
    """The first part that differs of two values that do, named as C has it."""
    for part in a.dtype.names or ():
        if a[part].tobytes() != b[part].tobytes():
            return _innermost(f"{name}.{part}", a[part], b[part])
    for k in range(len(a) if a.shape else 0):
        if a[k].tobytes() != b[k].tobytes():
            return _innermost(f"{name}[{k}]", a[k], b[k])
    return name, _text(a), _text(b)


def _text(value: object) -> str:
    text = " ".join(str(value).split())
    return text if len(text) <= LONGEST else f"{text[:LONGEST]} ..."
