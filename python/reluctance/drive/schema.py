"""Strict tables: every unknown key, wrong type or value out of range becomes one clear line."""

from collections.abc import Iterable, Mapping
from typing import Any, Self, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic.fields import FieldInfo

from reluctance import units
from reluctance.errors import ParameterError


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

    @property
    def si(self) -> dict[str, Any]:
        """The values in SI, under their names without the unit: `T_s_us` is `T_s` in seconds."""
        return units.si(dict(self))

    @property
    def given(self) -> dict[str, Any]:
        """The table as it was given, without the keys left to their defaults."""
        return self.model_dump(exclude_unset=True)

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A copy with other values, checked like any table."""
        if not update:
            return super().model_copy(deep=deep)
        return checked(type(self), {**self.given, **update}, f"[{type(self).__name__.lower()}]")

    def computed(self, **values: Any) -> Self:
        """A copy with values that were computed from checked ones, and are not checked again."""
        return super().model_copy(update=values)


S = TypeVar("S", bound=Section)

NEEDS = {  # pydantic's kinds of fault, as a need
    "greater_than": "need > {gt}",
    "greater_than_equal": "need >= {ge}",
    "less_than": "need < {lt}",
    "less_than_equal": "need <= {le}",
    "finite_number": "need a finite number",
    "float_type": "need a number",
    "int_type": "need a whole number",
    "string_type": "need text in quotes",
    "literal_error": "need {expected}",
    "list_type": "need a list, as in [1, 2]",
    "too_short": "need at least {min_length} value",
    "tuple_type": "need a list",
    "model_type": "need a table",
}


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
        # An unknown key first: it is often the cause of a missing one.
        errors = sorted(fault.errors(), key=lambda e: e["type"] != "extra_forbidden")
        more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
        raise ParameterError(_line(dict(errors[0]), section, where) + more) from None


def did_you_mean(word: str, words: Iterable[str]) -> str:
    """The ending of an error about a mistyped word: the nearest known one, or all of them."""
    from difflib import get_close_matches  # for mistakes only

    known = {w.lower(): w for w in sorted(words)}
    longer = [w for low, w in known.items() if low.startswith(word.lower() + "_")]
    near = longer or [known[m] for m in get_close_matches(word.lower(), known, n=1)]
    if near:
        return f"; did you mean `{near[0]}`?"
    return f"; known: {', '.join(f'`{w}`' for w in known.values())}"


def _line(error: dict[str, Any], section: type[Section], where: str) -> str:
    key = ".".join(str(part) for part in error["loc"])
    if error["type"] == "extra_forbidden":
        for part in error["loc"][:-1]:  # a table within the table
            section = _section_of(section.model_fields[part])
        near = did_you_mean(str(error["loc"][-1]), section.model_fields)
        return f"unknown key `{key}` in {where}{near}"
    if error["type"] == "missing":
        return f"missing key `{key}` in {where}"
    if error["type"] == "value_error":
        return f"{where} {error['ctx']['error']}"
    need = NEEDS.get(error["type"], error["msg"]).format(**error.get("ctx", {}))
    return f"{where} {key} = {error['input']!r}, {need}"


def _section_of(field: FieldInfo) -> type[Section]:
    """The table that a key of a table holds."""
    kinds = (field.annotation, *get_args(field.annotation))
    return next(kind for kind in kinds if isinstance(kind, type) and issubclass(kind, Section))
