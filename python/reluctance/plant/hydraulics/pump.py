"""A centrifugal pump: head and shaft power over flow at one speed, at all speeds by affinity.

    H(Q, r) = r^2 H_1(Q/r),   P(Q, r) = r^3 P_1(Q/r),   r = speed / reference speed

Either a parabola through shut-off and best point, H_1 = H_0 - c Q^2, with the efficiency
eta_b x (2 - x), x = Q/Q_b, so that P_1 = rho g H_1 Q_b / (eta_b (2 - x)) is finite at Q = 0; or
points of the maker's curve in a CSV file, joined by monotone cubics.
"""

import re
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from reluctance.base.arrays import FloatArray
from reluctance.base.columns import Quantity, recognised, without_unit
from reluctance.base.errors import Note, ParameterError, named
from reluctance.base.files import is_file, read_toml
from reluctance.base.reading import numbers, read_rows, reading
from reluctance.base.schema import FileName, NamesFile, Section, checked, did_you_mean, placed

RHO = 998.2  # water at 20 degC [kg/m^3]
GRAVITY = 9.80665  # [m/s^2]
RPM = np.pi / 30
M3PH = 1 / 3600
# The formula of the efficiency ends at twice the best flow; near it the power has a pole.
LARGEST_X = 1.8
DROOP = 1e-3  # of the largest head, by which a flat one falls: less than a curve is read to
MOST_FLOW, GREATEST_HEAD = 1e6, 1e4  # of any pump [m^3/h], [m]
LEAST_RPM = 100.0  # the largest pumps turn at some 200 rpm


@dataclass(frozen=True)
class Curve:
    """Head and shaft power at the reference speed."""

    omega_ref: float  # [rad/s]
    Q_end: float  # largest flow that the curve describes, at the reference speed [m^3/s]
    head_1: Callable[[FloatArray], FloatArray]  # of flow [m]
    power_1: Callable[[FloatArray], FloatArray]  # of flow [W]

    def head(self, Q: FloatArray, r: FloatArray) -> FloatArray:
        """Head at a flow [m^3/s] and a part of the reference speed [m]."""
        return np.asarray(r**2 * self.head_1(Q / np.maximum(r, 1e-12)))

    def shaft_power(self, Q: FloatArray, r: FloatArray) -> FloatArray:
        """Shaft power, finite without flow [W]."""
        return np.asarray(r**3 * self.power_1(Q / np.maximum(r, 1e-12)))

    @property
    def H_0(self) -> float:
        """Head without flow at the reference speed [m]."""
        return float(self.head_1(np.zeros(1))[0])


LEAST_BEST = 0.03  # efficiency: the smallest pumps reach some 10 %; less is a fraction in per cent
POOR, USUAL = 0.24, (0.4, 0.86)  # best efficiencies: of few pumps, and of most
APART = 2.0  # of two efficiencies of one curve: one more than the other is a wrong unit
DIFFERENT = 0.15  # the same: from here on it is said
BETTER = 0.02  # efficiency by which a curve may pass its points unsaid


class Pump(Section):
    """A pump file's [pump] table, or that of a system file."""

    name: str = "pump"
    source: str = ""
    licence: str = ""
    n_ref_rpm: float = Field(gt=0)  # speed of the curve, at least LEAST_RPM
    speed_max_rpm: float | None = Field(None, gt=0)  # by default 1.15 times n_ref_rpm
    H_0_m: float | None = Field(None, gt=0)  # head without flow
    Q_b_m3ph: float | None = Field(None, gt=0)  # best point: flow, head, efficiency
    H_b_m: float | None = Field(None, gt=0)
    eta_b: float | None = Field(None, gt=0, lt=1)
    curve_csv: FileName | None = None  # columns Q_m3ph, H_m and eta or p_shaft_W

    @model_validator(mode="after")
    def has_one_curve(self) -> "Pump":
        if self.n_ref_rpm < LEAST_RPM:
            raise ValueError(
                f"n_ref_rpm = {self.n_ref_rpm:g}, need at least {LEAST_RPM:g}; check its unit: "
                f"{self.n_ref_rpm:g} revolutions a second are {60 * self.n_ref_rpm:g} rpm"
            )
        numbers = (self.H_0_m, self.Q_b_m3ph, self.H_b_m, self.eta_b)
        if self.curve_csv is not None:
            if any(number is not None for number in numbers):
                raise ValueError("curve_csv excludes H_0_m, Q_b_m3ph, H_b_m and eta_b")
            return self
        if any(number is None for number in numbers):
            raise ValueError("need H_0_m, Q_b_m3ph, H_b_m and eta_b, or curve_csv")
        assert self.H_0_m is not None and self.H_b_m is not None
        if self.H_b_m >= self.H_0_m:
            raise ValueError(
                f"H_b_m = {self.H_b_m:g} is not below H_0_m = {self.H_0_m:g}: a head that rises "
                "with flow has two flows at one head"
            )
        return self

    @property
    def omega_max(self) -> float:
        """Largest speed allowed [rad/s]."""
        return (self.speed_max_rpm or 1.15 * self.n_ref_rpm) * RPM

    def curve(self) -> Curve:
        """The curve at the reference speed.

        Raises
        ------
        ParameterError
            If the points of the CSV file are not a falling curve.
        """
        if self.curve_csv is not None:
            return _from_points(Path(self.curve_csv), self.n_ref_rpm * RPM)
        assert self.H_0_m and self.Q_b_m3ph and self.H_b_m and self.eta_b
        return _parabola(
            self.H_0_m, self.Q_b_m3ph * M3PH, self.H_b_m, self.eta_b, self.n_ref_rpm * RPM
        )


class NamesPump(NamesFile):
    """Marks a key that names a pump: of the library, or by the path of a pump file."""

    def renamed(self, text: str, rename: Callable[[Path], Path]) -> str:
        path = rename(Path(text))
        return str(path) if is_file(path) or is_file(Path(text)) else text

    def files(self, text: str) -> list[Path]:
        path = pump_file(text, Path())
        return [path, *pump_from(text, Path()).files]


PumpName = Annotated[str, NamesPump()]


def pump_file(pump: str, folder: Path) -> Path:
    """The file of a pump, by its path from a folder or by its name in the library.

    Raises
    ------
    ParameterError
        If there is none.
    """
    for path in (folder / pump, library() / f"{pump}.toml"):
        if is_file(path):
            return path
    near = did_you_mean(pump, [p.stem for p in library().glob("*.toml")])
    raise ParameterError(f"pump `{pump}` is neither a file nor in the library{near}")


def pump_from(pump: object, folder: Path) -> Pump:
    """The checked pump that a table is, or that a text names; paths are relative to the folder."""
    if isinstance(pump, str):
        path = pump_file(pump, folder)
        with named(path):
            return pump_from(read_toml(path).get("pump"), path.parent)
    if not isinstance(pump, dict):
        raise ParameterError('missing table [pump], or pump = "NAME or FILE"')
    return checked(Pump, placed(Pump, pump, folder), "[pump]")


def library() -> Path:
    """The pumps that come with the package."""
    return Path(__file__).parent / "pumps"


def _parabola(H_0: float, Q_b: float, H_b: float, eta_b: float, omega_ref: float) -> Curve:
    c = (H_0 - H_b) / Q_b**2
    Q_end = min(LARGEST_X * Q_b, float(np.sqrt(H_0 / c)))

    def head(Q: FloatArray) -> FloatArray:
        return np.asarray(H_0 - c * Q**2)

    def power(Q: FloatArray) -> FloatArray:  # rho g Q H / eta without the 0/0 at Q = 0
        return np.asarray(RHO * GRAVITY * head(Q) * Q_b / (eta_b * (2 - Q / Q_b)))

    return Curve(omega_ref, Q_end, head, power)


def _from_points(path: Path, omega_ref: float) -> Curve:
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
