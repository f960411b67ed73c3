"""The firmware package of a drive: a folder that holds all that its controller needs.

The folder is a pure function of the drive file: no dates, no names of machines.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.base.files import check_folder, make_folder, scratch, told
from reluctance.base.resources import resources
from reluctance.drive.drive import Drive, check_drive
from reluctance.drive.guard.sequence_levels import sequence
from reluctance.drive.guard.trip_levels import diagnosis, flux_angle, protection
from reluctance.drive.laws.own_code import below
from reluctance.targets.export.blob import exportable
from reluctance.targets.export.commission_levels import commission
from reluctance.targets.export.constants import Node, Tables, constant
from reluctance.targets.export.package_text import gates_of, values
from reluctance.targets.export.port import port_marks
from reluctance.targets.export.recording import desk_controller
from reluctance.targets.export.run_time import marks, run_time_code, run_time_parameters
from reluctance.targets.export.self_test import self_test_data, self_test_marks, stored_tables

FLASH_LIMIT_KIB = 256  # default for the tables: half the flash of a small Cortex-M4F
PREFIX = "reluctance"
NAME = re.compile(r"[a-z][a-z0-9_]{0,30}")
PHASES = range(3, 6)
MARK = re.compile(r"@(\w+)@")
INCLUDE = re.compile(r'#include "(srm/[^"]+)"')


@dataclass(frozen=True)
class Firmware:
    """What was exported."""

    folder: Path
    law: str  # C++ type of the control law
    fingerprint: int  # 32 bits of the SHA-256 of the printed parameters
    table_bytes: int  # tables in flash [B]


def firmware(
    drive: Drive,
    folder: str | Path,
    *,
    flash_limit_KiB: float = FLASH_LIMIT_KIB,
    prefix: str = PREFIX,
    port: str | None = None,
    self_test: bool = False,
) -> Firmware:
    """Write the firmware package of a drive.

    Parameters
    ----------
    drive : Drive
        Its controller is exported in single precision, whatever its `precision` says.
    folder : str or Path
        New or empty; appears when it is complete.
    flash_limit_KiB : float
        Most that the tables may take.
    prefix : str
        Of every symbol and file name of the interface: two packages with different ones link into
        one image.
    port : str, optional
        Reference port to put into the folder: stm32g474.
    self_test : bool
        Stored samples and checksums, and `reluctance_self_test` for the boot.

    Raises
    ------
    ParameterError
        If the law, the phase count or a number cannot be exported, the tables are too large, or
        the folder exists and is not empty.
    """
    check_drive(drive, "firmware")
    folder = Path(folder)
    if not NAME.fullmatch(prefix):
        raise ParameterError(
            f"prefix {prefix!r}, need a lower-case C name of at most 31 characters, as in `left`"
        )
    check_folder(folder)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise ParameterError(f"{folder} exists and is not an empty folder; name another")
    tree = described(drive)
    own = drive.control.headers
    at_run_time = run_time_parameters(drive, tree)
    code = run_time_code(at_run_time)
    text, fingerprint, table_bytes = parameters(tree, own, code)
    if table_bytes > flash_limit_KiB * 1024:
        raise ParameterError(
            f"the tables take {table_bytes / 1024:.1f} KiB of flash, need <= {flash_limit_KiB:g} "
            "KiB (--flash-limit); use fewer table points"
        )
    law = tree["control"]["type"].removeprefix("srm::DriveControl<").removesuffix(">").rstrip()
    said = values(drive, law, fingerprint) | marks(at_run_time)
    said |= self_test_marks(self_test)
    if port is not None:
        said |= port_marks(port, drive, gates_of(drive))
    make_folder(folder.parent)
    with told(folder), scratch(folder.parent) as place:
        made = place / "package"
        source = resources("firmware")
        templates = {source / "package": made}
        if port is not None:
            templates[source / "ports" / port] = made / port
        if self_test:
            templates[source / "self_test"] = made
        filled = {
            to / path.relative_to(source_of): MARK.sub(
                lambda m: said[m[1]], path.read_text("utf-8")
            )
            for source_of, to in templates.items()
            for path in sorted(p for p in source_of.rglob("*") if p.is_file())
        }
        _check_prefix(prefix, [*filled.values(), *(path.name for path in filled)])
        for path, code_of in filled.items():
            _put(made / renamed(str(path.relative_to(made)), prefix), renamed(code_of, prefix))
        _put(made / "parameters.hpp", renamed(text, prefix))
        _put(made / "commission_parameters.hpp", renamed(commission_parameters(drive), prefix))
        if self_test:
            _put(made / "self_test_data.hpp", renamed(self_test_data(drive), prefix))
        for header, code in own.items():
            _put(made / "include" / header, code)
        for header in headers(
            [text, *(p.read_text("utf-8") for p in made.glob("*.?pp")), *own.values()]
        ):
            _put(made / "include" / header, (resources("include") / header).read_text("utf-8"))
        if folder.exists():
            folder.rmdir()
        made.rename(folder)
    return Firmware(folder=folder, law=law, fingerprint=fingerprint, table_bytes=table_bytes)


def renamed(text: str, prefix: str) -> str:
    """The text with another prefix of all symbols, macros and file names. The namespace has it with
    an underscore: so it is no word of the language."""
    if prefix == PREFIX:
        return text
    text = re.sub(r"\bRELUCTANCE(?=_)", prefix.upper(), text)
    text = re.sub(r"\breluctance(?=_)", prefix, text)
    return re.sub(r"\breluctance(?=::)|(?<=namespace )reluctance\b", f"{prefix}_", text)


def _check_prefix(prefix: str, texts: Iterable[str]) -> None:
    """Refuses a prefix that makes of a name of the interface one that the package has already."""
    words = {word for text in texts for word in re.findall(r"\b[A-Za-z]\w*_\w*", text)}
    made = {renamed(word, prefix) for word in words if renamed(word, prefix) != word}
    if taken := sorted(made & words):
        raise ParameterError(
            f"prefix {prefix!r}, but the package has a name `{taken[0]}` of its own; need another"
        )


def described(drive: Drive) -> dict[str, Node]:
    """Trees of the drive's controller in single precision and of its protection.

    Raises
    ------
    ParameterError
        If the law or the phase count is not supported.
    """
    n_phases = drive.machine.n_phases
    if n_phases not in PHASES:
        raise ParameterError(f"n_phases = {n_phases}, need {PHASES[0]} to {PHASES[-1]} for export")
    if drive.converter.bridge != "asymmetric":
        raise ParameterError(
            f"[converter] bridge = {drive.converter.bridge!r} cannot be exported: the firmware "
            "orders legs of two switches each; need bridge = 'asymmetric'"
        )
    nodes = _core.described(exportable(drive, desk_controller(drive)))
    if drive.reference.kind != "none":  # what a reference is cut to, at the latest
        limit = nodes["control"]["fields"]["frame"]["fields"]["limits"]["fields"]
        limit["tau"] = min(limit["tau"], drive.tau_max)
    guard = protection(drive)
    described = _core.described_guard(
        guard, sequence(drive, guard), diagnosis(drive), flux_angle(drive)
    )
    return {**nodes, **described}


def parameters(
    tree: dict[str, Node], own: Mapping[str, str] | None = None, more: str = ""
) -> tuple[str, int, int]:
    """The text of parameters.hpp, its fingerprint, and the bytes of its tables; `own` are headers
    from outside the package, `more` is code that follows the constants."""
    tables = Tables()
    constants = [
        f"constexpr {node['type']} {name} = {constant(node, tables, name)};\n"
        for name, node in tree.items()
    ]
    body = "\n".join([*tables.text, *constants, *([more] if more else [])])
    fingerprint = int.from_bytes(hashlib.sha256(body.encode()).digest()[:4], "big")
    names = {"DriveControl", "Protection", "Sequence", *re.findall(r"srm::(\w+)<", body)}
    includes = [*sorted({_header_of(name) for name in names}), *list(own or {})[:1]]
    text = "\n".join(
        [
            "// All parameters of the controller, as constants, from `reluctance export firmware`.",
            "#pragma once",
            "",
            *(f'#include "{header}"' for header in includes),
            "",
            "// What stands before a table, as an attribute that names its section.",
            "#ifndef RELUCTANCE_TABLE",
            "#define RELUCTANCE_TABLE",
            "#endif",
            "",
            "namespace reluctance {",
            "",
            body,
            f"constexpr std::uint32_t fingerprint = 0x{fingerprint:08X};",
            "",
            stored_tables(tables),
            "",
            "}  // namespace reluctance",
            "",
        ]
    )
    return text, fingerprint, tables.size


def commission_parameters(drive: Drive) -> str:
    """The text of commission_parameters.hpp: no part of the fingerprint, since no step reads it."""
    routines = _core.described_commission(commission(drive))
    value = constant(routines, Tables(), "commission")
    return f"""// Currents, voltages and times of commissioning, from `reluctance export firmware`.
#pragma once

#include "srm/control/commission/commission.hpp"

namespace reluctance {{

constexpr srm::Commission<float> commission = {value};

}}  // namespace reluctance
"""


def headers(texts: list[str]) -> list[str]:
    """The core's headers that these texts include, directly or not.

    Raises
    ------
    ParameterError
        If one would be written outside of the folder of the headers.
    """
    found: set[str] = set()
    while texts:
        for header in map(below, INCLUDE.findall(texts.pop())):
            if header not in found:
                found.add(header)
                texts.append((resources("include") / header).read_text("utf-8"))
    return sorted(found)


def _put(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, "utf-8")


def _header_of(name: str) -> str:
    """The header that defines struct `name`."""
    include = resources("include")
    for part in ("base", "machine", "control"):
        for path in sorted((include / "srm" / part).rglob("*.hpp")):
            if re.search(rf"^struct {name} {{", path.read_text("utf-8"), re.MULTILINE):
                return str(path.relative_to(include).as_posix())
    raise ParameterError(f"no header defines srm::{name}; the law cannot be exported")
