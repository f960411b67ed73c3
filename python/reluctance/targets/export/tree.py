"""The parameters of a drive as a tree of names and numbers (bindings/describe.hpp).

Blob, firmware package, mock-up units and studio are made from it, by one walk."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

Node = Any  # number, list, or one of the dicts of bindings/describe.hpp


class Visit(NamedTuple):
    """A place of the tree, in the order of the field lists."""

    path: str  # control.law.machine.L_u
    mark: str  # what include/srm/c_api/unpack.hpp visits there; of a number nothing
    numbers: Sequence[float]


def walk(node: Node, path: str = "") -> Iterator[Visit]:
    """All places of a tree below a path."""
    if node is None:  # a function
        yield Visit(path, "!", ())
    elif isinstance(node, list):
        yield Visit(path, "{}", node)
    elif not isinstance(node, dict):
        yield Visit(path, "", (node,))
    elif "table" in node:
        yield Visit(path, "[]", (len(node["values"]), *node["values"]))
    elif "variant" in node:
        yield Visit(path, "<", (node["variant"],))
        yield from walk(node["value"], path)
        yield Visit(path, ">", ())
    elif "fields" in node:
        yield Visit(path, "(", ())
        for name, value in node["fields"].items():
            yield Visit(path, f"{name} ", ())
            yield from walk(value, f"{path}.{name}" if path else name)
        yield Visit(path, ")", ())
    else:
        yield Visit(path, "", (node["value"],))


def numbers_of(trees: dict[str, Node]) -> dict[str, float]:
    """Every single number of some trees by its path; lists and tables left out."""
    places = (place for name, tree in trees.items() for place in walk(tree, name))
    return {place.path: place.numbers[0] for place in places if place.mark == ""}
