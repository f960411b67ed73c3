"""Best profiles over a range of torques, as a controller stores them."""

from dataclasses import dataclass

import numpy as np

from reluctance.base.arrays import FloatArray
from reluctance.base.cache import cached
from reluctance.base.errors import ParameterError, Unsolved, need
from reluctance.machine.operating_point import OperatingPoint
from reluctance.machine.optimum.profile import Profile, profile_of
from reluctance.machine.optimum.programme import (
    ALGORITHM,
    FEASIBLE,
    Norm,
    Programme,
    checked_inputs,
)


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
    ripple_weight: float | None = None,
) -> Table:
    """Best profiles for n_levels torques from 0 to tau_max; parameters as for `best_profile`.

    The levels are equidistant in the square root of the torque: at low current torque grows as
    i^2, so that the current between two levels is then close to linear.

    Two defaults suit a table: the small smoothing takes out the steps of the optimum between grid
    points (rms current + 0.01 % at rated torque of the paper's machine, + 0.1 % near zero torque);
    and a level that cannot be free of ripple has the least rms error, not the least greatest
    error, which is large at every angle.

    With a ripple_weight [1], a level whose current without ripple never ends is the weighted
    optimum of `programme.py`, which has ripple; the greater the weight, the less.

    Raises
    ------
    ParameterError : a parameter out of range.
    Unsolved : IPOPT found no optimum.
    """
    searched = checked_inputs(point, n_points, smoothing)
    need(tau_max > 0, "tau_max", tau_max, "a torque > 0 N m")
    need(n_levels >= 2, "n_levels", n_levels, "at least 2: zero and tau_max")
    need(norm in ("max", "rms"), "norm", norm, "'max' or 'rms'")
    if point.coupling is not None and not point.coupling.is_alike:
        raise ParameterError(
            "the neighbours of the phases differ, so that each phase has a profile of its own, and "
            "a table holds one for all; leave the coupling of the operating point out"
        )
    weight = 0.0 if ripple_weight is None else ripple_weight
    need(weight >= 0, "ripple_weight", ripple_weight, "a weight >= 0")

    def compute() -> Table:
        programme = Programme(point, n_points=n_points, smoothing=smoothing, ripple_weight=weight)
        levels = tau_max * np.linspace(0.0, 1.0, n_levels) ** 2
        profiles: list[Profile] = []
        ends = True  # the current without ripple
        most: FloatArray | None = None  # current of the greatest mean, once a level is beyond it
        for tau in levels.tolist():
            starts: list[FloatArray] = []
            near = None  # the optimum below, as much stronger
            if len(profiles) > 1:
                near = profiles[-1].i * (tau / profiles[-1].tau_ref) ** 0.5
            if ends:
                try:
                    starts = [programme.best(tau, norm, near=near)]
                except Unsolved:
                    if ripple_weight is None:
                        raise
                    ends = False  # there is ripple then, and the search below weighs it
            if ends:
                profile = profile_of(programme, tau, starts[0])
                if ripple_weight is not None and tau > 0:
                    free = profile.tau_error_max <= FEASIBLE * tau
                    ends = free and programme.ends(profile.i)  # if not, nor that of more torque
            if not ends:
                starts += [] if near is None else [near]
                i = programme.weighted(tau, *starts) if most is None else most
                if i is None:
                    i = most = programme.greatest_mean(tau, *starts)
                profile = profile_of(programme, tau, i)
            profiles.append(profile)
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
    if ripple_weight is not None:
        inputs.append(ripple_weight)
    return cached(Table, inputs, compute, algorithm=ALGORITHM)
