"""A drive as a drive file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from reluctance.drive import Drive
from reluctance.drive.own_code import names_code, own_code
from reluctance.files import check_ending, is_file, write_text

PATHS = (
    ("machine", "map"),
    ("machine", "torque_map"),
    ("load", "pump"),
    ("control", "angle_table"),
)


def write_drive(drive: Drive, path: str | Path, *, comment: str = "") -> None:
    """Writes a file that `load` reads as the same drive. Files that it names are named by their
    absolute paths.

    Raises
    ------
    ParameterError
        If the ending is not .toml or the disk does not take it.
    """
    check_ending(Path(path), {".toml"})
    write_text(Path(path), drive_text(drive, comment=comment))


def drive_text(drive: Drive, *, comment: str = "") -> str:
    """The text of that file."""
    tables = drive.tables()
    for section, key in PATHS:
        named = tables.get(section, {}).get(key)
        if isinstance(named, str) and is_file(Path(named)):
            tables[section][key] = str(Path(named).absolute())
    law = tables["control"].get("law")
    if names_code(law):
        code = own_code(str(law))
        tables["control"]["law"] = f"{code.kind}{code.file.absolute()}:{code.name}"
    lines = [f"# {line}" for line in comment.splitlines()]
    for name, table in tables.items():
        if table:
            lines += ["", *_table(name, table)]
    return "\n".join(lines).lstrip("\n") + "\n"


def _table(name: str, table: dict[str, Any]) -> list[str]:
    inner = {key: value for key, value in table.items() if isinstance(value, dict)}
    lines = [f"[{name}]"]
    lines += [f"{k} = {_value(v)}" for k, v in table.items() if k not in inner and v is not None]
    for key, below in inner.items():
        lines += ["", *_table(f"{name}.{key}", below)]
    return lines


def _value(value: Any) -> str:
    """JSON's text is TOML's, for numbers, truth values, lists, and text but for one escape."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
