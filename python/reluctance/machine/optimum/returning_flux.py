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

import numpy as np
from numpy.typing import NDArray

from reluctance.base.arrays import FloatArray
from reluctance.machine.optimum.switching_programme import SwitchingProgramme


def returning_mean(
    u: FloatArray, gain: FloatArray, flows: NDArray[np.bool_], *, n_phases: int, u_dc: float
) -> float:
    """Mean of b over the angles; arguments as of SwitchingProgramme."""
    programme = SwitchingProgramme(u, gain, flows, n_phases=n_phases, u_dc=u_dc)
    shared = np.tile(flows.reshape(n_phases, -1).sum(axis=0) > 1, n_phases) & flows
    run = _runs(shared).reshape(n_phases, -1).T  # (n_angles of a stroke, n_phases), as the others
    returned: list[list[tuple[int, float]]] = [[] for _ in range(int(run.max() + 1))]
    for j, angle in enumerate(programme.angles):
        programme.require(zip(angle.shares, angle.slope / u_dc, strict=True), 0.0)
        for k, r in enumerate(run[j, angle.on].tolist()):
            if r >= 0:
                off = angle.vectors[:, k] - angle.mean[k]
                returned[r] += zip(angle.shares, off, strict=True)
    for volt_seconds in returned:
        programme.require(volt_seconds, 0.0)
    n = len(programme.angles)
    return float(programme.solve()[:n].mean())


def _runs(shared: NDArray[np.bool_]) -> NDArray[np.int_]:
    """Number of the run of true values around the circle that each belongs to; -1 for false."""
    if shared.all():
        return np.zeros(len(shared), int)
    first = int(np.argmin(shared))  # start where no run is cut
    rolled = np.roll(shared, -first)
    number = np.cumsum(rolled & ~np.roll(rolled, 1)) - 1
    return np.roll(np.where(rolled, number, -1), first)
