"""The least torque ripple that switching leaves: what remains when the legs have three levels.

The best profile asks every phase for a mean voltage u*; a leg gives u_dc, 0 or -u_dc. On the
interval between two switching edges the legs hold a vector v of levels, and torque departs from
the profile's with the slope

    s_v = sum_k g_k (v_k u_dc - u*_k),    g_k = dtau_k/dpsi_k at fixed angle.

An interval of length h and slope s leaves at least s^2 h^3/12 in the integral of error^2. From this
docs/limit.md derives, with E and O the sums of p_v |s_v|^(2/3) over the vectors with an even and an
odd number of phases at zero voltage, and M edges per second of all legs together,

    mean(error^2) >= mean((E^3 + O^3)^(1/3))^3 / (3 M^2)          (lower bound)

with the time shares p_v >= 0 chosen at every angle for the least value under sum_v p_v = 1 and
sum_v p_v s_v = 0 (the torque stays), or sum_v p_v v_k u_dc = u*_k (every flux stays on the profile
in the mean over a few pulses, which implies the former): a small convex problem. The other figure
is what independent pulse-width modulation of the phases leaves when the pulse frequency follows the
angle in the best way:

    rms = sqrt(n_phases) mean(a^(2/3))^(3/2) / (2 F),    a = |g| u_dc d (1 - d)/sqrt(12).
"""

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reluctance import _core
from reluctance.base.arrays import FloatArray
from reluctance.base.errors import ParameterError, Unsolved
from reluctance.machine.operating_point import OperatingPoint
from reluctance.machine.optimum.coupled import at_once, solved
from reluctance.machine.optimum.profile import Profile
from reluctance.machine.optimum.returning_flux import returning_mean
from reluctance.machine.optimum.switching_programme import weights

AT_REST = 1e-3  # of the peak current: below it a phase is idle, its diodes block [1]


@dataclass(frozen=True)
class RippleFloor:
    """Torque error at a mean switching frequency, beside the profile's own. See the module."""

    switching_frequency: float  # F, turn-ons per second of one switch, mean over all [Hz]
    bound_rms: float  # less is impossible near the profile, however the fluxes wander [N m]
    bound_pp: float  # peak to peak, likewise [N m]
    returning_rms: float  # less is impossible with fluxes that return after a stroke [N m]
    on_profile_rms: float  # less is impossible with every flux on the profile in the mean [N m]
    pulse_width_rms: float  # independent pulse-width modulation, best pulse frequencies [N m]
    profile_rms: float  # error of the profile itself, zero where no ripple is needed [N m]


def ripple_floor(
    point: OperatingPoint, profile: Profile, *, switching_frequency: float
) -> RippleFloor:
    """Least torque error of three-level legs around a profile.

    Parameters
    ----------
    point : where the profile belongs.
    profile : smooth, as from `best_profile(..., smoothing=1e-3)`: its voltages are differences.
    switching_frequency : turn-ons per second of one switch, mean over all 2 n_phases [Hz].

    Raises
    ------
    ParameterError : the frequency is not positive, or the phases are not the profile's.
    """
    F, n, n_phases = switching_frequency, len(profile.theta_e), point.n_phases
    if not F > 0:
        raise ParameterError(f"switching_frequency = {F} Hz, need > 0")
    if n % n_phases:
        raise ParameterError(f"n_phases = {n_phases}, need a divisor of the {n} profile points")
    u, gain, flows = _local(point, profile)
    d = np.minimum(np.abs(u) / profile.u_dc, 1.0)
    a = np.abs(gain) * profile.u_dc * d * (1 - d) / np.sqrt(12)
    strokes = (v.reshape(n_phases, -1).T for v in (u, gain, flows))
    least = np.array(
        [_least(u_k[on], g_k[on], profile.u_dc) for u_k, g_k, on in zip(*strokes, strict=True)]
    )
    free, peak, held = least.mean(axis=0)
    returning = returning_mean(u, gain, flows, n_phases=n_phases, u_dc=profile.u_dc)
    M = 4 * n_phases * F  # a turn-on and a turn-off of each of the 2 n_phases switches
    return RippleFloor(
        switching_frequency=F,
        bound_rms=float(np.sqrt(free**3 / 3) / M),
        bound_pp=float(2 * peak / M),
        returning_rms=float(np.sqrt(returning**3 / 3) / M),
        on_profile_rms=float(np.sqrt(held**3 / 3) / M),
        pulse_width_rms=float(np.sqrt(n_phases) * np.mean(a ** (2 / 3)) ** 1.5 / (2 * F)),
        profile_rms=profile.tau_error_rms,
    )


def _local(
    point: OperatingPoint, profile: Profile
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
    """Voltage [V], torque per flux [N m/Wb] and where current flows, on each interval, (n,); where
    each phase has a profile, (n_phases n,): all phases in turn, over the angle of the first."""
    i = (profile.i + np.roll(profile.i, -1, axis=-1)) / 2
    theta_e = profile.theta_e + profile.theta_e[1] / 2
    flows = i > AT_REST * profile.i_peak
    u = np.where(flows, profile.u, 0.0)
    at = _core.magnetics(point.magnetics, i.ravel(), np.tile(theta_e, i.size // len(theta_e)))
    L, tau_i = (at[:, column].reshape(i.shape) for column in (3, 4))
    if point.coupling is None:
        return u, np.where(flows, tau_i / L, 0.0), flows
    n_phases = point.n_phases
    i, tau_i = at_once(i, n_phases), at_once(tau_i, n_phases)
    u_all, flow = at_once(u, n_phases), at_once(flows, n_phases)
    tau_pairs = point.coupling.tau_i(i, theta_e)
    L_all = point.coupling.inductance(point.magnetics, i, theta_e)
    gain = solved(L_all, flow, tau_i + tau_pairs)
    if profile.i.ndim == 1:
        return u, gain[:, 0], flows
    return u_all.T.ravel(), gain.T.ravel(), flow.T.ravel()


def _least(u: FloatArray, gain: FloatArray, u_dc: float) -> list[float]:
    """Least (E^3 + O^3)^(1/3) and max(E_1, O_1) with the torque held, the first with fluxes held.

    E_1 and O_1 are E and O with |s_v|. The 3-norm of (E, O) is the greatest of the sums
    w_E E + w_O O with weights of 3/2-norm 1, and for given weights the least sum is a linear
    programme: any set of weights gives a lower bound.
    """
    if not gain.any():
        return [0.0, 0.0, 0.0]
    mean = np.clip(u / u_dc, -1.0, 1.0)
    vectors = np.array(list(product((-1.0, 0.0, 1.0), repeat=len(mean))))
    slope = (vectors - mean) @ gain * u_dc
    even = (vectors == 0).sum(axis=1) % 2 == 0
    one = np.ones(len(vectors))
    torque_held = np.vstack([slope / u_dc, one]), np.array([0.0, 1.0])
    fluxes_held = np.vstack([vectors.T, one]), np.append(mean, 1.0)
    pairs = weights()

    def norm(shares: FloatArray, held: FloatArray) -> float:
        cost = np.abs(slope) ** (2 / 3)
        return max(
            _minimum(np.where(even, w_E, w_O) * cost, A_eq=shares, b_eq=held)
            for w_E, w_O in zip(pairs, pairs[::-1], strict=True)
        )

    shares, held = torque_held
    greater = _minimum(  # unknowns p and t: minimise t with E_1 <= t and O_1 <= t
        np.append(np.zeros(len(vectors)), 1.0),
        A_ub=np.column_stack([np.where([even, ~even], np.abs(slope), 0.0), [-1.0, -1.0]]),
        b_ub=[0.0, 0.0],
        A_eq=np.column_stack([shares, np.zeros(2)]),
        b_eq=held,
    )
    return [norm(*torque_held), greater, norm(*fluxes_held)]


def _minimum(cost: FloatArray, **constraints: Any) -> float:
    """The least value of a linear programme over variables >= 0."""
    from scipy.optimize import linprog  # here: it is slow to import

    solution = linprog(cost, **constraints)
    if not solution.success:
        raise Unsolved(f"no least ripple found: {solution.message}")
    return float(solution.fun)
