"""The flux table: flux linkage, and torque where given, over current and electrical angle."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from reluctance.base.errors import ParameterError

Array = NDArray[np.float64]

MIN_CURRENTS = 4  # with zero: the fewest that show saturation
MIN_ANGLES = 4  # the fewest that fix a cubic between unaligned and aligned

MOST_CURRENT, MOST_FLUX, MOST_TORQUE = 1e5, 1e3, 1e7  # [A], [Wb], [N m]: of no machine
LEAST_STEP = 1e-9  # of an axis, over its last value


@dataclass(frozen=True)
class FluxTable:
    """Flux linkage of one phase in the project's convention, whatever the file's was.

    Attributes
    ----------
    N_r : int
        Rotor poles.
    i : ndarray, shape (n_i,)
        Currents, rising from 0 [A].
    theta_e : ndarray, shape (n_theta,)
        Electrical angles, 0 unaligned, pi aligned; rising from 0 to pi, or from 0 to 2 pi [rad].
    psi : ndarray, shape (n_i, n_theta)
        Flux linkage [Wb].
    tau : ndarray, shape (n_i, n_theta), or None
        Torque of one phase [N m].
    period_error : float
        Largest difference between the two ends of a whole period, of the largest flux [1].
    notes : tuple of str
        What was inferred or changed while reading.
    """

    N_r: int
    i: Array
    theta_e: Array
    psi: Array
    tau: Array | None = None
    period_error: float = 0.0
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        shape = (len(self.i), len(self.theta_e))
        if self.N_r < 1:
            raise ParameterError(f"N_r = {self.N_r}, need the number of rotor poles; pass N_r")
        if shape[0] < MIN_CURRENTS:
            raise ParameterError(
                f"{shape[0]} currents with zero, need at least {MIN_CURRENTS}: one current says "
                "nothing about saturation; sample the map at more currents"
            )
        if shape[1] < MIN_ANGLES:
            raise ParameterError(
                f"{shape[1]} angles, need at least {MIN_ANGLES} from unaligned to aligned; "
                "sample the map at more angles"
            )
        for name, value in (("flux", self.psi), ("torque", self.tau)):
            if value is not None and value.shape != shape:
                raise ParameterError(
                    f"{name} table is {' x '.join(map(str, value.shape))}, need "
                    f"{shape[0]} currents x {shape[1]} angles; transpose it or mend its axes"
                )
            if value is not None and not np.isfinite(value).all():
                row, column = np.argwhere(~np.isfinite(value))[0]
                raise ParameterError(
                    f"{name} at {self.i[row]:g} A, {np.degrees(self.theta_e[column]):.4g} deg el. "
                    f"is {value[row, column]}, need a number; fill the cell or leave its row out"
                )
        for name, value, most in (
            ("current", self.i, MOST_CURRENT),
            ("flux", self.psi, MOST_FLUX),
            ("torque", self.tau, MOST_TORQUE),
        ):
            if value is not None and not np.abs(value).max() <= most:
                raise ParameterError(
                    f"{name} reaches {np.abs(value).max():.3g}, need at most {most:g} in SI units; "
                    "correct the unit in the column's name"
                )
        for name, axis in (("currents", self.i), ("angles", self.theta_e)):
            if not (axis[0] == 0 and np.all(np.diff(axis) > LEAST_STEP * axis[-1])):
                raise ParameterError(
                    f"{name} need to rise from 0, in steps above {LEAST_STEP:g} of the last; sort "
                    "them and leave out what is there twice"
                )

    @property
    def half(self) -> bool:
        """Whether the table covers unaligned to aligned only."""
        return bool(self.theta_e[-1] <= np.pi)

    @property
    def theta_m(self) -> Array:
        """Mechanical angles [rad]."""
        return self.theta_e / self.N_r

    def times(self, factor: float) -> "FluxTable":
        """With flux linkage and torque times a factor [1]."""
        tau = None if self.tau is None else factor * self.tau
        return replace(self, psi=factor * self.psi, tau=tau)


def around(table: FluxTable, values: Array) -> CubicSpline:
    """Cubic C2 spline of `values` (n_i, n_theta) over theta_e, along axis 1.

    A half period has no slope at its ends, by symmetry; a whole period closes on itself.
    """
    if table.half:
        return CubicSpline(table.theta_e, values, axis=1, bc_type="clamped")
    theta_e, closed = _closed(table.theta_e, values)
    return CubicSpline(theta_e, closed, axis=1, bc_type="periodic")


def fold(table: FluxTable) -> FluxTable:
    """The mean of a whole period and its mirror image, as a half period; a half period as it is."""
    if table.half:
        return table
    mirrored = np.minimum(table.theta_e, 2 * np.pi - table.theta_e)
    theta_e = _distinct(np.concatenate([[0.0, np.pi], mirrored]))
    spline = around(table, table.psi)
    psi = (spline(theta_e) + spline(2 * np.pi - theta_e)) / 2
    tau = None
    if table.tau is not None:
        torque = around(table, table.tau)
        tau = (torque(theta_e) - torque(2 * np.pi - theta_e)) / 2
    note = "whole period folded: mean of the map and its mirror image"
    return replace(table, theta_e=theta_e, psi=psi, tau=tau, notes=(*table.notes, note))


def _closed(theta_e: Array, values: Array) -> tuple[Array, Array]:
    """The table with 2 pi as its last angle and the values of angle 0 there."""
    keep = theta_e < 2 * np.pi - 1e-9
    first = values[:, :1]
    return np.append(theta_e[keep], 2 * np.pi), np.hstack([values[:, keep], first])


def _distinct(angles: Array) -> Array:
    """Sorted angles without those nearer than 1e-6 rad to the one before."""
    rising = np.sort(angles)
    distinct: Array = rising[np.append(True, np.diff(rising) > 1e-6)]
    return distinct
