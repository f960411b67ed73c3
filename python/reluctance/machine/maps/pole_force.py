"""The radial force on a stator pole over the current and the angle of its phase.

As a file: long CSV, every current with every angle from unaligned to aligned, like a flux map.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import RectBivariateSpline

from reluctance.base.errors import ParameterError
from reluctance.base.reading import numbers, place_of, read_rows, reading

Array = NDArray[np.float64]

COLUMNS = ("i_A", "theta_e_deg", "force_N")
LEAST = 4  # currents and angles: the fewest of a cubic


@dataclass(frozen=True, eq=False)
class PoleForce:
    """Of one phase alone. The force is even about unaligned and aligned, as the cross-section."""

    i: Array  # (n_i) rising from 0 [A]
    theta_e: Array  # (n_theta) from 0 to pi [rad]
    force: Array  # (n_i, n_theta), towards the rotor positive [N]

    def at(self, i: ArrayLike, theta_e: ArrayLike) -> Array:
        """Force [N] at currents [A] and electrical angles [rad], broadcast. Past the last current
        it stays."""
        i, theta_e = np.broadcast_arrays(*(np.asarray(x, dtype=np.float64) for x in (i, theta_e)))
        folded = np.abs(np.mod(theta_e + np.pi, 2 * np.pi) - np.pi)
        return np.asarray(self._spline.ev(np.clip(i, 0, self.i[-1]), folded))

    @cached_property
    def _spline(self) -> RectBivariateSpline:
        return RectBivariateSpline(self.i, self.theta_e, self.force)


def write_pole_force(pole_force: PoleForce, path: Path) -> None:
    """Writes the table; `read_pole_force` gives it back."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for i, row in zip(pole_force.i, pole_force.force, strict=True):
            for angle, force in zip(np.degrees(pole_force.theta_e), row, strict=True):
                writer.writerow(
                    [repr(float(i)), repr(round(float(angle), 10)), repr(float(f"{force:.6g}"))]
                )


def read_pole_force(path: Path) -> PoleForce:
    """The table of a file.

    Raises
    ------
    ParameterError
        With one line: no such file, a column, a number, or a node that is missing.
    """
    with reading(path, "a table of the radial force"):
        names, *rows = read_rows(path)
        if not set(COLUMNS) <= set(names):
            raise ParameterError(
                f"need numbers in the columns {', '.join(COLUMNS)}, named in the first line"
            )
        i, angle, force = (numbers(rows, place_of(names, name), name) for name in COLUMNS)
    currents, angles = np.unique(i), np.unique(angle)
    nodes = np.meshgrid(currents, angles, indexing="ij")
    whole = len(rows) == nodes[0].size > 0 and all(
        np.array_equal(x, node.ravel()) for x, node in zip((i, angle), nodes, strict=True)
    )
    ends = whole and currents[0] == 0 and angles[0] == 0 and angles[-1] == 180
    if not ends or min(len(currents), len(angles)) < LEAST:
        raise ParameterError(
            f"{path}: {len(rows)} rows are no grid; need every current, rising from 0, with every "
            "angle from 0 to 180 deg electrical"
        )
    return PoleForce(currents, np.radians(angles), force.reshape(nodes[0].shape))
