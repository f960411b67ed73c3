"""The best periodic phase current of any controller at one operating point."""

from dataclasses import astuple, dataclass, replace

import numpy as np

from reluctance.cache import cached
from reluctance.limit.magnetics import FloatArray, Machine, content
from reluctance.limit.programme import ALGORITHM, Norm, Programme, Setting, need


@dataclass(frozen=True)
class Profile:
    """One periodic phase current and what it does. Phase k lags phase 0 by 2 pi k/n_phases."""

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
    machine: Machine,
    *,
    n_phases: int,
    R: float,
    tau_ref: float,
    omega_m: float,
    u_dc: float,
    i_max: float,
    n_points: int = 180,
    norm: Norm = "max",
    smoothing: float = 0.0,
) -> Profile:
    """Phase current with least copper for zero torque ripple; with least ripple where it must be.

    Parameters
    ----------
    machine : a flux map, or the Le-Huy numbers N_r, L_u, L_sat, A, B.
    n_phases : phases, at least 2.
    R : phase resistance [ohm].
    tau_ref : torque to hold [N m]; of either sign.
    omega_m : speed [rad/s]; of either sign, 0 is standstill.
    u_dc : dc-link voltage [V].
    i_max : greatest phase current [A].
    n_points : grid points of one electrical period; a multiple of n_phases.
    norm : which torque error is least where zero is impossible: its "max" or its "rms".
    smoothing : weight of mean((di/dtheta_e)^2) beside mean(i^2) [rad^2].

    Raises
    ------
    ParameterError : a parameter out of range.
    RuntimeError : IPOPT found no optimum.
    """
    setting = Setting(
        n_phases=n_phases, R=R, u_dc=u_dc, i_max=i_max, n_points=n_points, smoothing=smoothing
    )
    need(np.isfinite(tau_ref), "tau_ref", tau_ref, "a finite torque [N m]")
    need(np.isfinite(omega_m), "omega_m", omega_m, "a finite speed [rad/s]")
    need(norm in ("max", "rms"), "norm", norm, "'max' or 'rms'")

    def compute() -> Profile:
        if tau_ref < 0:  # the positive torque of the machine turned round
            programme = Programme(machine, setting, -omega_m, direction=-1)
            return _turned(profile_of(programme, -tau_ref, programme.best(-tau_ref, norm)))
        programme = Programme(machine, setting, omega_m)
        return profile_of(programme, tau_ref, programme.best(tau_ref, norm))

    inputs = [*content(machine), *astuple(setting), tau_ref, omega_m, norm]
    return cached(Profile, inputs, compute, algorithm=ALGORITHM)


def profile_of(programme: Programme, tau_ref: float, i: FloatArray) -> Profile:
    """A current (n,) with all that it does."""
    psi, u, tau = programme.waveforms(i)
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
        p_cu=programme.setting.n_phases * programme.setting.R * i_rms**2,
        tau_ref=tau_ref,
        omega_m=programme.omega_m,
        u_dc=programme.setting.u_dc,
    )


def _turned(profile: Profile) -> Profile:
    """The same currents at -theta_e: torque and speed of the other sign, the same voltages."""
    j = np.arange(len(profile.i))
    return replace(
        profile,
        i=profile.i[-j],
        psi=profile.psi[-j],
        u=profile.u[-j - 1],  # the interval after -theta_e is the one before theta_e
        tau_ref=-profile.tau_ref,
        omega_m=-profile.omega_m,
    )
