"""What a sweep varies: keys of a drive file and their values, in a grid or by samples."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import product
from math import ceil, log2, prod
from typing import Any, get_args

import numpy as np

from reluctance.base.errors import ParameterError
from reluctance.base.schema import field_of
from reluctance.base.toml_file import toml_value
from reluctance.base.units import name_and_unit
from reluctance.drive.drive import Drive

Vary = Mapping[str, Sequence[Any]]
Columns = dict[str, list[Any]]  # of as many points each

MOST_POINTS = 10_000_000  # of a sweep; more would not fit into memory
FORM = "section.key=FROM:TO:COUNT, FROM:TO for samples, or a list as in 1,2,5"


def parsed(text: str) -> tuple[str, list[Any]]:
    """A key and its values from `section.key=...`: `0:60:31` are 31 values from 0 to 60, `0:60` the
    ends of a range for samples, `1,2,5` or `[1, 2, 5]` a list; words are text.

    Raises
    ------
    ParameterError
        If it is none of these.
    """
    name, equals, given = (part.strip() for part in text.partition("="))
    if not equals or not given or not name:
        raise ParameterError(f"--vary {text}: need {FORM}")
    if ":" in given and not _names_a_file(name):
        return name, _range(text, given.split(":"))
    value = toml_value(given)
    if isinstance(value, list):
        return name, value
    return name, [toml_value(part.strip()) for part in given.split(",")]


def parsed_all(texts: Iterable[str]) -> dict[str, list[Any]]:
    """The keys and values of several texts for `parsed`.

    Raises
    ------
    ParameterError
        If a key is there twice, and as `parsed`.
    """
    found: dict[str, list[Any]] = {}
    for name, values in map(parsed, texts):
        if name in found:
            raise ParameterError(f"{name} is there twice; give all of its values at once")
        found[name] = values
    return found


def key_of(name: str) -> str:
    """The key that a name ends with; of a number in a list `i_offset_0_A` for
    `sensing.i_offset_A.0`, so that it keeps its unit."""
    above, _, key = name.rpartition(".")
    if not key.isdecimal():
        return key
    plain, unit = name_and_unit(above.rpartition(".")[2])
    return "_".join([plain, key, *([unit] if unit else [])])


def is_range(text: str) -> bool:
    """Whether a text for `parsed` is the ends of a range for samples."""
    name, _, given = text.partition("=")
    return given.count(":") == 1 and not _names_a_file(name.strip())


def _names_a_file(name: str) -> bool:
    """Values of such a key may have a colon."""
    return name.rpartition(".")[2] in ("machine", "law")


def _range(text: str, parts: list[str]) -> list[Any]:
    try:
        ends = [float(part) for part in parts[:2]]
        count = int(parts[2]) if len(parts) == 3 else 2
    except ValueError:
        count = 0
    if count < 1 or len(parts) > 3 or not np.isfinite(ends).all():
        raise ParameterError(f"--vary {text}: need {FORM}")
    if count > MOST_POINTS:
        raise ParameterError(f"--vary {text}: need at most {MOST_POINTS:.0e} values")
    values = np.linspace(ends[0], ends[1], count)
    if all(value == round(value) for value in values):
        return [round(value) for value in values.tolist()]
    return [float(f"{value:.12g}") for value in values]


def checked(vary: Vary) -> dict[str, list[Any]]:
    """The same as lists, if they can be meant."""
    if not isinstance(vary, Mapping) or not vary:
        raise ParameterError(
            f"vary = {vary!r}, need a dict as in {{'control.theta_on_deg': range(0, 60, 2)}}"
        )
    found = {}
    for name, values in vary.items():
        if isinstance(values, str) or not hasattr(values, "__iter__"):
            raise ParameterError(f"vary {name} = {values!r}, need a list of values")
        found[name] = np.asarray(values).tolist() if isinstance(values, np.ndarray) else [*values]
        if not found[name]:
            raise ParameterError(f"vary {name} = [], need at least one value")
    return found


def grid(vary: Mapping[str, list[Any]]) -> Columns:
    """All combinations; the last key varies fastest."""
    count = prod(len(values) for values in vary.values())
    if count > MOST_POINTS:
        raise ParameterError(f"the grid has {count:.2g} points, need at most {MOST_POINTS:.0e}")
    columns: Columns = {name: [] for name in vary}
    for point in product(*vary.values()):
        for name, value in zip(vary, point, strict=True):
            columns[name].append(value)
    return columns


def samples(
    drive: Drive, vary: Mapping[str, list[Any]], count: int, *, sobol: bool, seed: int
) -> Columns:
    """Points within ranges. Two numbers are a range; other values are choices, each as likely.

    Parameters
    ----------
    drive : tells which keys take whole numbers.
    sobol : bool
        A scrambled Sobol sequence, which fills space evenly; else independent random numbers.
    seed : the same seed gives the same points.
    """
    if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= MOST_POINTS:
        raise ParameterError(f"samples = {count!r}, need a number from 1 to {MOST_POINTS:.0e}")
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise ParameterError(f"seed = {seed!r}, need a whole number >= 0")
    generator = np.random.default_rng(seed)
    if sobol:
        from scipy.stats import qmc

        unit = qmc.Sobol(len(vary), seed=generator).random_base2(ceil(log2(count)))[:count]
    else:
        unit = generator.random((count, len(vary)))
    return {
        name: _spread(values, column, whole(drive, name))
        for (name, values), column in zip(vary.items(), unit.T, strict=True)
    }


def _spread(values: list[Any], unit: Any, is_whole: bool) -> list[Any]:
    """Numbers of [0, 1) over a range, or over choices."""
    numbers = all(isinstance(v, int | float) and not isinstance(v, bool) for v in values)
    if not (numbers and len(values) == 2):
        return [values[int(u * len(values))] for u in unit]
    low, high = values
    if is_whole:
        return [int(low + np.floor(u * (high - low + 1))) for u in unit]
    return [float(f"{low + u * (high - low):.12g}") for u in unit]


def whole(drive: Drive, name: str) -> bool:
    """True where a key takes whole numbers."""
    table, *path = name.split(".")
    section = drive.sections().get(table)
    field = field_of(section.filed(), path) if section is not None and path else None
    return field is not None and int in (field.annotation, *get_args(field.annotation))
