"""Reading TOML, with what people write instead of it."""

import re
from pathlib import Path
from typing import Any

from reluctance.base.columns import point_hint
from reluctance.base.errors import ParameterError, one_line
from reluctance.base.files import exists, is_file, note_input, why

MAX_TOML_BYTES = 1_000_000  # a drive or machine file has a few kilobytes
MOST_DOTS = 100  # in a key: the parser's time and memory rise with the square of its parts
TABLES_OF_NUMBERS = (".csv", ".txt", ".tsv", ".dat", ".xlsx", ".xls", ".mat", ".json")
KEY_ENDS = re.compile(r"[=,\[\]{}]")


def read_toml(path: Path) -> dict[str, Any]:
    """A TOML file.

    Raises
    ------
    ParameterError
        If it cannot be read or parsed.
    """
    import tomllib  # here, as tempfile below: a tenth of the import time of the package

    note_input(path)
    try:
        with path.open("rb") as file:
            content = file.read(MAX_TOML_BYTES + 1)
    except (OSError, ValueError) as fault:  # ValueError: a zero byte in the name
        raise ParameterError(f"cannot read {path}: {why(fault)}{_other_file(path)}") from None
    if len(content) > MAX_TOML_BYTES:
        raise ParameterError(
            f"{path} has more than {MAX_TOML_BYTES / 1e6:g} MB, need a TOML file of some kilobytes"
        )
    try:
        text = content.decode("utf-8-sig")
        lines = (line for line in text.splitlines() if not line.lstrip().startswith("#"))
        parts = (part for line in lines for part in KEY_ENDS.split(line))
        deepest = max((part.count(".") for part in parts), default=0)
        if deepest > MOST_DOTS:
            raise ParameterError(
                f"{path}: a key of {deepest + 1} parts, need at most {MOST_DOTS}; check the quotes"
            )
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as fault:
        if path.suffix.lower() in TABLES_OF_NUMBERS:
            raise ParameterError(
                f"{path} is a table of numbers, need a .toml file; if it is a flux map, "
                "`reluctance map import` makes a machine file of it"
            ) from None
        raise ParameterError(
            f"{path} is not valid TOML: {one_line(fault)}{_toml_hint(fault, content)}"
        ) from None


def _other_file(path: Path) -> str:
    """The ending of an error about a file that is not there: the one that was meant."""
    from reluctance.base.resources import resources  # for mistakes only

    if is_file(Path(f"{path}.toml")):
        return f"; did you mean {path}.toml?"
    name = path.name.removesuffix(".toml")
    if not exists(path) and is_file(resources("examples") / f"{name}.toml"):
        return f"; `reluctance examples {name} --copy .` copies the example of this name"
    return ""


def _toml_hint(fault: Exception, content: bytes) -> str:
    """What people write instead of TOML."""
    from reluctance.base.mended import meant  # for mistakes only

    if isinstance(fault, UnicodeDecodeError):
        return "; save the file as UTF-8"
    if "Invalid date" in str(fault):
        return "; need a day of the calendar, as in 2025-02-28"
    if "Cannot overwrite" in str(fault) or "twice" in str(fault):
        return "; it stands there twice, remove one"
    place = re.search(r"line (\d+)", str(fault))
    lines = content.decode("utf-8-sig", "replace").splitlines()
    line = lines[int(place[1]) - 1] if place and int(place[1]) <= len(lines) else ""
    if day := re.search(r"=\s*(\d{1,2})\.(\d{1,2})\.(\d{4})\b", line):
        return f"; need a date as {day[3]}-{day[2]:0>2}-{day[1]:0>2}"
    if comma := re.search(r"=\s*([-+]?\d+,\d+)\s*(#.*)?$", line):
        return f"; {point_hint(comma[1])}"
    if place:
        return f"; write `{right}`" if (right := meant(line)) else ""
    for number, each in enumerate(lines, 1):  # a text without its end
        if right := meant(each):
            return f"; in line {number} write `{right}`"
    return ""


def toml_value(text: str) -> Any:
    """A value as TOML has it; a bare word is text."""
    import tomllib

    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text
