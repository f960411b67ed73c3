"""Where the values of a table end: the bound that one value misses, whatever else is needed."""

from types import NoneType, UnionType
from typing import Union, get_args, get_origin

from pydantic import ValidationError

BOUNDS = {"greater_than", "greater_than_equal", "less_than", "less_than_equal"}
# What is never negative, by the unit that its key ends in; a share of a hundred ends there.
SIZES = (
    "ohm",
    "F",
    "uF",
    "kgm2",
    "Hz",
    "kHz",
    "s",
    "ms",
    "us",
    "mJ",
    "mm",
    "m",
    "Nms",
    "Nms2",
    "W",
)
SIZES += ("H", "Wb", "K", "LSB")


def fault_of(section, key, value):
    """The bound that a value misses; None where it is within."""
    try:
        section.model_validate({key: value})
    except ValidationError as found:
        faults = [e["type"] for e in found.errors() if e["loc"][:1] == (key,)]
        return next((kind for kind in faults if kind in BOUNDS), None)
    return None


def numbers(section):
    """Keys of a table that are one number, with True where it is a whole one."""
    for key, field in section.model_fields.items():
        several = get_origin(field.annotation) in (Union, UnionType)
        kinds = {*(get_args(field.annotation) if several else (field.annotation,))} - {NoneType}
        if kinds in ({float}, {int}):
            yield key, kinds == {int}
