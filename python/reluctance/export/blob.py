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
from reluctance.drive import Drive
from reluctance.errors import ParameterError
from reluctance.export.constants import Node
from reluctance.files import check_place, write_whole
from reluctance.run.plant import loop_parts

VERSION = 1  # of the format; include/srm/c_api/blob.hpp has the same
HASH_START, HASH_PRIME = 14695981039346656037, 1099511628211  # of FNV-1a, 64 bits
NAME = re.compile(r"srm::DriveControl<(?:\w+::)?(\w+)<(?:(?:\w+::)?(\w+)<)?")


@dataclass(frozen=True)
class Kind:
    """What a library must have been compiled with to run a drive."""

    law: str  # struct of the law: EdgeMpc
    machine: str  # struct of the machine model: LeHuy or FluxMap
    n_phases: int
    precision: str  # of the controller: float or double

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
    of, controller = kind(drive), _controller(drive)
    loop = _core.described_plant(**loop_parts(drive, -1.0 if record is None else record))
    names, numbers = _walk(loop)
    more_names, more_numbers = _walk(controller["control"])
    names, numbers = f"{names}control {more_names}", numbers + more_numbers
    head = b"SRMDRIVE" + struct.pack(
        "<Ii24s16s8sQ",
        VERSION,
        of.n_phases,
        of.law.encode(),
        of.machine.encode(),
        of.precision.encode(),
        _hashed(HASH_START, names.encode()),
    )
    body = struct.pack(f"<{len(numbers)}d", *numbers)
    return head + struct.pack("<Q", _hashed(HASH_START, head + body)) + body


def kind(drive: Drive) -> Kind:
    """What a library must have been compiled with to run a drive."""
    if drive.control.learns:
        raise ParameterError(
            "[control] learn = true has no form in the C interface, in units and in the studio; "
            "need false there (the firmware package learns)"
        )
    if drive.supervision.on:
        raise ParameterError(
            "[supervision] has no form in the C interface, in units and in the studio; remove "
            "enable_s there (reluctance run, simulate and the firmware package have the states)"
        )
    nodes = _controller(drive)
    found = NAME.match(nodes["control"]["type"])
    law = found[1] if found else ""
    machine = type(drive.machine.magnetics).__name__
    if not law or len(law) > 24:
        raise ParameterError(
            f"the law `{law or nodes['control']['type']}` has no name of 1 to 24 letters"
        )
    return Kind(law, machine, drive.machine.n_phases, drive.control.precision)


def _controller(drive: Drive) -> dict[str, Node]:
    nodes = _core.described(drive.controller())
    if nodes is None:
        raise ParameterError(
            f"[control] law = {drive.control.law!r} cannot be exported; "
            "a law in C++ can (docs/extending.md)"
        )
    return nodes


def _walk(node: Node) -> tuple[str, list[float]]:
    """The names of a tree as the reader visits them, and its numbers."""
    names: list[str] = []
    numbers: list[float] = []

    def visit(node: Node) -> None:
        if node is None:
            names.append("!")
        elif isinstance(node, list):
            names.append("{")
            numbers.extend(float(v) for v in node)
            names.append("}")
        elif not isinstance(node, dict):
            numbers.append(float(node))
        elif "table" in node:
            names.append("[]")
            numbers.append(float(len(node["values"])))
            numbers.extend(float(v) for v in node["values"])
        elif "variant" in node:
            names.append("<")
            numbers.append(float(node["variant"]))
            visit(node["value"])
            names.append(">")
        elif "fields" in node:
            names.append("(")
            for name, value in node["fields"].items():
                names.append(f"{name} ")
                visit(value)
            names.append(")")
        else:
            numbers.append(float(node["value"]))

    visit(node)
    return "".join(names), numbers


def _hashed(start: int, content: bytes) -> int:
    """FNV-1a."""
    value = start
    for byte in content:
        value = (value ^ byte) * HASH_PRIME & 0xFFFFFFFFFFFFFFFF
    return value
