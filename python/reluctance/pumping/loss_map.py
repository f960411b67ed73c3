"""Losses of a drive over dc-link voltage, speed and torque, from switched runs on a locked shaft.

Stored is loss over torque, which is nearly straight in all three: at random points between 75 runs
the power drawn is off by 0.2 % rms, where linear interpolation of the power itself is off by 2 %.
It is stored over the torque that a run achieved, not the one it was asked for, and with the
greatest torque achieved at each voltage and speed.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from scipy.interpolate import RegularGridInterpolator

import reluctance
from reluctance.base.arrays import FloatArray
from reluctance.base.cache import cached
from reluctance.base.errors import ParameterError
from reluctance.base.schema import file_keys
from reluctance.drive.drive import Drive
from reluctance.explore.efficiency_map.locked import at, length, rising

ALGORITHM = 4  # raised when the same drive gives other numbers
SHAPE = (3, 5, 5)  # voltages, speeds, torques
HELD = 0.97  # of the last torque asked for: from here on the drive holds it
LEAST_TORQUE = 0.05  # of the greatest: the first of the torques
PROCESSES = 2  # threads in the core, which runs without Python's lock


@dataclass(frozen=True)
class Box:
    """What the map covers."""

    u_dc: tuple[float, float]  # [V]
    omega: tuple[float, float]  # [rad/s]
    tau_max: float  # [N m]


@dataclass(frozen=True)
class LossMap:
    """Loss over torque on a grid; axes rise."""

    u_dc: FloatArray  # (n_u,) [V]
    omega: FloatArray  # (n_w,) [rad/s]
    tau: FloatArray  # (n_t,) electromagnetic torque, achieved [N m]
    loss_per_torque: FloatArray  # (n_u, n_w, n_t) [W/(N m)]
    tau_max: FloatArray  # (n_u, n_w) greatest torque achieved, or the end of the map [N m]

    def p_in(self, u_dc: FloatArray, omega: FloatArray, tau: FloatArray) -> FloatArray:
        """Power from the dc link at an electromagnetic torque [W]. Outside the grid the loss over
        torque is that of its edge."""
        axes = (self.u_dc, self.omega, self.tau)
        point = [
            np.clip(x, axis[0], axis[-1])
            for x, axis in zip(np.broadcast_arrays(u_dc, omega, tau), axes, strict=True)
        ]
        ratio = RegularGridInterpolator(axes, self.loss_per_torque)(np.stack(point, -1))
        return np.asarray(tau * (omega + ratio))

    def greatest_torque(self, u_dc: FloatArray, omega: FloatArray) -> FloatArray:
        """What the drive can give there [N m]."""
        axes = (self.u_dc, self.omega)
        point = [
            np.clip(x, axis[0], axis[-1])
            for x, axis in zip(np.broadcast_arrays(u_dc, omega), axes, strict=True)
        ]
        return np.asarray(RegularGridInterpolator(axes, self.tau_max)(np.stack(point, -1)))


def loss_map(
    drive: Drive,
    box: Box,
    *,
    shape: tuple[int, int, int] = SHAPE,
    progress: Callable[[float], None] | None = None,
) -> LossMap:
    """The drive's map, from the cache or from as many switched runs as the grid has points.

    Raises
    ------
    ParameterError
        If the control law takes no torque reference, or the drive holds no point of the grid.
    """
    if not drive.control.follows_torque:
        raise ParameterError(
            "drive: its control law fixes the current and cannot follow a torque; take another law"
        )
    return cached(
        LossMap,
        [_content(drive), box.u_dc, box.omega, box.tau_max, shape],
        lambda: _from_runs(drive, box, shape, progress),
        algorithm=ALGORITHM,
    )


def run(point: Drive) -> tuple[float, float]:
    """Mean torque [N m] and loss [W] of a switched run."""
    until = length(point, point.omega_nominal)
    figures = reluctance.simulate(point, until=until, record=None).kpis
    return figures.tau_mean, figures.p_in - figures.p_mech


def _from_runs(
    drive: Drive,
    box: Box,
    shape: tuple[int, int, int],
    progress: Callable[[float], None] | None,
) -> LossMap:
    u_dc = np.linspace(*box.u_dc, shape[0])
    omega = np.linspace(*box.omega, shape[1])
    tau = np.linspace(LEAST_TORQUE * box.tau_max, box.tau_max, shape[2])
    points = [(float(u), float(w)) for u, w in product(u_dc, omega)]
    rows: list[Row] = []
    with ThreadPoolExecutor(PROCESSES) as pool:
        for row in pool.map(lambda uw: _row(drive, uw[0], uw[1], tau), points):
            rows.append(row)
            if progress is not None:
                progress(len(rows) / len(points))
    return _indexed_by_achieved(u_dc, omega, tau, rows)


@dataclass(frozen=True)
class Row:
    """Switched runs at one voltage and speed, over rising torques (n,); none where the control law
    reaches no torque."""

    asked: FloatArray  # [N m]
    achieved: FloatArray  # [N m]
    loss: FloatArray  # [W]


def _row(drive: Drive, u: float, w: float, tau: FloatArray) -> Row:
    top = float(tau[-1])
    asked, found = [], []
    for x in tau.tolist():
        for tau_max in (top, x):  # tables that do not reach the top may reach this torque
            try:
                found.append(run(at(drive, u_dc=u, omega=w, tau=x, tau_max=tau_max)))
                asked.append(x)
                break
            except ParameterError:
                continue
        else:
            most = _reached(drive, u, w, asked[-1] if asked else 0.0, x)
            if most is not None:
                found.append(run(at(drive, u_dc=u, omega=w, tau=most, tau_max=most)))
                asked.append(most)
            break
    achieved, loss = np.array(found).reshape(-1, 2).T
    return Row(np.array(asked), achieved, loss)


def _reached(drive: Drive, u: float, w: float, held: float, refused: float) -> float | None:
    """The greatest torque that the control law can be set up for, between one that it can and one
    that it cannot; None if it is the first [N m]."""
    low, high = held, refused
    while high - low > (1 - HELD) * refused:
        middle = (low + high) / 2
        try:
            at(drive, u_dc=u, omega=w, tau=middle, tau_max=middle).controller()
            low = middle
        except ParameterError:
            high = middle
    return low if low > held else None


def _indexed_by_achieved(
    u_dc: FloatArray, omega: FloatArray, tau: FloatArray, rows: list[Row]
) -> LossMap:
    shape = len(u_dc), len(omega)
    ratio, tau_max = np.full((*shape, len(tau)), np.nan), np.zeros(shape)
    for (u, w), row in zip(np.ndindex(*shape), rows, strict=True):
        if not len(row.asked):
            continue
        x = np.maximum(row.achieved, 1e-9)
        rises = rising(row.asked, x)
        most = float(x.max())
        tau_max[u, w] = tau[-1] if most > HELD * tau[-1] else most
        ratio[u, w] = np.interp(tau, x[rises], (row.loss / x)[rises])
    if not np.any(tau_max > tau[0]):
        raise ParameterError(
            f"drive: it holds {tau[0]:.3g} N m at no voltage from {u_dc[0]:g} to {u_dc[-1]:g} V "
            f"and no speed from {omega[0] * 30 / np.pi:.4g} to {omega[-1] * 30 / np.pi:.4g} rpm; "
            "more modules in series raise the voltage"
        )
    return LossMap(u_dc, omega, tau, _filled(ratio), tau_max)


def _filled(ratio: FloatArray) -> FloatArray:
    """Where no run was possible, the loss over torque of the nearest point of the grid that has
    one: no torque is drawn there, but values between the points are interpolated."""
    known = np.argwhere(~np.isnan(ratio[..., 0]))
    found = ratio.copy()
    for u, w in np.argwhere(np.isnan(ratio[..., 0])):
        nearest = known[np.argmin(np.abs(known - (u, w)).sum(axis=1))]
        found[u, w] = ratio[tuple(nearest)]
    return found


def _content(drive: Drive) -> object:
    """All that the runs depend on."""
    from reluctance.machine.optimum.magnetics import content

    files = set(file_keys(type(drive.machine)))  # paths: their content is in the magnetics
    table = getattr(drive.control, "angle_table", None)
    return [
        reluctance.__version__,
        [*content(drive.machine.magnetics)],
        drive.machine.model_dump(mode="json", exclude=files),
        *(
            section.model_dump(mode="json")
            for section in (drive.converter, drive.control, drive.sensing, drive.mismatch)
        ),
        drive.simulation.dt_max_us,
        *([Path(table).read_text("utf-8")] if table else []),
    ]
