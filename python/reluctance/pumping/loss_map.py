"""Losses of a drive over dc-link voltage, speed and torque, from switched runs on a locked shaft.

The control law is set up once, as for firmware: for the drive's nominal voltage, the greatest speed
and the greatest torque. Tables of a law take longer than all runs.

Stored is loss over torque, which is nearly straight in all three: at random points between runs
the power drawn is off by 0.2 % rms, where linear interpolation of the power itself is off by 2 %.
It is stored over the torque that a run achieved, not the one it was asked for, and with the
greatest torque achieved at each voltage and speed.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np
from scipy.interpolate import RegularGridInterpolator

import reluctance
from reluctance import _core
from reluctance.base.arrays import FloatArray
from reluctance.base.cache import cached
from reluctance.base.errors import ParameterError
from reluctance.base.schema import file_keys
from reluctance.drive.drive import Drive
from reluctance.drive.guard.supervised import controller
from reluctance.drive.laws.own_law import OwnLaw
from reluctance.drive.tables.faults import Faults
from reluctance.drive.tables.supervision import Supervision
from reluctance.explore.efficiency_map.locked import at, length, rising

ALGORITHM = 7  # raised when the same drive gives other numbers
SHAPE = (5, 9, 5)  # voltages, speeds, torques
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
    tau_set_up: float  # that the control law is set up for [N m]
    given: FloatArray  # (n_u, n_w) torque achieved over the last one asked for [1]

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
        return self._of_points(self.tau_max, u_dc, omega)

    def given_at_limit(self, u_dc: FloatArray, omega: FloatArray) -> FloatArray:
        """The torque that the control law gives there over the greatest that it is asked for [1]:
        the balance ends at the torque, firmware at what is asked for."""
        return self._of_points(self.given, u_dc, omega)

    def _of_points(self, values: FloatArray, u_dc: FloatArray, omega: FloatArray) -> FloatArray:
        axes = (self.u_dc, self.omega)
        point = [
            np.clip(x, axis[0], axis[-1])
            for x, axis in zip(np.broadcast_arrays(u_dc, omega), axes, strict=True)
        ]
        return np.asarray(RegularGridInterpolator(axes, values)(np.stack(point, -1)))


def loss_map(
    drive: Drive,
    box: Box,
    *,
    shape: tuple[int, int, int] = SHAPE,
    progress: Callable[[float], None] | None = None,
) -> LossMap:
    """The map of a drive whose law is set up for its own voltage, the greatest speed and torque of
    the box; from the cache, or from as many switched runs as the grid has points.

    Raises
    ------
    ParameterError
        If the control law takes no torque reference, or reaches none at its voltage and speed.
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


@dataclass(frozen=True)
class SetUp:
    """A drive whose control law has its tables."""

    drive: Drive
    law: _core.Law | None  # one in Python has a state of its own: it is made anew for each run
    tau_max: float  # that the law is set up for [N m]

    def run(self, *, u_dc: float, omega: float, tau: float) -> tuple[float, float]:
        """Mean torque [N m] and loss [W] of a switched run with this torque reference [N m]."""
        point = at(self.drive, u_dc=u_dc, omega=omega, tau=tau, tau_max=self.tau_max)
        figures = reluctance.simulate(
            point, until=length(point, omega), record=None, controller=controller(point, self.law)
        ).kpis
        # Not p_in - p_mech: in that is what the field energy rose by while the figures were taken.
        kinds = figures.p_cu, figures.p_dev, figures.p_sw, figures.p_fe
        return figures.tau_mean, sum(p for p in kinds if p is not None)


def set_up(drive: Drive, omega: float, tau_max: float) -> SetUp:
    """The drive with its law for its nominal voltage, a speed [rad/s] and a greatest torque [N m];
    where the law does not reach this torque there, for the greatest that it does.

    Raises
    ------
    ParameterError
        If it reaches none.
    """
    drive = drive.computed(supervision=Supervision(), faults=Faults())

    def made(tau: float) -> SetUp:
        point = at(drive, u_dc=drive.converter.u_dc_V, omega=omega, tau=tau, tau_max=tau)
        # The speed of a pump is not held, and it motors.
        law = point.law(replace(point.known(), motors=False, reference="pv"))
        return SetUp(drive, None if isinstance(drive.control, OwnLaw) else law, tau)

    try:
        return made(tau_max)
    except ParameterError as fault:
        refused, why = tau_max, fault
    found, held = None, 0.0
    while refused - held > (1 - HELD) * tau_max:
        middle = (held + refused) / 2
        try:
            found, held = made(middle), middle
        except ParameterError:
            refused = middle
    if found is None:
        raise why
    return found


def _from_runs(
    drive: Drive,
    box: Box,
    shape: tuple[int, int, int],
    progress: Callable[[float], None] | None,
) -> LossMap:
    u_dc = np.linspace(*box.u_dc, shape[0])
    omega = np.linspace(*box.omega, shape[1])
    tau = np.linspace(LEAST_TORQUE * box.tau_max, box.tau_max, shape[2])
    able = set_up(drive, box.omega[1], box.tau_max)
    asked = np.append(tau[tau < able.tau_max], able.tau_max)
    points = [(float(u), float(w)) for u, w in product(u_dc, omega)]
    rows: list[Row] = []
    with ThreadPoolExecutor(PROCESSES) as pool:
        for row in pool.map(lambda uw: _row(able, uw[0], uw[1], asked), points):
            rows.append(row)
            if progress is not None:
                progress(len(rows) / len(points))
    return _indexed_by_achieved(u_dc, omega, tau, rows, able.tau_max)


@dataclass(frozen=True)
class Row:
    """Switched runs at one voltage and speed, over rising torques (n,)."""

    asked: FloatArray  # [N m]
    achieved: FloatArray  # [N m]
    loss: FloatArray  # [W]


def _row(able: SetUp, u: float, w: float, asked: FloatArray) -> Row:
    found = [able.run(u_dc=u, omega=w, tau=x) for x in asked.tolist()]
    achieved, loss = np.array(found).T
    return Row(asked, achieved, loss)


def _indexed_by_achieved(
    u_dc: FloatArray, omega: FloatArray, tau: FloatArray, rows: list[Row], tau_set_up: float
) -> LossMap:
    shape = len(u_dc), len(omega)
    ratio, tau_max, given = np.zeros((*shape, len(tau))), np.zeros(shape), np.zeros(shape)
    for (u, w), row in zip(np.ndindex(*shape), rows, strict=True):
        x = np.maximum(row.achieved, 1e-9)
        rises = rising(row.asked, x)
        most, given[u, w] = float(x.max()), x[-1] / row.asked[-1]
        tau_max[u, w] = tau[-1] if most > HELD * tau[-1] else most
        ratio[u, w] = np.interp(tau, x[rises], (row.loss / x)[rises])
    return LossMap(u_dc, omega, tau, ratio, tau_max, tau_set_up, given)


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
