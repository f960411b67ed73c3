"""The numbers of a drive under the names that the C interface has for them."""

from __future__ import annotations

from reluctance import _core
from reluctance.drive.drive import Drive
from reluctance.drive.run.plant import loop_parts
from reluctance.targets.export.blob import control_tree, described_controller
from reluctance.targets.export.tree import Node, walk

Numbers = dict[str, float | tuple[float, ...]]
LONG = 16  # values of a table from here on have no names of their own here
SHORT = 8  # up to here those of a table that a controller views have (c_api/named.hpp)


def plant_parameters(drive: Drive) -> Numbers:
    """Every number of plant, sensors and reference by its name; a long table as a whole."""
    return _named(_core.described_plant(**loop_parts(drive, 0.0)), "")


def control_parameters(drive: Drive) -> Numbers:
    """The same of the controller: `control.law.i_band`, ... in SI units."""
    return _named(control_tree(described_controller(drive)), "control")


def _named(tree: Node, root: str) -> Numbers:
    """The numbers of a tree. A long table is one entry: its values cannot be set by name."""
    found: Numbers = {}
    for path, mark, numbers in walk(tree, root):
        if mark == "":
            found[path] = float(numbers[0])
        elif mark == "<":
            found[f"{path}|kind"] = float(numbers[0])
        elif mark in ("{}", "[]"):
            values = tuple(map(float, numbers[1:] if mark == "[]" else numbers))
            longest = SHORT if root else LONG - 1
            if mark == "[]" and len(values) > longest:
                found[path] = values
            else:
                found |= {f"{path}_{j}": v for j, v in enumerate(values)}
    return found
