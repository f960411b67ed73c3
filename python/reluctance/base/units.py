"""Units: one table from a key's suffix to SI, for every border (TOML, command line, CSV, JSON).

A quantity in a file or on the command line ends in its unit, `speed_rpm`, `T_s_us`; inside the
package it has the name before the suffix and is in SI: rad/s, s. Frequencies stay in Hz.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from functools import cache
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from reluctance.base.errors import Note, ParameterError

Value = TypeVar("Value", float, NDArray[np.float64])

# Suffix: (a, b) with SI value = value a/b. 1500 rpm there and back is 1500 rpm to the last bit.
UNITS: dict[str, tuple[float, float]] = {
    "rpm": (math.pi, 30.0),
    "deg": (math.pi / 180, 1.0),
    "us": (1e-6, 1.0),
    "uF": (1e-6, 1.0),
    "kHz": (1e3, 1.0),
    "mJ": (1e-3, 1.0),
    "KiB": (1024.0, 1.0),
    "ms": (1e-3, 1.0),
    "rpmps": (math.pi, 30.0),  # per second
    "rpmpV": (math.pi, 30.0),  # per volt
    "rpmpVs": (math.pi, 30.0),  # per volt and second
    "pct": (1.0, 100.0),
    "pctpK": (1.0, 100.0),
    "mm": (1e-3, 1.0),
    "m3ph": (1.0, 3600.0),
} | dict.fromkeys(
    (
        *("s", "Hz", "rad", "m", "kg", "A", "V", "W", "J", "ohm", "H", "F", "Wb", "B"),
        *("Nm", "Nms", "Nms2", "NmpV", "NmpVs", "kgm2", "degC", "Wpm2", "ApK"),
    ),
    (1.0, 1.0),
)
# Units as people write them, each with its prefixes: of what, and how much in SI.
PREFIXES = {"": 1.0, "n": 1e-9, "u": 1e-6, "m": 1e-3, "k": 1e3, "M": 1e6}
PLAIN = ("s", "Hz", "m", "V", "A", "W", "J", "ohm", "H", "F", "Wb", "Nm")
WRITTEN = {prefix + unit: (unit, a) for unit in PLAIN for prefix, a in PREFIXES.items()} | {
    "cm": ("m", 1e-2),
    "min": ("s", 60.0),
    "h": ("s", 3600.0),
    "rad": ("rad", 1.0),
    "deg": ("rad", math.pi / 180),
    "radps": ("radps", 1.0),
    "rpm": ("radps", math.pi / 30),
}
COUNTS = {"N_s"}  # names that only look as if they ended in a unit: stator poles


@cache
def name_and_unit(key: str) -> tuple[str, str | None]:
    """The name and the unit of a key: `speed_rpm` is `speed` in rpm; None where it has no unit."""
    name, _, suffix = key.rpartition("_")
    return (name, suffix) if name and suffix in UNITS and key not in COUNTS else (key, None)


def in_unit_of(written: str, key: str) -> float | None:
    """The factor from the unit of a name as somebody wrote it, `u_dc_kV`, to that of a key,
    `u_dc_V`; None where these are no two units of one quantity."""
    (name, _, unit), (known, _, own) = written.rpartition("_"), key.rpartition("_")
    if name.lower() != known.lower() or unit == own or not {unit, own} <= WRITTEN.keys():
        return None
    (what, a), (needed, b) = WRITTEN[unit], WRITTEN[own]
    return a / b if what == needed else None


def ask_about_radians(**deg: float) -> None:
    """A Note where angles that are given in degrees would be angles up to half a turn in radians,
    all of them."""
    if not any(deg.values()) or max(map(abs, deg.values())) > math.pi:
        return
    given = ", ".join(f"{key} = {value:g}" for key, value in deg.items())
    meant = ", ".join(f"{key} = {math.degrees(value):.4g}" for key, value in deg.items())
    warnings.warn(f"{given}: if these are radians, set {meant}", Note, stacklevel=3)


def to_si(value: Value, unit: str | None) -> Value:
    """A value or an array in SI, from a unit of the table; None: it has no unit."""
    a, b = UNITS[unit] if unit else (1.0, 1.0)
    return value * a / b


def from_si(value: Value, unit: str | None) -> Value:
    """A value or an array in a unit of the table, from SI; None: it has no unit."""
    a, b = UNITS[unit] if unit else (1.0, 1.0)
    return value * b / a


def si(table: Mapping[str, Any]) -> dict[str, Any]:
    """The values of a table in SI, under their names without the unit.

    Lists are converted element by element. Truth values, text and None stay.

    Examples
    --------
    >>> si({"u_dc_V": 240.0, "dead_time_us": 2.0, "comparators": "analog"})
    {'u_dc': 240.0, 'dead_time': 2e-06, 'comparators': 'analog'}
    """
    found = {}
    for key, value in table.items():
        name, unit = name_and_unit(key)
        found[name] = _converted(value, unit)
    return found


def si_once(table: Mapping[str, Any]) -> dict[str, Any]:
    """The same for keys that nobody has listed.

    Raises
    ------
    ParameterError
        If a quantity is given in two units.
    """
    keys: dict[str, str] = {}
    for key in table:
        name, _ = name_and_unit(key)
        if name in keys:
            raise ParameterError(f"`{keys[name]}` and `{key}` are one quantity; give one of them")
        keys[name] = key
    return si(table)


def _converted(value: Any, unit: str | None) -> Any:
    if isinstance(value, list | tuple):
        return [_converted(v, unit) for v in value]
    number = isinstance(value, float | int) and not isinstance(value, bool)
    return to_si(float(value), unit) if unit and number else value


def hertz(text: str) -> float:
    """A frequency as people write it: 20kHz, 20 kHz, 20000, 2e4 Hz.

    Raises
    ------
    ParameterError
        If it is not a positive frequency.
    """
    number = text.strip().lower().removesuffix("hz").rstrip()
    scale = 1e3 if number.endswith("k") else 1.0
    try:
        value = scale * float(number.removesuffix("k"))
    except ValueError:
        value = math.nan
    if not 0 < value < math.inf:
        raise ParameterError(f"frequency `{text}`, need a positive one such as 20kHz or 20000")
    return value
