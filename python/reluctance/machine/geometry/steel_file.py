"""B-H curves: a small library of standard grades, and files of measured points.

A grade of the library is the curve

    J(H) = J_1 (H/H_1)/sqrt(1 + (H/H_1)^2) + J_2 H/(H + H_2),    B = J + mu_0 H

which is our own; no curve of the library is measured. J_1, J_2 and H_2 follow from three numbers a
grade: the least polarisation at 2.5, 5 and 10 kA/m that a sheet of that name must have by EN 10106.
They were written down from knowledge of the standard and not compared with a copy of it. H_1 sets
the steepness below the knee and is our choice (relative permeability of about 9000). A delivered
sheet is usually better by 0.02 to 0.06 T: use its own curve where you have it.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import numpy as np
from scipy.constants import mu_0

from reluctance.base.columns import Quantity, recognised
from reluctance.base.errors import ParameterError
from reluctance.base.files import is_file
from reluctance.base.reading import is_number, numbers, read_rows, reading
from reluctance.base.schema import NamesFile, did_you_mean
from reluctance.machine.geometry.steel import Array, Steel

# Least polarisation at 2500, 5000 and 10 000 A/m [T]: fully processed, non-oriented, EN 10106; see
# above for how far that was checked.
GRADES = {
    "M270-35A": (1.49, 1.60, 1.70),
    "M400-50A": (1.53, 1.63, 1.73),
    "M530-50A": (1.56, 1.65, 1.75),
    "M800-50A": (1.60, 1.70, 1.78),
}
H_GUARANTEED = (2500.0, 5000.0, 10_000.0)  # [A/m]
H_KNEE = 120.0  # H_1 of all grades [A/m]
H_LAST = 200_000.0  # where the curve of a grade ends [A/m]
B_ENOUGH = 1.8  # a curve that reaches it shows its own saturation [T]
MOST_B, MOST_J = 3.5, 2.45  # beyond every soft magnetic steel; iron with cobalt has J of 2.4 T [T]
LEAST_POINTS = 6
TESLA = {"t": 1.0, "mt": 1e-3, "kg": 0.1, "g": 1e-4, "gauss": 1e-4}
OERSTED = 1000 / (4 * np.pi)  # [A/m]
COLUMNS = {
    "H": Quantity(
        ("h", "h_a_per_m", "field", "field_strength"),
        {"a/m": 1.0, "ka/m": 1e3, "a/cm": 100.0, "oe": OERSTED, "koe": 1e3 * OERSTED},
    ),
    "B": Quantity(("b", "induction", "flux_density"), TESLA),
    "J": Quantity(("j", "polarisation", "polarization"), TESLA),
}


class NamesSteel(NamesFile):
    """Marks a key that names a B-H file, or a grade of the library, which has no ending."""

    def renamed(self, text: str, rename: Callable[[Path], Path]) -> str:
        return super().renamed(text, rename) if Path(text).suffix else text


SteelName = Annotated[str, NamesSteel()]


def steel(name: str, *, J_sat: float | None, stacking_factor: float) -> Steel:
    """The steel of a library name or of a file.

    Raises
    ------
    ParameterError
        For an unknown name, or a file that is no B-H curve; with the remedy.
    """
    if name in GRADES:
        if J_sat is not None:
            raise ParameterError(
                f"[lamination] saturation_polarisation_T has no effect with the grade {name} of "
                "the library; remove it, or give a B-H file"
            )
        return Steel(*grade(name), J_sat=None, stacking_factor=stacking_factor)
    path = Path(name)
    if not is_file(path):
        hint = "no such file" if path.suffix else f"no such grade{did_you_mean(name, GRADES)}"
        raise ParameterError(f"[lamination] steel = {name!r}: {hint} (or give a B-H file)")
    H, B = read_curve(path)
    J_last = B[-1] - mu_0 * H[-1]
    if J_sat is None and B[-1] < B_ENOUGH:
        raise ParameterError(
            f"{path}: the curve ends at {B[-1]:.3g} T, below {B_ENOUGH} T, before saturation; set "
            "[lamination] saturation_polarisation_T, about 2.0 for silicon steel"
        )
    if J_sat is not None and not J_last < J_sat <= MOST_J:
        raise ParameterError(
            f"[lamination] saturation_polarisation_T = {J_sat:g}, need more than the "
            f"{J_last:.4g} T at the end of the curve and at most {MOST_J} T"
        )
    return Steel(H, B, J_sat=J_sat, stacking_factor=stacking_factor)


def grade(name: str) -> tuple[Array, Array]:
    """H [A/m] and B [T] of a grade of the library."""
    J_a, J_b, J_c = GRADES[name]
    h_a, h_b, h_c = H_GUARANTEED
    # With every field twice the one before, (J_c - J_b)/(J_b - J_a) = 2 (h_a + H_2)/(h_c + H_2).
    ratio = (J_c - J_b) / (J_b - J_a)
    H_2 = (ratio * h_c - 2 * h_a) / (2 - ratio)
    J_2 = (J_c - J_b) / (h_c / (h_c + H_2) - h_b / (h_b + H_2))
    J_1 = J_a - J_2 * h_a / (h_a + H_2)
    H = np.append(0.0, np.geomspace(H_KNEE / 20, H_LAST, 120))
    x = H / H_KNEE
    return H, J_1 * x / np.hypot(1, x) + J_2 * H / (H + H_2) + mu_0 * H


def read_curve(path: Path) -> tuple[Array, Array]:
    """H [A/m] and B [T], each (n,) rising from 0, of a file with two columns in these units. Names
    in a first row, as `H [kA/m]` and `J [T]`, may change order, unit and quantity: B = J + mu_0 H.

    Raises
    ------
    ParameterError
        If it is no curve that rises, or has other units.
    """
    with reading(path, "a B-H curve", "need two columns of text, H in A/m and B in T"):
        rows = read_rows(path)
        heads = rows[0]
        named = not all(is_number(cell) for cell in heads)
        known = recognised(heads, COLUMNS) if named else {}
        rows = rows[named:]
        if len(rows) < LEAST_POINTS:
            raise ParameterError(
                f"need two columns of at least {LEAST_POINTS} numbers, H in A/m and B in T"
            )
        if "H" in known and len(known) > 1:
            columns = {
                quantity: factor * numbers(rows, heads.index(name), name)
                for quantity, (name, factor) in known.items()
            }
            H = columns["H"]
            B = columns["B"] if "B" in known else columns["J"] + mu_0 * H
        else:
            H, B = (numbers(rows, k, f"column {k + 1}") for k in (0, 1))
            if named and heads[0].lower().startswith("b"):
                H, B = B, H
    if B.max() > MOST_B and H.max() <= MOST_B:
        raise ParameterError(
            f"{path}: H ends at {H.max():g} and B at {B.max():g}: the columns are swapped; put H "
            "in A/m first, or name them H_A_per_m and B_T"
        )
    if B.max() > MOST_B:
        units = (("kilogauss by 10", 10), ("millitesla by 1000", 1000), ("gauss by 10 000", 1e4))
        todo = next((unit for unit, parts in units if B.max() <= parts * MOST_B), units[-1][0])
        raise ParameterError(
            f"{path}: B ends at {B.max():g}, need tesla, below {MOST_B}; divide {todo}"
        )
    if H.max() < 1000:
        raise ParameterError(
            f"{path}: H ends at {H.max():g} A/m, need at least 1000; multiply kA/m by 1000, or "
            "oersted by 79.6"
        )
    if H[0] > 0 and B[0] > 0:
        H, B = np.append(0.0, H), np.append(0.0, B)
    falls = np.flatnonzero(~((np.diff(H) > 0) & (np.diff(B) > 0)))
    if falls.size or H[0] != 0 or B[0] != 0:
        k = int(falls[0]) + 1 if falls.size else 0
        raise ParameterError(
            f"{path}: H and B need to rise from 0, point {k + 1} is {H[k]:g} A/m, {B[k]:g} T; "
            "remove or mend it"
        )
    return H, B
