"""What phases give that follow their shares as far as the voltage lets them, motoring: offline.

The current of one phase is integrated over electrical periods: each step it meets the reference of
the step's end, or what +-u_dc makes of it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from reluctance import _core
from reluctance.drive.known import Known
from reluctance.laws.flat_top import SETTLED, TURNS, heun

FloatArray = NDArray[np.float64]


def mean_of_shares(
    known: Known, theta: FloatArray, i_ref: FloatArray, reach: FloatArray
) -> FloatArray:
    """Mean torque of all phases, (n_reach, n_torques) [N m].

    Parameters
    ----------
    known : Known
    theta : ndarray, shape (n,)
        Electrical, from 0 to pi in equal steps [rad].
    i_ref : ndarray, shape (n_torques, n)
        References there; none past alignment [A].
    reach : ndarray, shape (n_reach,)
        Electrical speeds over the dc-link voltage [rad/Wb].
    """
    torques, steps = i_ref.shape[0], 2 * (len(theta) - 1)
    turn = float(theta[1])
    point = known.at(known.omega_m)
    speed = np.repeat(reach, torques) * point.u_dc / point.N_r
    dt = turn / (point.N_r * speed)
    wanted = np.zeros((torques, steps + 1))
    wanted[:, : len(theta)] = i_ref
    goals = np.tile(wanted, (len(reach), 1))
    i = np.zeros_like(speed)

    def after(i: FloatArray, here: FloatArray, u: float, angle: float) -> FloatArray:
        """The current a step later at a voltage [A]."""
        return heun(point, here, i, u, np.full_like(i, angle + turn), dt, omega_m=speed)[0]

    for _ in range(TURNS):
        start, tau = i, np.zeros_like(i)
        for step in range(steps):
            angle = step * turn
            here = _core.magnetics(point.magnetics, i, np.full_like(i, angle))
            tau += here[:, 2]
            least = after(i, here, -point.u_dc, angle)
            goal = goals[:, step + 1]
            if goal.any():
                most = after(i, here, point.u_dc, angle)
                i = np.maximum(np.minimum(goal, most), least)
            else:
                i = least
        if np.all(np.abs(i - start) <= SETTLED * point.i_max):
            break
    return np.asarray((point.n_phases * tau / steps).reshape(len(reach), torques))
