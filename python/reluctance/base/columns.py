"""Columns as people name them: any case, a unit in brackets or behind an underscore."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from reluctance.base.errors import ParameterError

SUPERSCRIPTS = str.maketrans("²³", "23")
BRACKETED = re.compile(r"^(?P<stem>.*?)\s*[\[(](?P<unit>[^\[\]()]*(?:\([^()]*\))?)[\])]\s*$")

# A number from one separator (or the end of the line) to the next, with a point or a comma in it.
COMMA = re.compile(r"(?<![^\s;\"])([-+]?\d*),(\d+(?:[eE][-+]?\d+)?)(?![^\s;\"])")
POINT = re.compile(r"(?<![^\s;\"])[-+]?\d*\.\d+(?:[eE][-+]?\d+)?(?![^\s;\"])")

# A number in groups of three digits, and a decimal mark that is another one.
THOUSANDS = re.compile(
    r"(?P<whole>[-+]?[1-9]\d{0,2}(?:(?P<mark>[.,' \u2019\u00a0\u202f])\d{3})(?:(?P=mark)\d{3})*)"
    r"(?P<decimal>(?!(?P=mark))[.,]\d+)?"
)


@dataclass(frozen=True)
class Quantity:
    """What a column may hold: its names, and its units with their factors to the first one."""

    stems: tuple[str, ...]
    units: Mapping[str, float]


def recognised(
    names: Sequence[str], wanted: Mapping[str, Quantity], *, stated: Mapping[str, str] | None = None
) -> dict[str, tuple[str, float]]:
    """Quantity -> (column, factor to its first unit). `stated` says which column is a quantity.

    Raises
    ------
    ParameterError
        If two columns are one quantity, a stated one is missing, or a unit is unknown.
    """
    found: dict[str, tuple[str, float]] = {}
    for quantity, name in (stated or {}).items():
        if quantity not in wanted or name not in names:
            raise ParameterError(f"no column `{name}` for {quantity}; there are {', '.join(names)}")
        found[quantity] = (name, _factor(name, wanted[quantity]) or 1.0)
    for name in names:
        if name in (stated or {}).values():
            continue
        for quantity, of in wanted.items():
            whole = name.strip().lower() in of.stems  # `G(h)` of PVGIS has no unit
            factor = 1.0 if whole else _factor(name, of) if _stem(name, of) in of.stems else None
            if factor is None or quantity in (stated or {}):
                continue
            if quantity in found:
                raise ParameterError(
                    f"columns `{found[quantity][0]}` and `{name}` are both {quantity}; remove one"
                )
            found[quantity] = (name, factor)
    return found


def without_unit(names: Sequence[str], wanted: Mapping[str, Quantity]) -> dict[str, str]:
    """Column -> the unit that it is taken in, of those of `recognised` that name none."""
    return {
        name: next(iter(wanted[quantity].units))
        for quantity, (name, _) in recognised(names, wanted).items()
        if _unit(name, wanted[quantity]) == ""
    }


def _parts(name: str) -> tuple[str, str | None]:
    """Name and unit in brackets, in lower case."""
    match = BRACKETED.match(name)
    if match is None:
        return name.strip().lower(), None
    return match["stem"].strip().lower(), match["unit"].strip().lower().translate(SUPERSCRIPTS)


def _stem(name: str, of: Quantity) -> str:
    stem, unit = _parts(name)
    if unit is None:
        head, _, tail = stem.rpartition("_")
        stem = head if head and tail in of.units else stem
    return stem.replace(" ", "_")


def _factor(name: str, of: Quantity) -> float | None:
    """To the first unit; 1 where the name has none."""
    unit = _unit(name, of)
    if not unit:
        return 1.0
    if unit not in of.units:
        raise ParameterError(f"column `{name}` has the unit `{unit}`, need {' or '.join(of.units)}")
    return of.units[unit]


def _unit(name: str, of: Quantity) -> str:
    """That a name states; empty where it states none."""
    stem, unit = _parts(name)
    if unit is None:
        head, _, tail = stem.rpartition("_")
        unit = tail if head and tail in of.units else ""
    return unit


def with_points(lines: Sequence[str], separator: str | None) -> list[str]:
    """Lines of cells with the decimal commas of their numbers as points. Between commas as
    separators none is taken for a decimal one; nor where another number has a point."""
    if separator == ",":
        return list(lines)
    if any(POINT.search(line) for line in lines):
        return list(lines)
    return [COMMA.sub(r"\1.\2", line) for line in lines]


def refuse_parted(rows: Sequence[Sequence[str]]) -> None:
    """Raises ParameterError where commas between cells part the numbers of rows, too: more cells
    than the names have in the first row, and no decimal point among them."""
    names, *rest = ([*row] for row in rows or [[]])
    while names and not names[-1]:
        names.pop()
    for row in rest:
        while row and not row[-1]:
            row.pop()
        if len(names) > 1 and len(row) > len(names) and not any("." in cell for cell in row):
            raise ParameterError(
                f"the row `{','.join(row)[:60]}` has {len(row)} cells for {len(names)} names: "
                "commas stand in its numbers and between them; write decimal points, or put "
                "semicolons between the cells"
            )


def point_hint(text: str) -> str:
    """What to say of a text that is a number with a decimal comma, or with marks that part its
    thousands; else nothing."""
    if parted := THOUSANDS.fullmatch(text.strip()):
        mark, decimal = parted["mark"], parted["decimal"] or ""
        if decimal or mark not in ".," or parted["whole"].count(mark) > 1:
            right = parted["whole"].replace(mark, "") + decimal.replace(",", ".")
            return f"the `{mark}` in it parts thousands: write {right}"
    if re.fullmatch(r"\s*[-+]?\d+,\d+\s*", text) is None:
        return ""
    hint = f"write a decimal point, as in {text.strip().replace(',', '.')}"
    if re.fullmatch(r"\s*[-+]?[1-9]\d{0,2},\d{3}\s*", text):
        hint += f", or {text.strip().replace(',', '')} where the comma parts thousands"
    return hint
