"""Balance of array and shaft, without time: the speed at which the drive draws what there is.

The power that the drive draws is tabulated over speed at a few voltages; each sample inverts the
table by interpolation.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from reluctance.base.arrays import FloatArray
from reluctance.plant.hydraulics.pipe import Hydraulics
from reluctance.pumping.loss_map import LossMap

VOLTAGES = 9  # of the table, equidistant over the loss map's


class Limit(IntEnum):
    """What keeps the drive from drawing more power."""

    none = 0
    speed = 1  # of the pump
    torque = 2  # the largest that the drive is used for
    voltage = 3  # too low for the torque at this speed
    well = 4  # its yield


@dataclass(frozen=True)
class PowerTable:
    """Power from the dc link over speed, at voltages; and where the drive's reach ends."""

    u_dc: FloatArray  # (n_u,) [V]
    omega: FloatArray  # (n_w,) [rad/s]
    p_in: FloatArray  # (n_u, n_w), rising along each row [W]
    last: FloatArray  # (n_u,) index of the largest speed that may be run; -1: none
    limit: FloatArray  # (n_u,) the Limit beyond it

    def p_max(self) -> FloatArray:
        """Power at the largest speed, at each voltage; 0 where nothing may be run [W]."""
        rows = np.arange(len(self.u_dc))
        return np.where(self.last >= 0, self.p_in[rows, np.maximum(self.last, 0)], 0.0)


def power_table(losses: LossMap, load: Hydraulics, *, B: float, Q_max: float) -> PowerTable:
    """The table for a pump behind a shaft with friction B [N m s]; no speed gives more than Q_max
    [m^3/s], or takes more torque than the drive has."""
    u_dc = np.linspace(losses.u_dc[0], losses.u_dc[-1], VOLTAGES)
    u, omega = np.meshgrid(u_dc, load.omega, indexing="ij")
    tau = load.tau + B * load.omega
    p_in = np.maximum.accumulate(losses.p_in(u, omega, np.broadcast_to(tau, u.shape)), axis=1)
    allowed = (tau <= losses.greatest_torque(u, omega)) & (load.Q <= Q_max)
    last = np.where(allowed.all(axis=1), len(tau), np.argmin(allowed, axis=1)) - 1
    beyond = np.minimum(last + 1, len(tau) - 1)
    limit = np.select(
        [last == len(tau) - 1, load.Q[beyond] > Q_max, tau[beyond] > losses.tau_set_up],
        [Limit.speed, Limit.well, Limit.torque],
        Limit.voltage,
    )
    return PowerTable(u_dc, load.omega, p_in, last, limit)


def limit_of(
    table: PowerTable, u_dc: FloatArray, p: FloatArray, omega: FloatArray, drawn: FloatArray
) -> FloatArray:
    """The Limit of samples with a voltage and a power, whose speed and power drawn are known.

    A sample at rest has one where its power would reach the least speed that lifts water, but the
    drive lacks the torque for it.
    """
    place = np.interp(u_dc, table.u_dc, np.arange(len(table.u_dc)))
    row = np.rint(place).astype(int)
    runs = (omega > 0) & (drawn < p * (1 - 1e-9))
    rests = (omega == 0) & (table.last[row] < 0) & (p >= table.p_in[row, 0])
    return np.where(runs | rests, table.limit[row], Limit.none)


def speed(table: PowerTable, u_dc: FloatArray, p: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Speed [rad/s] and power drawn [W] of samples with a voltage and a power.

    Both are 0 where the power does not reach the least speed that lifts water. Where it exceeds
    the largest speed's, that speed is kept and the rest is not drawn. Between two voltages both
    are interpolated. Voltages outside the table take its edge.
    """
    u = np.clip(u_dc, table.u_dc[0], table.u_dc[-1])
    place = np.interp(u, table.u_dc, np.arange(len(table.u_dc)))
    row = np.minimum(place.astype(int), len(table.u_dc) - 2)
    part = place - row
    omega, drawn = np.zeros_like(u), np.zeros_like(u)
    inverse = [_inverse(table, k) for k in range(len(table.u_dc))]
    p_max = table.p_max()
    for k in range(len(table.u_dc) - 1):
        here = np.flatnonzero(row == k)
        if not len(here):
            continue
        low, high = (np.interp(p[here], *pair, left=0.0) for pair in inverse[k : k + 2])
        f = part[here]
        # Next to a voltage without reach, the nearer of the two decides.
        both = (low > 0) & (high > 0)
        omega[here] = np.where(both, low + (high - low) * f, np.where(f < 0.5, low, high))
        most = np.where(both, p_max[k] + (p_max[k + 1] - p_max[k]) * f, p_max[k + (f >= 0.5)])
        drawn[here] = np.where(omega[here] > 0, np.minimum(p[here], most), 0.0)
    return omega, drawn


def _inverse(table: PowerTable, k: int) -> tuple[FloatArray, FloatArray]:
    """Powers and speeds of a row up to its last; speed 0 where it has none."""
    end = int(table.last[k]) + 1
    if end <= 0:
        return np.array([0.0, 1.0]), np.zeros(2)
    return table.p_in[k, :end], table.omega[:end]
