"""C++ constants from a controller's tree of names and numbers (bindings/trees.hpp).

Floats are printed with the fewest digits that read back as the same float.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from reluctance.base.errors import ParameterError

Node = Any  # number, list, or one of the dicts of bindings/trees.hpp
BYTES = {"float": 4, "std::uint8_t": 1}  # of a table's element
DTYPES = {"float": "<f4", "std::uint8_t": "u1"}


@dataclass
class Tables:
    """Tables of constants, each printed once; they lie in flash."""

    text: list[str] = field(default_factory=list)
    size: int = 0  # [B]
    names: dict[str, str] = field(default_factory=dict)  # content to name
    data: dict[str, bytes] = field(default_factory=dict)  # of each name, as it lies in flash

    def name(self, element: str, values: list[float], where: str) -> str:
        """The name of the table with these values, printed if it is new."""
        content = _wrapped([literal(v, where) for v in values])
        if content not in self.names:
            name = f"table_{len(self.names)}"
            self.names[content] = name
            self.data[name] = np.array(values, DTYPES[element]).tobytes()
            self.size += BYTES[element] * len(values)
            self.text.append(
                f"// {where}: {len(values)} values.\n"
                f"RELUCTANCE_TABLE constexpr {element} {name}[] = {{\n{content}}};\n"
            )
        return self.names[content]


def literal(value: float | int | bool, where: str) -> str:
    """A C++ literal that reads back as the same bool, int or float.

    Raises
    ------
    ParameterError
        If it is NaN, infinite or beyond a float.
    """
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    with np.errstate(over="ignore"):
        single = np.float32(value)
    if not np.isfinite(single):
        raise ParameterError(f"{where} = {value:g} cannot be exported, need a finite float")
    return f"{single!s}F"


def constant(node: Node, tables: Tables, where: str, indent: int = 0) -> str:
    """The C++ initialiser of a tree, a field a line; its tables go to `tables`."""
    if isinstance(node, list):
        words = [literal(v, where) for v in node]
        return "{{" + _wrapped(words, indent).strip().rstrip(",") + "}}"
    if not isinstance(node, dict):
        return literal(node, where)
    if "table" in node:
        if not node["values"]:
            return "{nullptr, 0}"
        return f"{{{tables.name(node['table'], node['values'], where)}, {len(node['values'])}}}"
    if "value" in node:
        return f"static_cast<{node['type']}>({node['value']})"
    inner = " " * (indent + 4)
    parts = [
        f"{inner}.{name} = {constant(value, tables, f'{where}.{name}', indent + 4)},\n"
        for name, value in node["fields"].items()
    ]
    return "{\n" + "".join(parts) + " " * indent + "}"


def _wrapped(words: list[str], indent: int = 0) -> str:
    """The words with commas, in lines of up to 100 columns."""
    lines, line = [], " " * (indent + 3)
    for word in words:
        if len(line) + len(word) + 2 > 100:
            lines.append(line)
            line = " " * (indent + 3)
        line += f" {word},"
    return "\n".join([*lines, line]) + "\n"
