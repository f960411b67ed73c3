"""Turn-on and turn-off angles over speed and torque, as a CSV file has them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from reluctance.base.arrays import FloatArray
from reluctance.base.errors import ParameterError
from reluctance.base.key_figures import Kpis
from reluctance.base.reading import numbers, place_of, read_rows, reading
from reluctance.base.schema import did_you_mean
from reluctance.base.units import to_si

COLUMNS = ("speed_rpm", "torque_Nm", "theta_on_deg", "theta_off_deg")
NOTE = "note"  # why a node is as it is
MOST_BYTES = 1_000_000


@dataclass(frozen=True)
class AngleTable:
    """Angles at the nodes of a grid, for motoring."""

    omega: FloatArray  # (n_speeds,) rising [rad/s]
    tau: FloatArray  # (n_torques,) rising [N m]
    theta_on: FloatArray  # (n_speeds, n_torques), electrical [rad]
    theta_off: FloatArray

    def at(self, omega: float, tau: float) -> tuple[float, float]:
        """Turn-on and turn-off angle: bilinear between the nodes, held outside [rad]."""
        on, off = (
            np.interp(omega, self.omega, [np.interp(tau, self.tau, row) for row in angles])
            for angles in (self.theta_on, self.theta_off)
        )
        return float(on), float(off)


def read_angle_table(path: str | Path) -> AngleTable:
    """The table of a CSV file with a row for each node of a grid of speeds and torques, in any
    order. Key figures of `run --json` and `note` may stand beside the four columns.

    Raises
    ------
    ParameterError
        If the file cannot be read, a column is missing or unknown, the rows are no full grid, or
        angles are no window.
    """
    path = Path(path)
    rows = _rows(path)
    nodes: dict[tuple[float, float], tuple[float, float]] = {}
    for number, row in enumerate(rows, 2):
        speed, torque, on, off = _node(f"{path}, row {number}", row)
        if (speed, torque) in nodes:
            raise ParameterError(f"{path}: {speed:g} rpm, {torque:g} N m is there twice")
        nodes[speed, torque] = on, off
    speeds, torques = (sorted(set(values)) for values in zip(*nodes, strict=True))
    if len(speeds) < 2 or len(torques) < 2:
        raise ParameterError(
            f"{path} has {len(speeds)} speeds and {len(torques)} torques, need at least two of each"
        )
    for speed in speeds:
        for torque in torques:
            if (speed, torque) not in nodes:
                raise ParameterError(
                    f"{path} has no row for {speed:g} rpm and {torque:g} N m, need a full grid: "
                    f"each of {len(speeds)} speeds with each of {len(torques)} torques"
                )
    angles = np.radians([[nodes[speed, torque] for torque in torques] for speed in speeds])
    omega = to_si(np.array(speeds), "rpm")
    return AngleTable(omega, np.array(torques), angles[..., 0], angles[..., 1])


def _rows(path: Path) -> list[list[float]]:
    """Speed [rpm], torque [N m] and angles [deg] of each row."""
    with reading(path, "a table of angles"):
        names, *rows = read_rows(path, most_bytes=MOST_BYTES)
        for name in COLUMNS:
            if name not in names:
                raise ParameterError(f"{path} has no column `{name}`, need {', '.join(COLUMNS)}")
        known = (*COLUMNS, *Kpis.border_names(), NOTE)
        for name in names:
            if name not in known:
                raise ParameterError(
                    f"unknown column `{name}`{did_you_mean(name, (*COLUMNS, NOTE))}"
                )
        if not rows:
            raise ParameterError(f"{path} has no rows")
        columns = [numbers(rows, place_of(names, name), name) for name in COLUMNS]
        found: list[list[float]] = np.stack(columns, axis=1).tolist()
        return found


def _node(where: str, row: list[float]) -> tuple[float, float, float, float]:
    """The numbers of a row, checked."""
    speed, torque, on, off = row
    if not speed > 0:
        raise ParameterError(f"{where}: speed_rpm = {speed:g}, need > 0")
    if not torque > 0:
        raise ParameterError(f"{where}: torque_Nm = {torque:g}, need > 0; the table motors")
    if not -180 <= on < 180:
        raise ParameterError(f"{where}: theta_on_deg = {on:g}, need from -180 to below 180")
    if not on < off <= min(360, on + 360):
        raise ParameterError(
            f"{where}: theta_off_deg = {off:g}, need above theta_on_deg = {on:g} and at most 360"
        )
    return speed, torque, on, off
