"""The resolved parameters of a drive as bytes: what the C interface is made from.

The numbers come from the objects that the simulation runs (bindings/describe.hpp,
bindings/describe_plant.hpp), in the order of their field lists. include/srm/c_api/blob.hpp reads.
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass
from pathlib import Path

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.base.files import check_place, write_whole
from reluctance.drive.drive import Drive
from reluctance.drive.guard.supervised import controller
from reluctance.drive.run.plant import loop_parts
from reluctance.targets.export.tree import Node, Visit, walk

VERSION = 2  # of the format; include/srm/c_api/blob.hpp has the same
HASH_START, HASH_PRIME = 14695981039346656037, 1099511628211  # of FNV-1a, 64 bits
NAME = re.compile(r"srm::DriveControl<(?:\w+::)?(\w+)<(?:(?:\w+::)?(\w+)<)?")


@dataclass(frozen=True)
class Kind:
    """What a library must have been compiled with to run a drive."""

    law: str  # struct of the law: EdgeMpc
    machine: str  # struct of the machine model: LeHuy or FluxMap
    n_phases: int
    precision: str  # of the controller: float or double
    around: str  # the law: frame, or states

    def __str__(self) -> str:
        return f"{self.law}, {self.machine}, {self.n_phases} phases, {self.precision}"


def write_blob(drive: Drive, file: str | Path) -> Kind:
    """Write the blob of a drive to a file.

    Parameters
    ----------
    drive : Drive
    file : str or Path

    Returns
    -------
    Kind
        What a library must have been compiled with to run it.

    Raises
    ------
    ParameterError
        If the law has no form outside Python, or the file cannot be written.
    """
    file = Path(file)
    check_place(file)
    content = blob(drive)
    write_whole(file, lambda path: path.write_bytes(content))
    return kind(drive)


def blob(drive: Drive, *, record: float | None = None) -> bytes:
    """The resolved parameters of a drive, for the C interface.

    Parameters
    ----------
    drive : Drive
    record : float, optional
        Interval of the waveforms [s]; 0 keeps every solver point and event, None keeps nothing.

    Raises
    ------
    ParameterError
        If the law has no form outside Python.
    """
    of, nodes = kind(drive), described_controller(drive)
    loop = _core.described_plant(**loop_parts(drive, -1.0 if record is None else record))
    places = [*walk(loop), Visit("", "control ", ()), *walk(control_tree(nodes))]
    names = "".join(place.mark for place in places)
    numbers = [float(number) for place in places for number in place.numbers]
    head = b"SRMDRIVE" + struct.pack(
        "<Ii24s16s8s8sQ",
        VERSION,
        of.n_phases,
        of.law.encode(),
        of.machine.encode(),
        of.precision.encode(),
        of.around.encode(),
        _hashed(HASH_START, names.encode()),
    )
    body = struct.pack(f"<{len(numbers)}d", *numbers)
    return head + struct.pack("<Q", _hashed(HASH_START, head + body)) + body


def kind(drive: Drive) -> Kind:
    """What a library must have been compiled with to run a drive."""
    drive.check_sound("the C interface, in units and in the studio")
    if drive.control.learns:
        raise ParameterError(
            "[control] learn = true has no form in the C interface, in units and in the studio; "
            "need false there (the firmware package learns)"
        )
    nodes = described_controller(drive)
    found = NAME.match(nodes["control"]["type"])
    law = found[1] if found else ""
    machine = type(drive.machine.magnetics).__name__
    if not law or len(law) > 24:
        raise ParameterError(
            f"the law `{law or nodes['control']['type']}` has no name of 1 to 24 letters"
        )
    around = "states" if drive.supervision.on else "frame"
    return Kind(law, machine, drive.machine.n_phases, drive.control.precision, around)


def control_tree(nodes: dict[str, Node]) -> Node:
    """The parameters of the controller as srm::c_api::PlainControl or SupervisedControl has them
    (include/srm/c_api/control_part.hpp)."""
    if "sequence" not in nodes:
        return nodes["control"]
    guarded = {
        "machine": nodes["known"],
        "protection": nodes["protection"],
        "control": nodes["control"],
    }
    drive = {"sequence": nodes["sequence"], "control": {"fields": guarded}}
    return {"fields": {"drive": {"fields": drive}, "supervision": nodes["supervision"]}}


def described_controller(drive: Drive) -> dict[str, Node]:
    """The tree of a drive's controller.

    Raises
    ------
    ParameterError
        If the law has no form outside Python.
    """
    nodes = _core.described(controller(drive))
    if nodes is None:
        raise ParameterError(
            f"[control] law = {drive.control.law!r} cannot be exported; "
            "a law in C++ can (docs/extending.md)"
        )
    return nodes


def _hashed(start: int, content: bytes) -> int:
    """FNV-1a."""
    value = start
    for byte in content:
        value = (value ^ byte) * HASH_PRIME & 0xFFFFFFFFFFFFFFFF
    return value
