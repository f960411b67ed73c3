"""Fit analytic machines to a flux table: Le-Huy's, and a family with two saturation terms."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from reluctance.base.errors import ParameterError
from reluctance.machine.maps.table import Array, FluxTable, fold

# Part of the aligned flux that saturation takes at the last current: below it, many pairs of A and
# B fit equally well. The library's machines lose 0.69 and more; a fit to its linear one, 2e-5.
LEAST_SATURATION = 0.04
SATURATED = 0.01  # of the flux that saturates: what it lacks where a curve is on its last line
SHAPE_MAX = 6.0  # of |p|, |q|: a term without flux of its own must not take a wild shape


@dataclass(frozen=True)
class LeHuyFit:
    """Le-Huy parameters of a table, named as in a machine file, and the residual flux.

    Attributes
    ----------
    L_u_H, L_a_H, L_sat_H : float
        Unaligned, aligned and saturated inductance.
    i_m_A, psi_m_Wb : float
        A point of the line that the aligned curve ends in: at the last current of the table, or
        where the curve has come to it within SATURATED.
    psi_error_rms, psi_error_max : float
        Of the largest flux [1].
    """

    N_r: int
    L_u_H: float
    L_a_H: float
    L_sat_H: float
    i_m_A: float
    psi_m_Wb: float
    psi_error_rms: float
    psi_error_max: float


@dataclass(frozen=True)
class TwoTermFit:
    """psi = L_u i + L_0 i f_0 + A_1 (1 - e^(-B_1 i)) f_1 + A_2 (1 - e^(-B_2 i)) f_2.

    Each shape is even about unaligned and aligned,

        f(x) = x^2 (3 - 2 x) + (p + q x) x^2 (1 - x)^2,    x = theta_e/pi,

    so that the torque curve may lean and move with the current, as in real machines; Le-Huy's is
    the case A_2 = p = q = 0.

    Attributes
    ----------
    L_u_H, L_0_H : float
        Unaligned inductance, and the slope that alignment adds once saturated.
    A_Wb, B_per_A : tuple of float
        The two saturating fluxes and their rates.
    shapes : tuple of (p, q)
        Of f_0, f_1, f_2.
    psi_error_rms, psi_error_max : float
        Of the largest flux [1].
    """

    N_r: int
    L_u_H: float
    L_0_H: float
    A_Wb: tuple[float, float]
    B_per_A: tuple[float, float]
    shapes: tuple[tuple[float, float], tuple[float, float], tuple[float, float]]
    psi_error_rms: float
    psi_error_max: float

    def table(self, i: Array, theta_e: Array) -> FluxTable:
        """Flux and torque of the fit on a grid, for `surface`; i from 0, theta_e from 0 to pi."""
        x = np.minimum(theta_e, 2 * np.pi - theta_e) / np.pi
        sign = np.where(theta_e > np.pi, -1.0, 1.0) * self.N_r / np.pi
        psi = np.outer(i, np.full(len(x), self.L_u_H))
        tau = np.zeros_like(psi)
        terms = zip(self._currents(i), self.shapes, strict=True)
        for (flux, energy), (p, q) in terms:
            psi = psi + np.outer(flux, _shape(x, p, q))
            tau = tau + np.outer(energy, sign * _slope(x, p, q))
        return FluxTable(self.N_r, i, theta_e, psi, tau)

    def _currents(self, i: Array) -> list[tuple[Array, Array]]:
        """Flux and co-energy of each term against current, before its shape."""
        terms = [(self.L_0_H * i, self.L_0_H * i**2 / 2)]
        for A, B in zip(self.A_Wb, self.B_per_A, strict=True):
            rise = -np.expm1(-B * i)
            terms.append((A * rise, A * (i - rise / B)))
        return terms


def fit_lehuy(table: FluxTable) -> LeHuyFit:
    """Least-squares Le-Huy parameters of a table (H. Le-Huy, P. Brunelle, IECON 2005).

    Raises
    ------
    ParameterError
        If the table shows no saturation: A and B are then not determined.
    """
    half = fold(table)
    x = half.theta_e / np.pi
    f = _shape(x, 0.0, 0.0)
    scale, start = _start(half)

    def flux(v: Array) -> Array:
        L_u, L_sat, A, B = v * scale
        i = half.i
        return np.outer(L_u * i, 1 - f) + np.outer(L_sat * i - A * np.expm1(-B * i), f)

    v, error = _solved(flux, half.psi, start)
    L_u, L_sat, A, B = (float(value) for value in v * scale)
    L_a, i_m = L_sat + A * B, float(half.i[-1])
    lost = A * (B * i_m + np.expm1(-B * i_m)) / (L_a * i_m)
    if lost < LEAST_SATURATION:
        raise ParameterError(
            f"the table shows no saturation up to {i_m:g} A; sample it at larger currents"
        )
    i_m = max(i_m, float(-np.log(SATURATED) / B))
    return LeHuyFit(table.N_r, L_u, L_a, L_sat, i_m, L_sat * i_m + A, *_sizes(error))


def fit_two_term(table: FluxTable) -> TwoTermFit:
    """Least-squares fit of the two-term family, started from the Le-Huy fit."""
    half = fold(table)
    x, i = half.theta_e / np.pi, half.i
    scale, start = _start(half)
    simple = fit_lehuy(half)
    A = simple.psi_m_Wb - simple.L_sat_H * simple.i_m_A
    B = (simple.L_a_H - simple.L_sat_H) / A
    first = np.array([simple.L_u_H, max(simple.L_sat_H, 1e-3 * simple.L_a_H), A, B]) / scale
    start = np.concatenate(
        [first[:2], [0.7 * first[2], 0.3 * first[2]], [1.3 * first[3], 0.3 * first[3]]]
    )
    start = np.append(start, np.zeros(6))

    def flux(v: Array) -> Array:
        L_u, L_sat = v[:2] * scale[:2]
        A, B = v[2:4] * scale[2], v[4:6] * scale[3]
        shapes = v[6:].reshape(3, 2)
        psi = np.outer(L_u * i, np.ones_like(x))
        psi = psi + np.outer((L_sat - L_u) * i, _shape(x, *shapes[0]))
        for n in range(2):
            psi = psi + np.outer(-A[n] * np.expm1(-B[n] * i), _shape(x, *shapes[n + 1]))
        return psi

    v, error = _solved(flux, half.psi, start, n_positive=6)
    L_u, L_sat = (float(value) for value in v[:2] * scale[:2])
    p = [(float(a), float(b)) for a, b in v[6:].reshape(3, 2)]
    return TwoTermFit(
        table.N_r,
        L_u,
        L_sat - L_u,
        (float(v[2] * scale[2]), float(v[3] * scale[2])),
        (float(v[4] * scale[3]), float(v[5] * scale[3])),
        (p[0], p[1], p[2]),
        *_sizes(error),
    )


def _shape(x: Array, p: float, q: float) -> Array:
    return x**2 * (3 - 2 * x) + (p + q * x) * x**2 * (1 - x) ** 2


def _slope(x: Array, p: float, q: float) -> Array:
    """df/dx."""
    bump = x**2 * (1 - x) ** 2
    return 6 * x * (1 - x) + q * bump + (p + q * x) * 2 * x * (1 - x) * (1 - 2 * x)


def _start(half: FluxTable) -> tuple[Array, Array]:
    """Units and first guess of L_u, L_sat, A, B, from the ends of the two curves."""
    i, aligned = half.i, half.psi[:, -1]
    L_a = float(aligned[1] / i[1])
    L_sat = max(float((aligned[-1] - aligned[-2]) / (i[-1] - i[-2])), 1e-3 * L_a)
    A = max(float(aligned[-1] - L_sat * i[-1]), 0.1 * float(aligned[-1]))
    scale = np.array([L_a, L_a, A, L_a / A])
    return scale, np.array([half.psi[-1, 0] / i[-1] / L_a, L_sat / L_a, 1.0, 1.0])


def _solved(
    flux: Callable[[Array], Array], psi: Array, start: Array, n_positive: int = 4
) -> tuple[Array, Array]:
    largest = float(np.abs(psi).max())
    low = np.full(len(start), -np.inf)
    low[:n_positive] = 1e-9
    low[n_positive:] = -SHAPE_MAX
    high = np.where(np.arange(len(start)) < n_positive, np.inf, SHAPE_MAX)
    found = least_squares(
        lambda v: ((flux(v) - psi) / largest).ravel(),
        np.maximum(start, low + 1e-9),
        bounds=(low, high),
        x_scale="jac",
    )
    return found.x, (flux(found.x) - psi) / largest


def _sizes(error: Array) -> tuple[float, float]:
    return float(np.sqrt(np.mean(error**2))), float(np.abs(error).max())
