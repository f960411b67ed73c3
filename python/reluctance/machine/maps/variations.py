"""Tables with one column a current or angle, named after it, as Ansys Maxwell exports a sweep:

"theta [deg]", "FluxLinkage(A) [Wb] - I='0A'", "FluxLinkage(A) [Wb] - I='5A'", ...
"""

import re

import numpy as np

from reluctance.base.errors import ParameterError
from reluctance.base.reading import is_number, numbers
from reluctance.machine.maps.raw import SPELLED, UNITS, RawMap, column, leading
from reluctance.machine.maps.table import Array

VARIATION = re.compile(r"^(?P<what>.+?)\s+-\s+.*?(?P<name>[\w.$]+)\s*=\s*'?(?P<value>[^']+?)'?\s*$")
VALUE = re.compile(r"^([-+.\deE]+?)\s*([A-Za-z]*)$")


def is_swept(head: list[str]) -> bool:
    """Whether all columns but the first are named after the value of a sweep."""
    return len(head) > 3 and all(VARIATION.match(cell) for cell in head[1:])


def swept(rows: list[list[str]]) -> RawMap:
    """The map of such a table; flux linkage and torque may stand side by side.

    Raises
    ------
    ParameterError
        If a name, a unit or a cell cannot be read.
    """
    head = rows[0]
    first = column(leading(head[0]))
    if first is None or first.quantity not in ("i", "theta"):
        raise ParameterError(f"the first column is `{head[0]}`, need a current or an angle")
    across = "theta" if first.quantity == "i" else "i"
    down = first.factor * numbers(rows[1:], 0, f"`{head[0]}`")
    tables: dict[str, dict[float, Array]] = {"psi": {}, "tau": {}}
    unit = None
    for place, cell in enumerate(head[1:], 1):
        match = VARIATION.match(cell)
        assert match is not None  # is_swept
        known = column(leading(match["what"]))
        if known is None or known.quantity not in tables:
            raise ParameterError(f"column `{cell}`: need a flux linkage or a torque")
        value, unit = _value(match["value"], across)
        tables[known.quantity][value] = known.factor * numbers(rows[1:], place, f"`{cell}`")
    psi, tau = tables["psi"], tables["tau"]
    if not psi or (tau and psi.keys() != tau.keys()):
        raise ParameterError("need flux linkage for every value of the sweep, and torque for all")
    axis = np.array(sorted(psi))
    grids = [np.array([table[v] for v in axis]).T for table in (psi, tau) if table]
    layout = "currents_down" if first.quantity == "i" else "angles_down"
    angle_unit = first.unit if first.quantity == "theta" else unit
    torque = grids[1] if tau else None
    return RawMap(down, axis, grids[0], torque, layout, None, angle_unit, first.kind)


def _value(text: str, quantity: str) -> tuple[float, str | None]:
    """A value of the sweep and, for angles, its unit."""
    match = VALUE.match(text.strip())
    unit = match[2].lower() if match else ""
    if match is None or not is_number(match[1]) or (unit and unit not in UNITS[quantity]):
        raise ParameterError(f"value `{text}` of the sweep, need a number with a unit")
    factor = UNITS[quantity][unit] if unit else 1.0
    return factor * float(match[1]), SPELLED.get(unit, unit) or None
