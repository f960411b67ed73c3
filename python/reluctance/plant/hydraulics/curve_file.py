"""A pump curve in a file: flow, head, and efficiency or shaft power, by usual names and units."""

import re
import warnings
from pathlib import Path

import numpy as np

from reluctance.base.arrays import FloatArray
from reluctance.base.columns import Quantity, recognised, without_unit
from reluctance.base.errors import Note, ParameterError
from reluctance.base.reading import numbers, read_rows, reading
from reluctance.plant.hydraulics.curve import GRAVITY, M3PH, RHO, Curve

DROOP = 1e-3  # of the largest head, by which a flat one falls: less than a curve is read to
MOST_FLOW, GREATEST_HEAD = 1e6, 1e4  # of any pump [m^3/h], [m]
LEAST_BEST = 0.03  # efficiency: the smallest pumps reach some 10 %; less is a fraction in per cent
POOR, USUAL = 0.24, (0.4, 0.86)  # best efficiencies: of few pumps, and of most
APART = 2.0  # of two efficiencies of one curve: one more than the other is a wrong unit
DIFFERENT = 0.15  # the same: from here on it is said
BETTER = 0.02  # efficiency by which a curve may pass its points unsaid

COLUMNS = {
    "Q_m3ph": Quantity(
        ("q", "flow", "flow_rate", "discharge", "capacity"),
        {
            "m3ph": 1.0,
            "m3/h": 1.0,
            "l/s": 3.6,
            "lps": 3.6,
            "l/min": 0.06,
            "lpm": 0.06,
            "m3/s": 3600.0,
            **dict.fromkeys(("gpm", "us gpm", "usgpm", "gpm (us)"), 0.003785411784 * 60),
        },
    ),
    "H_m": Quantity(("h", "head", "tdh"), {"m": 1.0, "ft": 0.3048}),
    "eta": Quantity(("eta", "efficiency", "eff"), {"1": 1.0, "%": 0.01, "pct": 0.01}),
    "p_shaft_W": Quantity(
        ("p_shaft", "p", "p2", "power", "shaft_power"), {"w": 1.0, "kw": 1e3, "hp": 745.7}
    ),
}
PRESSURES = {"pa": 1.0, "mbar": 1e2, "kpa": 1e3, "psi": 6894.757, "bar": 1e5, "mpa": 1e6}  # [Pa]
UNITS = {"m3ph": "m3/h", "w": "W"}  # as people write them
MOST_HEAD = 20  # lines above the names of the columns, as of the pump's type


def curve_from(path: Path, omega_ref: float) -> Curve:
    """The curve of a file at its reference speed [rad/s], joined by monotone cubics.

    Raises
    ------
    ParameterError
        If the file cannot be read, or its numbers are those of no pump.
    """
    table = _columns(path)
    Q, H = table["Q_m3ph"] * M3PH, table["H_m"]
    if len(Q) < 3 or Q[0] < 0 or not np.all(np.diff(Q) > 0):
        asked = ""
        if len(Q) > 1 and np.all(np.diff(H) > 0):
            asked = (
                "; the heads rise instead: are Q_m3ph and H_m exchanged? Then exchange their two "
                "names; if they are right, turn the order of the rows round"
            )
        raise ParameterError(f"{path}: Q_m3ph needs at least 3 rising flows, none below 0{asked}")
    for name, most in (("Q_m3ph", MOST_FLOW), ("H_m", GREATEST_HEAD)):
        if not table[name].max() <= most:
            raise ParameterError(
                f"{path}: {name} reaches {table[name].max():.3g}, need at most {most:g}; correct "
                "the unit in the column's name"
            )
    if "p_shaft_W" in table:
        _check_power(Q, H, table["p_shaft_W"], path)
        if "eta" in table:
            _check_both(Q, H, table, path)
    given, (Q, H) = Q, _falling(Q, H, path)
    at_work = np.isin(given, Q) & (given > 0)
    if "p_shaft_W" in table:
        P = table["p_shaft_W"][np.isin(given, Q)]
        _ask_about_litres(float((RHO * GRAVITY * Q[1:] * H[1:] / P[-len(Q) + 1 :]).max()), path)
    else:
        eta = table["eta"][at_work]
        if not np.all((eta > 0) & (eta < 1)):
            raise ParameterError(
                f"{path}: eta needs fractions between 0 and 1 where Q > 0; a column in per cent is "
                "named `eta [%]`"
            )
        if eta.max() < LEAST_BEST:
            raise ParameterError(
                f"{path}: the best efficiency is {100 * eta.max():.3g} %, need at least "
                f"{100 * LEAST_BEST:g} %; if the column has fractions, name it `eta`"
            )
        P = RHO * GRAVITY * Q[1:] * H[1:] / eta
    if len(P) < len(Q):  # eta says nothing at Q = 0, nor does a curve that begins above it
        P = np.append(P[0] - (P[1] - P[0]) / (Q[2] - Q[1]) * Q[1], P)
    if not (np.all(P > 0) and np.all(H >= 0)):
        raise ParameterError(f"{path}: need shaft powers > 0 and heads >= 0 throughout")
    from scipy.interpolate import PchipInterpolator  # [load] knows what a pump is, without SciPy

    curve = Curve(omega_ref, float(Q[-1]), PchipInterpolator(Q, H), PchipInterpolator(Q, P))
    _tell_between(curve, (RHO * GRAVITY * Q * H / P).max(), path)
    return curve


def _tell_between(curve: Curve, best: float, path: Path) -> None:
    """A Note where the curve between its points is better than the best of them."""
    Q = np.linspace(0.0, curve.Q_end, 401)
    eta = RHO * GRAVITY * Q * curve.head_1(Q) / curve.power_1(Q)
    k = int(np.argmax(eta))
    if eta[k] > best + BETTER:
        warnings.warn(
            f"{path}: between its points the curve reaches an efficiency of {100 * eta[k]:.3g} % "
            f"(at Q_m3ph = {Q[k] / M3PH:.3g}), the best point has {100 * best:.3g} %; add points "
            "there if the maker has them",
            Note,
            stacklevel=2,
        )


def _check_power(Q: FloatArray, H: FloatArray, P: FloatArray, path: Path) -> None:
    """Raises ParameterError where the water takes as much power as the shaft, or more."""
    water = RHO * GRAVITY * Q * H
    over = np.flatnonzero(~(water < P) & (Q > 0))
    if len(over):
        k = int(over[0])
        raise ParameterError(
            f"{path}: at Q_m3ph = {Q[k] / M3PH:g} the water takes {water[k]:.3g} W and the shaft "
            f"has {P[k]:.3g} W; correct the unit in the name of a column: flow, head or power"
        )


def _ask_about_litres(best: float, path: Path) -> None:
    """A Note where flows in litres per second would make a usual pump of a poor one."""
    in_litres = 3.6 * best  # of m3/h in l/s
    if best < POOR and USUAL[0] < in_litres < USUAL[1]:
        warnings.warn(
            f"{path}: the best efficiency is {100 * best:.3g} %; if the flows are in l/s, name "
            f"their column `Q [l/s]`: then it is {100 * in_litres:.3g} %",
            Note,
            stacklevel=2,
        )


def _check_both(Q: FloatArray, H: FloatArray, table: dict[str, FloatArray], path: Path) -> None:
    """Raises ParameterError where power and efficiency cannot be of one pump.

    A Note tells a smaller difference: the efficiency may be that of pump and motor.
    """
    flows = (Q > 0) & (table["eta"] > 0)
    by_power = RHO * GRAVITY * Q[flows] * H[flows] / table["p_shaft_W"][flows]
    ratio = by_power / table["eta"][flows]
    if not len(ratio):
        return
    k = int(np.argmax(np.abs(np.log(ratio))))
    told = (
        f"{path}: at Q_m3ph = {Q[flows][k] / M3PH:g} the shaft power means an efficiency of "
        f"{100 * by_power[k]:.3g} %, the column of the efficiency has "
        f"{100 * table['eta'][flows][k]:.3g} %"
    )
    if abs(np.log(ratio[k])) > np.log(APART):
        raise ParameterError(f"{told}; correct the unit of the wrong one, or remove its column")
    if abs(ratio[k] - 1) > DIFFERENT:
        warnings.warn(f"{told}; the power counts", Note, stacklevel=2)


def _falling(Q: FloatArray, H: FloatArray, path: Path) -> tuple[FloatArray, FloatArray]:
    """The curve from shut-off on, its head falling throughout. Where it is flat or rises at low
    flow, a pump has two flows at one head and works at the larger one: from shut-off to its
    largest head it falls by DROOP here. A first point above zero flow is continued to shut-off."""
    top = len(H) - 1 - int(np.argmax(H[::-1]))  # the last of equal ones
    uneven = np.flatnonzero(~(np.diff(H[top:]) < 0))
    if len(uneven):
        k = top + int(uneven[0])
        raise ParameterError(
            f"{path}: H_m does not fall from {H[k]:g} to {H[k + 1]:g} m at Q_m3ph = "
            f"{Q[k + 1] / M3PH:g}, past its largest head; mend one of the two"
        )
    if len(H) - top < 3:
        raise ParameterError(
            f"{path}: H_m is largest at Q_m3ph = {Q[top] / M3PH:g}; need at least two points "
            "behind it, where the head falls"
        )
    Q, H = Q[top:], H[top:]
    if Q[0] == 0:
        return Q, H
    if top > 0:
        H_0, what = (1 + DROOP) * H[0], "is flat or rises at low flow: falls here"
    else:  # the slope flattens to nothing at shut-off, as in a parabola
        H_0 = H[0] + (H[0] - H[1]) / (Q[1] - Q[0]) * Q[0] / 2
        what = "begins above zero flow: continued here"
    warnings.warn(
        f"{path}: H_m {what} from {H_0:.4g} m at shut-off to {H[0]:g} m at Q_m3ph = "
        f"{Q[0] / M3PH:g}",
        Note,
        stacklevel=2,
    )
    return np.append(0.0, Q), np.append(H_0, H)


def _from_names(rows: list[list[str]]) -> list[list[str]]:
    """The rows from the one on that names flow and head, or a unit of one of them wrongly."""
    for k, row in enumerate(rows[:MOST_HEAD]):
        try:
            named = {"Q_m3ph", "H_m"} <= set(recognised(row, COLUMNS))
        except ParameterError:
            named = True
        if named:
            return rows[k:]
    return rows


def _recognised(names: list[str]) -> dict[str, tuple[str, float]]:
    """`recognised`, with what makes a head of a pressure."""
    try:
        return recognised(names, COLUMNS)
    except ParameterError as fault:
        unit = re.search(r"has the unit `(.*?)`", str(fault))
        if unit is None or unit[1] not in PRESSURES:
            raise
        metres = PRESSURES[unit[1]] / (RHO * GRAVITY)
        raise ParameterError(
            f"{fault}; `p` is the shaft power, and a pressure is a head: multiply its numbers by "
            f"{metres:.4g} and name it `H [m]`"
        ) from None


def _columns(path: Path) -> dict[str, FloatArray]:
    with reading(path, "a pump curve"):
        names, *rows = _from_names(read_rows(path))
        known = _recognised(names)
        if not {"Q_m3ph", "H_m"} <= set(known) or not {"eta", "p_shaft_W"} & set(known):
            raise ParameterError(
                f"columns {', '.join(names)}; need Q_m3ph, H_m and eta or p_shaft_W, or with units "
                "in brackets: flow [l/s], head [m], efficiency [%], power [kW]"
            )
        found = {
            quantity: factor * numbers(rows, names.index(name), name)
            for quantity, (name, factor) in known.items()
        }
    assumed = {name: unit for name, unit in without_unit(names, COLUMNS).items() if unit != "1"}
    if assumed:
        warnings.warn(
            f"{path}: no unit in the names {', '.join(assumed)}: "
            f"{', '.join(UNITS.get(unit, unit) for unit in assumed.values())} are taken; name it, "
            "as in `flow [l/s]`",
            Note,
            stacklevel=2,
        )
    return found
