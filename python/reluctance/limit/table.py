"""Best profiles over a range of torques, as a controller stores them."""

from dataclasses import dataclass

import numpy as np

from reluctance.cache import cached
from reluctance.drive.operating_point import OperatingPoint
from reluctance.errors import need
from reluctance.limit.magnetics import FloatArray
from reluctance.limit.profile import profile_of
from reluctance.limit.programme import ALGORITHM, Norm, Programme, checked_inputs


@dataclass(frozen=True)
class Table:
    """Current and flux profiles over torque and angle."""

    tau_ref: FloatArray  # (n_levels,) tau_max (j/(n_levels - 1))^2 [N m]
    theta_e: FloatArray  # (n_points,) [rad]
    i: FloatArray  # (n_levels, n_points) [A]
    psi: FloatArray  # (n_levels, n_points) [Wb]
    tau_error_max: FloatArray  # (n_levels,) zero (to FEASIBLE) where no ripple is needed [N m]
    tau_error_rms: FloatArray  # (n_levels,) [N m]
    i_rms: FloatArray  # (n_levels,) [A]
    omega_m: float  # [rad/s]
    u_dc: float  # [V]


def profile_table(
    point: OperatingPoint,
    tau_max: float,
    *,
    n_levels: int = 9,
    n_points: int = 180,
    norm: Norm = "rms",
    smoothing: float = 1e-3,
) -> Table:
    """Best profiles for n_levels torques from 0 to tau_max; parameters as for `best_profile`.

    The levels are equidistant in the square root of the torque: at low current torque grows as
    i^2, so that the current between two levels is then close to linear.

    Two defaults suit a table: the small smoothing takes out the steps of the optimum between grid
    points (rms current + 0.01 % at rated torque of the paper's machine, + 0.1 % near zero torque);
    and a level that cannot be free of ripple has the least rms error, not the least greatest
    error, which is large at every angle.

    Raises
    ------
    ParameterError : a parameter out of range.
    RuntimeError : IPOPT found no optimum.
    """
    searched = checked_inputs(point, n_points, smoothing)
    need(tau_max > 0, "tau_max", tau_max, "a torque > 0 N m")
    need(n_levels >= 2, "n_levels", n_levels, "at least 2: zero and tau_max")
    need(norm in ("max", "rms"), "norm", norm, "'max' or 'rms'")

    def compute() -> Table:
        programme = Programme(point, n_points=n_points, smoothing=smoothing)
        levels = tau_max * np.linspace(0.0, 1.0, n_levels) ** 2
        profiles = [
            profile_of(programme, tau, programme.best(tau, norm)) for tau in levels.tolist()
        ]
        return Table(
            tau_ref=levels,
            theta_e=programme.theta_e,
            i=np.array([p.i for p in profiles]),
            psi=np.array([p.psi for p in profiles]),
            tau_error_max=np.array([p.tau_error_max for p in profiles]),
            tau_error_rms=np.array([p.tau_error_rms for p in profiles]),
            i_rms=np.array([p.i_rms for p in profiles]),
            omega_m=point.omega_m,
            u_dc=point.u_dc,
        )

    inputs = [*searched, tau_max, point.omega_m, n_levels, norm]
    return cached(Table, inputs, compute, algorithm=ALGORITHM)
