"""What a map file says before conventions are settled, and how its quantities are named."""

import re
import shlex
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

from reluctance.base.errors import ParameterError
from reluctance.machine.maps.table import Array

# Name stems, lower case, with the names of the Simulink example maps first.
STEMS = {
    "psi": ("ftbl", "psi", "flux", "fluxlinkage", "flux_linkage", "lambda", "linkage"),
    "i": ("statorcurrent", "i", "current", "curr", "i_ph", "i_phase", "phase_current"),
    "theta": ("rotorangle", "theta", "angle", "position", "pos", "rotor_angle", "theta_r"),
    "tau": ("ttbl", "tau", "torque", "t", "tau_ph", "phase_torque"),
}
UNITS = {
    "psi": {"wb": 1.0, "mwb": 1e-3, "uwb": 1e-6, "vs": 1.0, "mvs": 1e-3, "weber": 1.0},
    "i": {"a": 1.0, "ma": 1e-3, "ka": 1e3, "amp": 1.0, "ampere": 1.0},
    "tau": {"nm": 1.0, "mnm": 1e-3, "knm": 1e3, "newtonmeter": 1.0, "mnewtonmeter": 1e-3},
    "theta": {"deg": 1.0, "rad": 1.0, "degree": 1.0, "degrees": 1.0, "radian": 1.0},
}
SPELLED = {"degree": "deg", "degrees": "deg", "radian": "rad"}
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
BRACKETED = re.compile(r"^.*[\[(](?P<unit>[^\[\]()]+)[\])]\s*$")


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
    inverse : bool
        It is current over flux linkage and angle: `psi` has the currents, an axis the flux linkage.
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
    inverse: bool = False


@dataclass(frozen=True)
class Column:
    """A named quantity: what it is, the factor to SI, and for angles the unit and kind."""

    quantity: str
    factor: float = 1.0
    unit: str | None = None
    kind: str | None = None


def column(name: str) -> Column | None:
    """The quantity that a name like `i_A`, `theta_m_deg`, `psi [mWb]` or `FTBL` stands for. A unit
    in brackets at the end decides, whatever stands before it."""
    if (bracketed := _by_unit(name)) is not None:
        return bracketed
    words = _words(name)
    for quantity, stems in STEMS.items():
        for n in range(len(words), 0, -1):
            stem = "_".join(words[:n])
            if {stem, stem.removesuffix("s"), stem.removesuffix("es")} & {*stems}:
                return _with_unit(quantity, words[n:], name)
    return None


def _by_unit(name: str) -> Column | None:
    """By the unit in brackets at the end of a name; no two quantities share a unit."""
    match = BRACKETED.match(name)
    words = _words(match["unit"]) if match else []
    for quantity, units in UNITS.items():
        if any(word in units for word in words):
            if all(word in units or (quantity == "theta" and word in KINDS) for word in words):
                return stated_column(quantity, name)
    return None


def stated_unit(cell: str) -> bool:
    """Whether a text is a unit, and the kind of an angle, and no more: `mWb`, `el. deg`."""
    words = _words(cell)
    units = [word for word in words if any(word in known for known in UNITS.values())]
    return len(units) == 1 and all(word in units or word in KINDS for word in words)


def leading(name: str) -> str:
    """A name without what a program adds in front or in parentheses: `Moving1.Torque`,
    `FluxLinkage(PhaseA) [Wb]`."""
    return re.sub(r"\([^)]*\)", " ", name).rpartition(".")[2] if "[" in name else name


def stated_column(quantity: str, name: str) -> Column:
    """A name that is this quantity: its unit, and kind for angles, where it ends in one: `I_aa[A]`,
    `rotor (el. deg)`, `Pos_mech [deg]`."""
    unit = kind = None
    for word in reversed(_words(name)):
        if unit is None and word in UNITS[quantity]:
            unit = word
        elif kind is None and quantity == "theta" and word in KINDS:
            kind = KINDS[word]
        else:
            break
    return _column(quantity, unit, kind)


def _words(name: str) -> list[str]:
    """The parts of a name in lower case. A dot or a product sign within a unit joins: N.m, V s."""
    joined = re.sub(
        r"\b([mk]?N|m?V)\s*[.*·]\s*(m|s)\b", r"\1\2", name.strip().replace("°", " deg ")
    )
    return [w for w in re.split(r"[\s_\[\]()./,:]+", joined.lower()) if w]


def _column(quantity: str, unit: str | None, kind: str | None) -> Column:
    factor = UNITS[quantity][unit] if unit else 1.0
    return Column(quantity, factor, SPELLED.get(unit, unit) if unit else None, kind)


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
                "(any case)"
            )
    return _column(quantity, unit, kind)


def chosen(
    names: Iterable[str],
    selected: Mapping[str, str],
    what: str,
    required: Collection[str] = REQUIRED,
) -> dict[str, tuple[str, Column]]:
    """Quantity -> (name, column) for the names of a file; `selected` maps quantity to name.

    Raises
    ------
    ParameterError
        Where flux, current or angle is missing, or a selected name does not exist.
    """
    names = list(names)
    found: dict[str, tuple[str, Column]] = {}
    for quantity, name in selected.items():
        if quantity not in STEMS or name not in names:
            raise ParameterError(f"{what} has no `{name}` for {quantity}; {_listed(names)}")
        found[quantity] = (name, stated_column(quantity, name))
    faults: list[str] = []
    for name in names:
        try:
            known = column(name) if name not in selected.values() else None
        except ParameterError as fault:  # a unit that is unknown: told where a quantity is missing
            faults.append(str(fault))
            continue
        if known is None or known.quantity in selected:
            continue
        if known.quantity in found:
            raise ParameterError(
                f"{what} has `{found[known.quantity][0]}` and `{name}` for {known.quantity}; "
                f"{_listed(names)}; select one: {_ready(found, required)}"
            )
        found[known.quantity] = (name, known)
    if missing := [q for q in required if q not in found]:
        said = "".join(f"; {fault}" for fault in faults)
        raise ParameterError(
            f"{what} has no {' and no '.join(missing)}{said}; {_listed(names)}; name the columns: "
            f"{_ready(found, required)} (a unit in brackets is read, SI without one)"
        )
    return found


def _listed(names: list[str]) -> str:
    """All names of a file; of a long list, its first dozen."""
    more = f" and {len(names) - 12} more" if len(names) > 12 else ""
    return f"it has {', '.join(f'`{n}`' for n in names[:12]) or 'nothing'}{more}"


def _ready(found: Mapping[str, tuple[str, Column]], required: Collection[str]) -> str:
    """The options that name each required column, with NAME where none was recognised."""
    names = {q: found[q][0] if q in found else "NAME" for q in required}
    return " ".join(f"--name {shlex.quote(f'{q}={name}')}" for q, name in names.items())
