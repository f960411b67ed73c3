"""What neighbouring phases add to each other, as functions that CasADi can differentiate."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from reluctance.base.arrays import FloatArray
from reluctance.machine.coupling import Coupling, apart
from reluctance.machine.piecewise import parts, risen, widths

if TYPE_CHECKING:
    from reluctance.machine.maps.pairs import PairTable


def of_pairs(
    coupling: Coupling, i: Any, theta_e: FloatArray, direction: int, n_currents: int
) -> tuple[Any, Any]:
    """Flux linkage [Wb] and torque [N m] that pairs add to currents, of the same shape as these.

    Parameters
    ----------
    i : CasADi vector (n_currents n,)
        One current of all phases, or those of all, each over the angle of its own phase [A].
    theta_e : (n,)
        These angles, numbers [rad].
    direction :
        -1 where they fall from one point to the next; torque has the other sign then.

    The torque of a pair counts to its first phase.
    """
    import casadi as ca

    n = len(theta_e)
    j, stroke = np.arange(n), n // coupling.n_phases
    psi, tau = [0.0] * n_currents, [0.0] * n_currents
    for pair in coupling.pairs:
        first, second = (k if n_currents > 1 else 0 for k in (pair.first, pair.second))
        if pair.first != first:
            continue  # does what the pair of phase 0 does
        behind = direction * stroke * (pair.second - pair.first)
        phi = theta_e - apart(pair.first, pair.second, coupling.n_phases) / 2
        C, rate = (coupling.factor * matrix for matrix in pair.table.matrices(phi))
        f, f_slope = _functions(pair.table, i[first * n + j])
        g, g_slope = _functions(pair.table, i[second * n + (j - behind) % n])
        psi[first] += _joined(f_slope, C, g)
        psi[second] += _joined(f, C, g_slope)[(j + behind) % n]
        tau[first] += direction * pair.table.N_r * _joined(f, rate, g)
    return ca.vertcat(*psi), ca.vertcat(*tau)


def _joined(left: list[Any], matrix: FloatArray, right: list[Any]) -> Any:
    """sum over p, q of left_p matrix_pq right_q, at each point."""
    ranks = range(len(left))
    return sum(left[p] * sum(matrix[:, p, q] * right[q] for q in ranks) for p in ranks)


def _functions(table: PairTable, i: Any) -> tuple[list[Any], list[Any]]:
    """Every f of a table at currents (n,) [A], and its derivative."""
    x, width, f, slope = parts(i, table.i), widths(table.i), [], []
    powers = table.current_coefficients(table.i)  # knot, function, power
    for _, first, square, cubic in powers.transpose(1, 2, 0):
        f.append(risen(x, np.stack([first * width, square * width**2, cubic * width**3], axis=1)))
        rises = np.stack([2 * square * width, 3 * cubic * width**2], axis=1)
        slope.append(first[0] + risen(x, rises))
    return f, slope


def at_once(values: NDArray[Any], n_phases: int) -> NDArray[Any]:
    """Of every phase over the angle of the first, (n, n_phases), of one or all over their own."""
    n = values.shape[-1]
    own = np.broadcast_to(values, (n_phases, n))
    return np.stack([np.roll(own[k], k * n // n_phases) for k in range(n_phases)], axis=-1)


def solved(L: FloatArray, flow: NDArray[np.bool_], flux: FloatArray) -> FloatArray:
    """L^-1 flux over the phases that flow, zero for the others: by how much currents rise with flux
    linkages, or the torque per flux linkage of the torque per current.

    Parameters
    ----------
    L : (n, n_phases, n_phases) incremental inductances [H]
    flow : (n, n_phases)
    flux : (n, n_phases) [Wb]
    """
    free = flow[:, :, None] & flow[:, None, :]
    unknown = np.where(flow, flux, 0.0)[..., None]
    return np.asarray(np.linalg.solve(np.where(free, L, np.eye(L.shape[-1])), unknown)[..., 0])
