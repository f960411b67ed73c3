"""What a map file says before conventions are settled, and how its quantities are named."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from reluctance.errors import ParameterError
from reluctance.maps.table import Array

# Name stems, lower case, with the names of the Simulink example maps first.
STEMS = {
    "psi": ("ftbl", "psi", "flux", "fluxlinkage", "flux_linkage", "lambda", "linkage"),
    "i": ("statorcurrent", "i", "current", "i_ph", "i_phase", "phase_current"),
    "theta": ("rotorangle", "theta", "angle", "position", "rotor_angle", "theta_r"),
    "tau": ("ttbl", "tau", "torque", "t", "tau_ph", "phase_torque"),
}
UNITS = {
    "psi": {"wb": 1.0, "mwb": 1e-3, "vs": 1.0, "mvs": 1e-3},
    "i": {"a": 1.0, "ma": 1e-3, "ka": 1e3},
    "tau": {"nm": 1.0, "mnm": 1e-3},
    "theta": {"deg": 1.0, "rad": 1.0},
}
KINDS = {
    "e": "electrical",
    "el": "electrical",
    "elec": "electrical",
    "electrical": "electrical",
    "m": "mechanical",
    "mech": "mechanical",
    "mechanical": "mechanical",
}
REQUIRED = ("psi", "i", "theta")


@dataclass(frozen=True)
class RawMap:
    """A table as the file has it: SI, but the angles as written.

    Attributes
    ----------
    rows, columns : ndarray
        The two axes. Which is which is settled by `conventions.settled`.
    psi, tau : ndarray, shape (n_rows, n_columns)
        Flux linkage [Wb] and torque [N m]; tau may be None.
    layout : str or None
        "currents_down", "angles_down", or None where the file does not say.
    angle_unit, angle_kind, zero : str or None
        What the file says about its angles.
    """

    rows: Array
    columns: Array
    psi: Array
    tau: Array | None = None
    layout: str | None = None
    N_r: int | None = None
    angle_unit: str | None = None
    angle_kind: str | None = None
    zero: str | None = None


@dataclass(frozen=True)
class Column:
    """A named quantity: what it is, the factor to SI, and for angles the unit and kind."""

    quantity: str
    factor: float = 1.0
    unit: str | None = None
    kind: str | None = None


def column(name: str) -> Column | None:
    """The quantity that a name like `i_A`, `theta_m_deg`, `psi [mWb]` or `FTBL` stands for."""
    words = [w for w in re.split(r"[\s_\[\]()./]+", name.strip().lower()) if w]
    for quantity, stems in STEMS.items():
        for n in range(len(words), 0, -1):
            if "_".join(words[:n]) in stems:
                return _with_unit(quantity, words[n:], name)
    return None


def _with_unit(quantity: str, words: list[str], name: str) -> Column:
    kind = unit = None
    for word in words:
        if quantity == "theta" and word in KINDS:
            kind = KINDS[word]
        elif word in UNITS[quantity]:
            unit = word
        else:
            units = ", ".join(UNITS[quantity])
            raise ParameterError(
                f"column `{name}` has the unknown part `{word}`, need a unit out of {units} "
                "(any case); rename the column"
            )
    return Column(quantity, UNITS[quantity][unit] if unit else 1.0, unit, kind)


def chosen(
    names: Iterable[str], selected: Mapping[str, str], what: str
) -> dict[str, tuple[str, Column]]:
    """Quantity -> (name, column) for the names of a file; `selected` maps quantity to name.

    Raises
    ------
    ParameterError
        Where flux, current or angle is missing, or a selected name does not exist.
    """
    names = list(names)
    listed = ", ".join(f"`{n}`" for n in names[:12]) or "nothing"
    for quantity, name in selected.items():
        if quantity not in STEMS or name not in names:
            raise ParameterError(
                f"{what} has no `{name}` for {quantity}, it has {listed}; select names as "
                "psi=NAME, i=NAME, theta=NAME, tau=NAME"
            )
    found: dict[str, tuple[str, Column]] = {}
    for quantity, name in selected.items():
        known = column(name)
        ours = known is not None and known.quantity == quantity
        found[quantity] = (name, known if known is not None and ours else Column(quantity))
    for name in names:
        known = column(name) if name not in selected.values() else None
        if known is None or known.quantity in selected:
            continue
        if known.quantity in found:
            raise ParameterError(
                f"{what} has `{found[known.quantity][0]}` and `{name}` for {known.quantity}; "
                f"select one with {known.quantity}=NAME"
            )
        found[known.quantity] = (name, known)
    missing = [q for q in REQUIRED if q not in found]
    if missing:
        raise ParameterError(
            f"{what} has no {' and no '.join(missing)}, it has {listed}; select names as "
            f"{missing[0]}=NAME, or name them like i_A, theta_deg, psi_Wb"
        )
    return found
