"""A centrifugal pump, as files describe it.

Either a parabola through shut-off and best point, H_1 = H_0 - c Q^2, with the efficiency
eta_b x (2 - x), x = Q/Q_b, so that P_1 = rho g H_1 Q_b / (eta_b (2 - x)) is finite at Q = 0; or
points of the maker's curve in a file (curve_file.py).
"""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from reluctance.base.arrays import FloatArray
from reluctance.base.errors import ParameterError, named
from reluctance.base.files import is_file
from reluctance.base.schema import FileName, NamesFile, Section, checked, did_you_mean, placed
from reluctance.base.toml_file import read_toml
from reluctance.plant.hydraulics.curve import GRAVITY, M3PH, RHO, RPM, Curve
from reluctance.plant.hydraulics.curve_file import curve_from

# The formula of the efficiency ends at twice the best flow; near it the power has a pole.
LARGEST_X = 1.8
LEAST_RPM = 100.0  # the largest pumps turn at some 200 rpm


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
            return curve_from(Path(self.curve_csv), self.n_ref_rpm * RPM)
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
