"""The best periodic phase current of any controller at one operating point."""

from dataclasses import dataclass, replace

import numpy as np

from reluctance.base.arrays import FloatArray
from reluctance.base.cache import cached
from reluctance.base.errors import need
from reluctance.machine.operating_point import OperatingPoint
from reluctance.machine.optimum.programme import ALGORITHM, Norm, Programme, checked_inputs


@dataclass(frozen=True)
class Profile:
    """One periodic phase current and what it does. Phase k lags phase 0 by 2 pi k/n_phases.

    Where phases couple and not all have neighbours of the same kinds, i, psi and u are
    (n_phases, n): of each phase, over its own angle.
    """

    theta_e: FloatArray  # (n,) electrical angle [rad], 0 unaligned
    i: FloatArray  # (n,) phase current [A]
    psi: FloatArray  # (n,) flux linkage [Wb]
    u: FloatArray  # (n,) mean voltage from point j to point j + 1 [V]
    tau_error_max: float  # greatest |torque - tau_ref| on the grid [N m]
    tau_error_rms: float  # [N m]
    i_rms: float  # [A]
    i_peak: float  # [A]
    p_cu: float  # copper loss of all phases [W]
    tau_ref: float  # [N m]
    omega_m: float  # [rad/s]
    u_dc: float  # [V]


def best_profile(
    point: OperatingPoint,
    tau_ref: float,
    *,
    n_points: int = 180,
    norm: Norm = "max",
    smoothing: float = 0.0,
) -> Profile:
    """Phase current with least copper for zero torque ripple; with least ripple where it must be.

    Parameters
    ----------
    point : machine, voltage and speed; 0 is standstill.
    tau_ref : torque to hold [N m]; of either sign.
    n_points : grid points of one electrical period; a multiple of n_phases.
    norm : which torque error is least where zero is impossible: its "max" or its "rms".
    smoothing : weight of mean((di/dtheta_e)^2) besides mean(i^2) [rad^2].

    Raises
    ------
    ParameterError : a parameter out of range.
    Unsolved : IPOPT found no optimum.
    """
    searched = checked_inputs(point, n_points, smoothing)
    need(np.isfinite(tau_ref), "tau_ref", tau_ref, "a finite torque [N m]")
    need(norm in ("max", "rms"), "norm", norm, "'max' or 'rms'")

    def compute() -> Profile:
        if tau_ref < 0:  # the positive torque of the machine turned round
            turned = replace(point, omega_m=-point.omega_m)
            programme = Programme(turned, n_points=n_points, smoothing=smoothing, direction=-1)
            return _turned(profile_of(programme, -tau_ref, programme.best(-tau_ref, norm)))
        programme = Programme(point, n_points=n_points, smoothing=smoothing)
        return profile_of(programme, tau_ref, programme.best(tau_ref, norm))

    inputs = [*searched, tau_ref, point.omega_m, norm]
    return cached(Profile, inputs, compute, algorithm=ALGORITHM)


def profile_of(programme: Programme, tau_ref: float, i: FloatArray) -> Profile:
    """A current (n,), or those of all phases, with all that it does."""
    psi, u, tau = programme.waveforms(i)
    i, psi, u = (_of_phases(programme, values) for values in (i, psi, u))
    error = tau - tau_ref
    i_rms = float(np.sqrt(np.mean(i * i)))
    return Profile(
        theta_e=programme.theta_e,
        i=i,
        psi=psi,
        u=u,
        tau_error_max=float(np.abs(error).max()),
        tau_error_rms=float(np.sqrt(np.mean(error * error))),
        i_rms=i_rms,
        i_peak=float(i.max()),
        p_cu=programme.point.n_phases * programme.point.R * i_rms**2,
        tau_ref=tau_ref,
        omega_m=programme.point.omega_m,
        u_dc=programme.point.u_dc,
    )


def _of_phases(programme: Programme, values: FloatArray) -> FloatArray:
    n_currents = programme.n_currents
    return values if n_currents == 1 else values.reshape(n_currents, -1)


def _turned(profile: Profile) -> Profile:
    """The same currents at -theta_e: torque and speed of the other sign, the same voltages."""
    j = np.arange(len(profile.theta_e))
    return replace(
        profile,
        i=profile.i[..., -j],
        psi=profile.psi[..., -j],
        u=profile.u[..., -j - 1],  # the interval after -theta_e is the one before theta_e
        tau_ref=-profile.tau_ref,
        omega_m=-profile.omega_m,
    )
