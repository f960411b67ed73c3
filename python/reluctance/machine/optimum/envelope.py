"""The greatest torque without ripple at each speed."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from reluctance.base.arrays import FloatArray
from reluctance.base.cache import cached
from reluctance.base.errors import need
from reluctance.machine.operating_point import OperatingPoint
from reluctance.machine.optimum.profile import profile_of
from reluctance.machine.optimum.programme import ALGORITHM, SLACK, Programme, checked_inputs


@dataclass(frozen=True)
class Envelope:
    """The greatest torque without ripple at each speed, and the least copper that it takes."""

    omega_m: FloatArray  # (n_speeds,) [rad/s]
    tau_max: FloatArray  # (n_speeds,) [N m]
    i_rms: FloatArray  # (n_speeds,) [A]
    i_peak: FloatArray  # (n_speeds,) [A]
    p_cu: FloatArray  # (n_speeds,) [W]


def torque_speed_envelope(
    point: OperatingPoint,
    omega_m: ArrayLike,
    *,
    n_points: int = 180,
    direction: Literal[1, -1] = 1,
    progress: Callable[[float], None] | None = None,
) -> Envelope:
    """Greatest ripple-free torque at each speed omega_m (n_speeds,) [rad/s], not the point's.

    A negative speed is braking: torque against rotation. Each speed is searched from pulses, from
    a current that never returns to zero, and from the optimum of the neighbouring speed nearer to
    standstill; the greatest torque of all is kept.

    Parameters
    ----------
    direction : -1 for the greatest negative torque; tau_max is then negative.
    progress : is told the share of speeds done [1].
    others : as for `best_profile`.

    Raises
    ------
    ParameterError : a parameter out of range.
    Unsolved : IPOPT found no optimum.
    """
    searched = checked_inputs(point, n_points, 0.0)
    speeds = np.atleast_1d(np.asarray(omega_m, dtype=np.float64))
    need(bool(np.isfinite(speeds).all()), "omega_m", omega_m, "finite speeds [rad/s]")

    def compute() -> Envelope:
        results = np.empty((4, len(speeds)))
        neighbours: dict[bool, list[FloatArray]] = {False: [], True: []}  # of braking, of driving
        for done, at in enumerate(np.argsort(np.abs(speeds), kind="stable"), start=1):
            speed = float(direction * speeds[at])
            programme = Programme(
                replace(point, omega_m=speed), n_points=n_points, direction=direction
            )
            torque, i = programme.greatest_torque(*neighbours[speed > 0])
            neighbours[speed > 0] = [i]
            tau_ref = torque * (1 - SLACK)
            best = profile_of(programme, tau_ref, programme.best(tau_ref, "max", i))
            results[:, at] = direction * torque, best.i_rms, best.i_peak, best.p_cu
            if progress is not None:
                progress(done / len(speeds))
        return Envelope(speeds, *results)

    inputs = [*searched, speeds.tolist(), direction]
    return cached(Envelope, inputs, compute, algorithm=ALGORITHM)
