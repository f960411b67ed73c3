"""Values put into the tables of a drive file: `section.key=value`, by `--set` and `with_values`."""

import re
from pathlib import Path
from typing import Any

import numpy as np

from reluctance.base.errors import ParameterError
from reluctance.base.schema import did_you_mean
from reluctance.base.toml_file import toml_value
from reluctance.drive.all_tables import TABLES
from reluctance.drive.laws import LAWS, table_of
from reluctance.drive.laws.own_code import names_code
from reluctance.machine.library import machine_table


def law_of(data: dict[str, Any]) -> object:
    control = data.get("control")
    return control.get("law") if isinstance(control, dict) else None


def _keep_keys_of_the_law(control: dict[str, Any], before: object) -> None:
    """Drops the keys of [control] that its law does not have; those of a law of one's own are
    given after it, and stay from one such law to another. Angles stay among laws of one kind only:
    elsewhere they mean something else."""
    law = control.get("law")
    if names_code(law) and names_code(before):
        return
    if isinstance(law, str) and (law in LAWS or names_code(law)):
        table = table_of(law)
        kept = set(table.model_fields)
        known = isinstance(before, str) and before in LAWS
        kind = table_of(str(before)).__bases__[0] if known else None
        if kind is not table.__bases__[0] and (known or names_code(before)):
            kept -= {key for key in kept if key.endswith("_deg")}
        for key in set(control) - kept:
            del control[key]


def _fields(data: dict[str, Any], path: list[str]) -> set[str]:
    """The keys that a table of a drive file may have; of an inner one none is known here."""
    name, *below = path
    if below:
        return set()
    if name == "control":  # of any law: a key may have gone with the law before
        return {key for law in LAWS for key in table_of(law).model_fields}
    return set(TABLES[name].model_fields) if name in TABLES else set()


def parsed(text: str) -> tuple[str, Any]:
    """Name and value of `section.key=value`; None where no value is given."""
    if not isinstance(text, str):
        raise ParameterError(f"override {text!r}, need a text as in 'section.key=value'")
    name, equals, value = (part.strip() for part in text.partition("="))
    if not equals and (other := re.fullmatch(r"([\w.]+)\s*[: ]\s*(.+)", name)):
        raise ParameterError(f"--set {text}: need section.key=value, as in {other[1]}={other[2]}")
    if not equals:
        raise ParameterError(f"--set {text}: need section.key=value; `{name}=` removes the key")
    if not value:
        return name, None
    if name == "machine":
        return name, value.strip("\"'")
    return name, toml_value(value)


def put(data: dict[str, Any], name: str, value: Any, where: str) -> None:
    """Puts a value into the tables, or takes the key out where it is None. A new law takes the keys
    with it that it does not have."""
    if name == "machine" and value is not None:
        data["machine"] = machine_table(value, Path()) if isinstance(value, str) else value
        return
    if name == "faults":
        data["faults"] = value or []
        return
    *path, key = name.split(".")
    if not path or not key:
        raise ParameterError(f"{where}: need section.key=value")
    table, before = data, law_of(data)
    for part, below in zip(path, (*path[1:], key), strict=True):
        table = _within(table, part, below, where)
    if isinstance(table, list):
        _put_in_list(table, path[-1], key, value, where)
        return
    if value is not None:
        table[key] = value
    elif key in table:
        del table[key]
    elif key not in _fields(data, path):
        raise ParameterError(
            f"{where}: no such key to remove{did_you_mean(key, table) if table else ''}"
        )
    if law_of(data) != before:
        _keep_keys_of_the_law(data["control"], before)


def _within(table: Any, part: str, below: str, where: str) -> Any:
    """The table or list of this name within a table, for the key `below`; in an array of tables a
    number, from 0 on."""
    if isinstance(table, dict):
        inner = table.setdefault(part, [] if part == "faults" or below.isdecimal() else {})
    else:
        number = _number(table, part, where)
        if number == len(table):
            table.append({})
        inner = table[number]
    if not isinstance(inner, dict | list):
        raise ParameterError(f"{where}: `{part}` is not a table")
    return inner


def _put_in_list(numbers: list[Any], name: str, key: str, value: Any, where: str) -> None:
    """One more number of a list, or another one in its place, as `sensing.i_offset_A.0=2`."""
    if name == "faults":
        raise ParameterError(f"{where}: need faults.NUMBER.key=value, as faults.0.kind=open_wire")
    if value is None:
        raise ParameterError(f"{where}: no number of a list is removed; give all of `{name}`")
    number = _number(numbers, key, where)
    numbers[number : number + 1] = [value]


def _number(those: list[Any], text: str, where: str) -> int:
    """Which of a list, or the next one."""
    number = int(text) if text.isdecimal() else -1
    if not 0 <= number <= len(those):
        need = f"a number from 0 to {len(those)}" if those else "0, the first"
        raise ParameterError(f"{where}: `{text}`, need {need}")
    return number


def plain(value: Any) -> Any:
    """Numbers and lists as TOML has them, of NumPy's and of other sequences."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return list(value) if isinstance(value, tuple | range) else value
