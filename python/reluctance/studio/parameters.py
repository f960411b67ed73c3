"""The numbers of a drive under the names that the C interface has for them."""

from __future__ import annotations

from reluctance import _core
from reluctance.drive import Drive
from reluctance.export.constants import Node
from reluctance.run.plant import loop_parts

Numbers = dict[str, float | tuple[float, ...]]
LONG = 16  # values of a table from here on have no names of their own here
SHORT = 8  # up to here those of a table that a controller views have (c_api/named.hpp)


def plant_parameters(drive: Drive) -> Numbers:
    """Every number of plant, sensors and reference by its name; a long table as a whole."""
    found: Numbers = {}
    _collect(_core.described_plant(**loop_parts(drive, 0.0)), "", found)
    return found


def control_parameters(drive: Drive) -> Numbers:
    """The same of the controller: `control.law.i_band`, ... in SI units."""
    found: Numbers = {}
    described = _core.described(drive.controller())
    assert described is not None  # of a law in Python; the studio has none
    _collect(described["control"], "control", found)
    return found


def _collect(node: Node, name: str, found: Numbers) -> None:
    if node is None:
        return
    if isinstance(node, dict) and "fields" in node:
        for key, value in node["fields"].items():
            _collect(value, f"{name}.{key}" if name else key, found)
    elif isinstance(node, dict) and "variant" in node:
        found[f"{name}|kind"] = float(node["variant"])
        _collect(node["value"], name, found)
    elif isinstance(node, list) or (isinstance(node, dict) and "table" in node):
        values = tuple(float(v) for v in (node if isinstance(node, list) else node["values"]))
        # Long tables cannot be set by name.
        viewed = len(values) > SHORT if name.startswith("control.") else len(values) >= LONG
        if isinstance(node, dict) and viewed:
            found[name] = values
        else:
            found.update({f"{name}_{j}": v for j, v in enumerate(values)})
    else:
        found[name] = float(node["value"] if isinstance(node, dict) else node)
