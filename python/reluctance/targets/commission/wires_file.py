"""A file that says how somebody has wired a board: the fields of `Wires`, in TOML."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

from reluctance.base.errors import ParameterError
from reluctance.base.schema import did_you_mean
from reluctance.base.toml_file import read_toml
from reluctance.targets.commission.bench import Wires


def read_wires(path: Path) -> Wires:
    """The wires of a TOML file.

    Raises
    ------
    ParameterError
        If a key is unknown, or its value is not what it must be.
    """
    given: dict[str, Any] = read_toml(path)
    names = [f.name for f in fields(Wires)]
    for name, value in given.items():
        if name not in names:
            raise ParameterError(f"unknown key `{name}` in {path}{did_you_mean(name, names)}")
        listed = name in ("phase", "sensor", "sign")
        numbers = value if listed and isinstance(value, list) else [value]
        right = isinstance(value, list) == listed and all(
            isinstance(n, int | float if name == "zero_deg" else int) and not isinstance(n, bool)
            for n in numbers
        )
        if not right:
            need = "whole numbers, as in [0, 2, 1]" if listed else "a number"
            raise ParameterError(f"{name} = {value!r} in {path}, need {need}")
        if listed:
            given[name] = tuple(value)
    return Wires(**given)
