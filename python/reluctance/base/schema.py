"""Strict tables: every unknown key, wrong type or value out of range becomes one clear line."""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic.fields import FieldInfo

from reluctance.base import units
from reluctance.base.columns import point_hint
from reluctance.base.errors import ParameterError


class NamesFile:
    """Marks a key whose text names a file, relative to the file that the table stands in. `placed`,
    a drive file that is written, and the fingerprint of a drive read this mark and no list."""

    def renamed(self, text: str, rename: Callable[[Path], Path]) -> str:
        """The text with its path changed."""
        return str(rename(Path(text)))

    def files(self, text: str) -> list[Path]:
        """The files whose contents the text stands for."""
        return [Path(text)]


FileName = Annotated[str, NamesFile()]


class Section(BaseModel):
    """One table of a TOML file. Frozen; no change of type, no NaN, no infinity, no extra keys."""

    model_config = ConfigDict(
        frozen=True,
        strict=True,
        extra="forbid",
        allow_inf_nan=False,
        protected_namespaces=(),
        defer_build=True,  # a table's validator is made when first used: half of the import time
    )

    called: ClassVar[str] = ""  # the table's name in a file, where it is not that of the class

    def __init__(self, **values: Any) -> None:
        """A table made in Python; as strict, and with the same errors, as one from a file."""
        try:
            super().__init__(**values)
        except ValidationError as fault:
            raise _error(fault, type(self), self.where()) from None

    # Not an __init__ that a validation must call: as in pydantic's own RootModel.
    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]

    @classmethod
    def where(cls) -> str:
        """The table as errors name it: [converter]."""
        return f"[{cls.called or cls.__name__.lower()}]"

    @classmethod
    def read(cls, table: object, where: str) -> Self:
        """Of a file: the table, checked."""
        return checked(cls, table, where)

    @property
    def si(self) -> dict[str, Any]:
        """The values in SI, under their names without the unit: `T_s_us` is `T_s` in seconds."""
        return units.si(dict(self))

    @property
    def files(self) -> list[Path]:
        """The files that this table and the tables within it name."""
        marks, found = file_keys(type(self)), list[Path]()
        for key, value in dict(self).items():
            if isinstance(value, Section):
                found += value.files
            elif isinstance(value, str) and key in marks:
                found += marks[key].files(value)
        return found

    @property
    def given(self) -> dict[str, Any]:
        """The table as it was given, without the keys left to their defaults."""
        return self.model_dump(exclude_unset=True)

    @classmethod
    def filed(cls) -> "type[Section]":
        """The table whose keys a file has: this one, or the one that this one is computed from."""
        return cls

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A copy with other values, checked like any table."""
        if not update:
            return super().model_copy(deep=deep)
        return checked(type(self), {**self.given, **update}, self.where())

    def computed(self, **values: Any) -> Self:
        """A copy with values that were computed from checked ones, and are not checked again."""
        return super().model_copy(update=values)


S = TypeVar("S", bound=Section)


@cache
def file_keys(section: type[Section]) -> dict[str, NamesFile]:
    """The keys of a table that name files."""
    marks = {}
    for key, field in section.model_fields.items():
        for kind in (field, *get_args(field.annotation)):  # `FileName`, `FileName | None`
            for mark in (*getattr(kind, "metadata", ()), *getattr(kind, "__metadata__", ())):
                if isinstance(mark, NamesFile):
                    marks[key] = mark
    return marks


def renamed(
    section: type[Section], table: Mapping[str, Any], rename: Callable[[Path], Path]
) -> dict[str, Any]:
    """A table as a file has it, with the path of every file in it changed."""
    marks, found = file_keys(section), dict(table)
    for key, value in table.items():
        if isinstance(value, str) and key in marks:
            found[key] = marks[key].renamed(value, rename)
        elif isinstance(value, Mapping) and key in section.model_fields:
            inner = _section_of(section.model_fields[key])
            found[key] = value if inner is None else renamed(inner, value, rename)
    return found


def placed(section: type[Section], table: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """A table with the files in it seen from here instead of from the folder of its file."""
    return renamed(section, table, lambda path: folder / path)


def field_of(section: type[Section], path: Sequence[str]) -> FieldInfo | None:
    """A key of a table, or of the tables within it; None where there is none."""
    *tables, key = path
    for part in tables:
        field = section.model_fields.get(part)
        inner = None if field is None else _section_of(field)
        if inner is None:
            return None
        section = inner
    return section.model_fields.get(key)


NEEDS = {  # pydantic's kinds of fault, as a need
    "greater_than": "need > {gt}",
    "greater_than_equal": "need >= {ge}",
    "less_than": "need < {lt}",
    "less_than_equal": "need <= {le}",
    "finite_number": "need a finite number",
    "float_type": "need a number",
    "int_type": "need a whole number",
    "bool_type": "need true or false",
    "bool_parsing": "need true or false",
    "string_type": "need text in quotes",
    "literal_error": "need {expected}",
    "list_type": "need a list, as in [1, 2]",
    "too_short": "need at least {min_length} value",
    "tuple_type": "need a list",
    "date_type": "need a date without quotes, as in 2025-02-28",
    "date_from_datetime_parsing": "need a date without quotes, as in 2025-02-28",
    "model_type": "need a table",
}


NOTHING = ("none", "null", "nil", "")  # as other languages have it
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"

OVER_TIME = {"t_s", "values"}  # keys of a table that may be a course


def checked(section: type[S], table: object, where: str) -> S:
    """The table as a Section.

    Raises
    ------
    ParameterError
        With the first fault (what, the value, the need) and the count of the others.
    """
    if not isinstance(table, dict):
        raise ParameterError(f"{where} = {table!r}, need a table")
    try:
        return section.model_validate(table)
    except ValidationError as fault:
        raise _error(fault, section, where) from None


def check_places(
    data: Mapping[str, object], kinds: Mapping[str, type[Section]], within: str = ""
) -> None:
    """Refuses a key that stands in the wrong one of several tables, and names the right one.

    Raises
    ------
    ParameterError
        For a key that its table does not have, and another one has.
    """
    given = {name: table for name, table in data.items() if isinstance(table, dict)}
    for name, table in given.items():
        kind = kinds.get(name)
        if kind is None or kind.model_config.get("extra") != "forbid":
            continue
        for key in table:
            if key in _keys(kind):
                continue
            homes = [other for other, its in kinds.items() if key in _keys(its)]
            bare = [other for other in homes if key not in given.get(other, {})]
            best = [other for other in bare if other in given] or bare or homes
            if best:
                places = " or ".join(f"[{within}{home}]" for home in best)
                todo = f"it belongs in {places}" if bare else f"remove it, {places} has it"
                raise ParameterError(f"unknown key `{key}` in [{within}{name}]; {todo}")


def _error(fault: ValidationError, section: type[Section], where: str) -> ParameterError:
    """The first fault on one line, and the count of the others."""
    # An unknown key first: it is often the cause of a missing one.
    errors = sorted(fault.errors(), key=lambda e: e["type"] != "extra_forbidden")
    more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
    return ParameterError(_line(dict(errors[0]), section, where) + more)


NEAR = 0.65  # likeness of words: `lwa` and `law` have 0.67, `kind` and `K_i_Nm` 0.6


def did_you_mean(word: str, words: Iterable[str]) -> str:
    """The ending of an error about a mistyped word: the nearest known one, or all of them."""
    from difflib import get_close_matches  # for mistakes only

    known = {w.lower(): w for w in sorted(words)}
    longer = [w for low, w in known.items() if low.startswith(word.lower() + "_")]
    parts = set(word.lower().split("_"))  # H_m has both parts of H_static_m
    between = [w for low, w in known.items() if len(parts) > 1 and parts < set(low.split("_"))]
    close = get_close_matches(word.lower(), known, n=1, cutoff=NEAR)
    near = longer or between or [known[m] for m in close]
    if near:
        return f"; did you mean `{near[0]}`?"
    return f"; known: {', '.join(f'`{w}`' for w in known.values())}"


def _in_its_unit(name: str, value: object, known: Iterable[str]) -> str:
    """The ending of an error about a key that is known in another unit, with the value in it."""
    for key in known:
        factor = units.in_unit_of(name, key)
        if factor is not None and isinstance(value, int | float) and not isinstance(value, bool):
            return f"; did you mean `{key} = {factor * value:.10g}`?"
    return ""


def _line(error: dict[str, Any], section: type[Section], where: str) -> str:
    section, where, path = _inner(error["loc"], section, where)
    key = ".".join(map(str, path))
    if error["type"] == "extra_forbidden":
        known, name = _keys(section), str(path[-1])
        near = _in_its_unit(name, error["input"], known) or did_you_mean(name, known)
        return f"unknown key `{key}` in {where}{near}"
    if error["type"] == "missing":
        field = section.model_fields.get(key)
        if field is not None and _section_of(field) is not None:
            return f"missing table {where[:-1]}.{key}]"
        return f"missing key `{key}` in {where}"
    if error["type"] == "value_error":
        return _of_table(str(error["ctx"]["error"]), section, where)
    keys = section.model_fields.keys()
    need = NEEDS.get(error["type"], error["msg"]).format(**error.get("ctx", {}))
    if error["type"] == "float_type" and isinstance(error["input"], str):
        need += number_hint(error["input"], key)
    if error["type"] == "float_type" and isinstance(error["input"], list) and OVER_TIME <= keys:
        need += "; in its place t_s and values of the same length are a course over time"
    return f"{where} {key} = {error['input']!r}, {need}"


def _inner(
    path: tuple[str | int, ...], section: type[Section], where: str
) -> tuple[type[Section], str, tuple[str | int, ...]]:
    """The table within a table that a path leads to, how a file names it, and what is left."""
    while len(path) > 1:
        field = section.model_fields.get(str(path[0]))
        inner = None if field is None else _section_of(field)
        if inner is None or not where.endswith("]"):
            break
        section, where, path = inner, f"{where[:-1]}.{path[0]}]", path[1:]
    return section, where, path


def _of_table(told: str, section: type[Section], where: str) -> str:
    """What a check says, which begins with `key` or `table.key`, after the name of that table."""
    words = told.split(" ", 1)
    _, where, path = _inner(tuple(words[0].split(".")), section, where)
    return " ".join([where, ".".join(map(str, path)), *words[1:]])


def of_option(fault: ValidationError, name: str, unit: str) -> str:
    """What is wrong with the value of an option of a command, in this unit, on one line."""
    error = fault.errors()[0]
    kind = error["type"].replace("_parsing", "_type")
    need = NEEDS.get(kind, error["msg"]).format(**error.get("ctx", {}))
    if isinstance(error["input"], str):
        need += number_hint(error["input"], f"{name}_{unit}" if unit else name)
    return f"{name} = {error['input']!r}, {need}"


def number_hint(text: str, key: str) -> str:
    """What to say of a text that was meant as a number, or as several."""
    if hint := point_hint(text):
        return f"; {hint}"
    if text.lower() in NOTHING:
        return f"; to give none, leave the key out (--set TABLE.{key}= removes it)"
    if with_unit := re.fullmatch(rf"({NUMBER})\s*([^\W\d_][\w/]*)", text):
        return _without_unit(float(with_unit[1]), with_unit[2], key)
    if ends := re.fullmatch(r"([-+]?[\d.]+)(?:-|\.\.|~| to )([-+]?[\d.]+)", text):
        return f"; a range is FROM:TO:COUNT, as in {ends[1]}:{ends[2]}:5"
    return ""


def _without_unit(value: float, unit: str, key: str) -> str:
    """What to say of a number with a unit: its value in that of the key, where both are known."""
    stem, _, own = key.rpartition("_")
    factor = (
        1.0
        if unit.lower() == own.lower()
        else units.in_unit_of(f"{stem}_{unit.replace('/', 'p')}", key)
    )
    if factor is None:
        told = f"in {own}" if own in units.WRITTEN else "without a unit"
        return f"; write the number alone, {told}"
    return f"; write the number alone, as in {factor * value:.10g}"


def _keys(section: type[Section]) -> list[str]:
    """The keys of a table as files have them."""
    return [field.alias or name for name, field in section.model_fields.items()]


def inner_sections(section: type[Section]) -> dict[str, type[Section]]:
    """The tables within a table, by their keys."""
    found = {key: _section_of(field) for key, field in section.model_fields.items()}
    return {key: inner for key, inner in found.items() if inner is not None}


def _section_of(field: FieldInfo) -> type[Section] | None:
    """The table that a key of a table holds; None where it holds none."""
    kinds = (field.annotation, *get_args(field.annotation))
    tables = (kind for kind in kinds if isinstance(kind, type) and issubclass(kind, Section))
    return next(tables, None)
