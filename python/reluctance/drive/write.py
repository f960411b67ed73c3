"""A drive as a drive file."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Any

from reluctance.base.files import check_ending
from reluctance.base.schema import renamed
from reluctance.base.unedited import write_unedited
from reluctance.drive.all_tables import Tables


def write_drive(drive: Tables, path: str | Path, *, comment: str = "") -> None:
    """See `Drive.save`."""
    check_ending(Path(path), {".toml"})
    write_unedited(Path(path), drive_text(drive, comment=comment, folder=Path(path).parent))


def drive_text(drive: Tables, *, comment: str = "", folder: Path | None = None) -> str:
    """The text of that file, in a folder."""
    tables = {
        name: renamed(section.filed(), section.given, partial(_seen_from, folder))
        for name, section in drive.sections().items()
        if name != "faults"
    }
    lines = [f"# {line}" for line in comment.splitlines()]
    for name, table in tables.items():
        if table:
            lines += ["", *_table(name, table)]
    for fault in drive.faults.given:
        lines += ["", *_table("[faults]", fault)]
    return "\n".join(lines).lstrip("\n") + "\n"


def _seen_from(folder: Path | None, file: Path) -> Path:
    there = file.absolute()
    if folder is not None and there.is_relative_to(folder.absolute()):
        return there.relative_to(folder.absolute())
    return there


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
