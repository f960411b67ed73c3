"""The least torque ripple of legs whose flux linkages return to the profile's after a commutation.

The lower bound of ripple.py holds the torque at every angle, and lets flux linkages drift away from
the profile where two phases share the torque. Where one phase makes all of it, the torque is the
flux linkage; so the volt-seconds that a phase gains against the profile add up to nothing over each
commutation. And a phase that the profile drives at full voltage is driven so. One linear programme
over all angles of a stroke:

    minimise    sum_j b_j
    subject to  w_E E_j + w_O O_j <= b_j              for every pair of weights, every angle j
                sum_v p_jv = 1,   sum_v p_jv s_jv = 0
                sum_j (sum_v p_jv v_k u_dc - u*_jk) = 0    as a phase comes in, and as it goes out

with the notation of ripple.py. It is a lower bound near the profile as well, and a higher one.
"""

from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reluctance.limit.magnetics import FloatArray

FULL = 0.98  # of the dc link: a phase with more is driven as the profile drives it [1]


def returning_mean(
    u: FloatArray,
    gain: FloatArray,
    flows: NDArray[np.bool_],
    *,
    n_phases: int,
    u_dc: float,
    weights: FloatArray,
) -> float:
    """Mean of b over the angles.

    Parameters
    ----------
    u, gain, flows : (n,) over the period of a phase: mean voltage [V], torque per flux linkage
        [N m/Wb], and where current flows.
    weights : of 3/2-norm 1 with their reverse.
    """
    shared = np.tile(flows.reshape(n_phases, -1).sum(axis=0) > 1, n_phases) & flows
    run = _runs(shared).reshape(n_phases, -1).T  # (n_angles of a stroke, n_phases), as the others
    u, gain = u.reshape(n_phases, -1).T, gain.reshape(n_phases, -1).T
    flows = flows.reshape(n_phases, -1).T
    n = len(u)
    upper: list[tuple[int, int, float]] = []  # row, column, value
    equal: list[tuple[int, int, float]] = []
    held = [0.0] * int(run.max() + 1)  # the first rows: volt-seconds of each run
    rows, columns = 0, n  # b first
    for j in range(n):
        on = flows[j]
        mean, g = np.clip(u[j, on] / u_dc, -1.0, 1.0), gain[j, on]
        vectors = np.array(list(product((-1.0, 0.0, 1.0), repeat=int(on.sum()))))
        slope = (vectors - mean) @ g * u_dc
        cost = np.abs(slope) ** (2 / 3)
        even = (vectors == 0).sum(axis=1) % 2 == 0
        place = range(columns, columns + len(vectors))
        for w_E, w_O in zip(weights, weights[::-1], strict=True):
            upper += zip([rows] * len(vectors), place, np.where(even, w_E, w_O) * cost, strict=True)
            upper.append((rows, j, -1.0))
            rows += 1
        conditions = [(np.ones(len(vectors)), 1.0), (slope / u_dc, 0.0)]
        conditions += [(vectors[:, k], m) for k, m in enumerate(mean.tolist()) if abs(m) > FULL]
        for values, value in conditions:
            equal += zip([len(held)] * len(vectors), place, values, strict=True)
            held.append(value)
        for k, r in enumerate(run[j, on].tolist()):
            if r >= 0:
                equal += zip([r] * len(vectors), place, vectors[:, k] - mean[k], strict=True)
        columns += len(vectors)
    from scipy.optimize import linprog  # here, because it is slow to import

    solution = linprog(
        np.append(np.ones(n), np.zeros(columns - n)),
        A_ub=_sparse(upper, rows, columns),
        b_ub=np.zeros(rows),
        A_eq=_sparse(equal, len(held), columns),
        b_eq=held,
    )
    if not solution.success:
        raise RuntimeError(f"no least ripple found: {solution.message}")
    return float(solution.fun) / n


def _runs(shared: NDArray[np.bool_]) -> NDArray[np.int_]:
    """Number of the run of true values around the circle that each belongs to; -1 for false."""
    if shared.all():
        return np.zeros(len(shared), int)
    first = int(np.argmin(shared))  # start where no run is cut
    rolled = np.roll(shared, -first)
    number = np.cumsum(rolled & ~np.roll(rolled, 1)) - 1
    return np.roll(np.where(rolled, number, -1), first)


def _sparse(entries: list[tuple[int, int, float]], rows: int, columns: int) -> Any:

    from scipy.sparse import coo_array

    row, column, value = zip(*entries, strict=True)
    return coo_array((value, (row, column)), shape=(rows, columns))
