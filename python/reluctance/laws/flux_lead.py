"""The flux that a phase needs ahead of its share, as tables: see
include/srm/control/part/flux_lead.hpp."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from reluctance import _core
from reluctance.drive.known import Known

FloatArray = NDArray[np.float64]

POINTS = 9  # of srm::LeadLines, each way
CURRENTS, ANGLES = 120, 361
NO_SHARE = 1e-6  # of the torque: less is none
FASTEST = 3.0  # times the working speed: where the tables end


def flux_lead(known: Known, sharing: _core.Sharing) -> _core.FluxLead:
    """The tables for a machine, its nominal dc-link voltage and a sharing function."""
    fastest = FASTEST * known.N_r * max(known.omega_m, 1.0)
    reach = fastest / known.u_dc * np.linspace(0, 1, POINTS)
    motoring, i_motoring = _lines(known, sharing, reach, np.linspace(0, np.pi, ANGLES))
    braking, i_braking = _lines(known, sharing, reach, np.linspace(np.pi, 0, ANGLES))
    return _core.FluxLead(
        motoring=motoring,
        braking=braking,
        tau_max=known.tau_max,
        reach_max=float(reach[-1]),
        drop=known.R * max(i_motoring, i_braking),
    )


def _lines(
    known: Known, sharing: _core.Sharing, reach: FloatArray, theta: FloatArray
) -> tuple[_core.LeadLines, float]:
    """The lowest lines above the flux of the share, and the greatest current of a share [A]; theta
    (n,) in the order of the motion."""
    share = np.array([sharing.share(known.n_phases, float(angle)) for angle in theta])
    first = max(int(np.argmax(share > 0)) - 1, 0)
    theta, share = theta[first:], share[first:]
    x = np.abs(theta - theta[0])
    i = known.i_max * np.linspace(0, 1, CURRENTS) ** 1.5
    grid = np.broadcast_arrays(i[:, None], theta[None, :])
    at = _core.magnetics(known.magnetics, *(np.ascontiguousarray(v).ravel() for v in grid))
    psi, tau = at[:, 0].reshape(grid[0].shape), at[:, 2].reshape(grid[0].shape)
    tau = np.maximum.accumulate(tau, axis=0)
    torques = known.tau_max * np.linspace(0, 1, POINTS)
    needed = np.zeros((POINTS, len(share)))
    for n in np.flatnonzero(share > NO_SHARE):
        needed[:, n] = np.interp(torques * share[n], tau[:, n], psi[:, n])
    needed[0] = 0
    above = needed[None] - x / np.maximum(reach, 1e-9)[:, None, None]
    most = above.argmax(axis=-1)
    lines = _core.LeadLines(
        theta_start=float(theta[0]),
        psi_end=np.take_along_axis(needed, most.T, axis=1).T.ravel().tolist(),
        x_end=x[most].ravel().tolist(),
    )
    having = np.flatnonzero(share > NO_SHARE)
    top = [np.interp(known.tau_max * share[n], tau[:, n], i) for n in having]
    return lines, float(np.max(top))
