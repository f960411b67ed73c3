"""The flux that a phase needs ahead of its share, and from which speed on it does, as tables: see
include/srm/control/part/flux_lead.hpp."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from reluctance import _core
from reluctance.tables.known import Known

FloatArray = NDArray[np.float64]

POINTS = 9  # of srm::LeadLines, each way
CURRENTS, ANGLES = 120, 361
NO_SHARE = 1e-6  # of the torque: less is none
FASTEST = 3.0  # times the working speed: where the tables end
NEVER = 1e9  # angle per flux of a share that is never short of voltage [rad/Wb]


class Shares:
    """What a phase needs to give its share of some torques, at angles in the order of motion."""

    def __init__(self, known: Known, sharing: _core.Sharing, theta: FloatArray) -> None:
        self.known, self.theta = known, theta
        self.share = np.array([sharing.share(known.n_phases, float(angle)) for angle in theta])
        self.torques = known.tau_max * np.linspace(0, 1, POINTS)  # [N m]
        i = known.i_max * np.linspace(0, 1, CURRENTS) ** 1.5
        grid = np.broadcast_arrays(i[:, None], theta[None, :])
        at = _core.magnetics(known.magnetics, *(np.ascontiguousarray(v).ravel() for v in grid))
        psi, tau = at[:, 0].reshape(grid[0].shape), at[:, 2].reshape(grid[0].shape)
        tau = np.maximum.accumulate(tau, axis=0)
        self.psi, self.i = np.zeros((2, POINTS, len(theta)))  # [Wb], [A]
        self.limited = np.zeros(POINTS, bool)  # a share that i_max does not give
        for n in np.flatnonzero(self.share > NO_SHARE):
            wanted = self.torques * self.share[n]
            self.psi[:, n] = np.interp(wanted, tau[:, n], psi[:, n])
            self.i[:, n] = np.interp(wanted, tau[:, n], i)
            self.limited |= wanted > tau[-1, n]
        self.psi[0] = self.i[0] = 0

    def lines(self, reach: FloatArray) -> tuple[float, FloatArray, FloatArray]:
        """Where the share starts [rad], and the ends of the lowest lines above its flux, for angles
        per flux (n,) over the torques, (n, POINTS) [rad, Wb]."""
        first = max(int(np.argmax(self.share > 0)) - 1, 0)
        x, psi = np.abs(self.theta - self.theta[first])[first:], self.psi[:, first:]
        most = (psi[None] - x / np.maximum(reach, 1e-9)[:, None, None]).argmax(axis=-1)
        psi_end = np.take_along_axis(psi, most.T, axis=1).T
        return float(self.theta[first]), x[most], psi_end

    def reach(self) -> FloatArray:
        """The greatest angle per flux, over the torques (POINTS,), at which the voltage lets the
        flux follow the shares as it rises: there max(omega_e dpsi/dtheta + R i) is u_dc. None
        where i_max does not give a share, or flux would have to jump [rad/Wb]."""
        slope = np.diff(self.psi, axis=1) / np.abs(np.diff(self.theta))
        left = 1 - self.known.R * (self.i[:, 1:] + self.i[:, :-1]) / 2 / self.known.u_dc
        reach = np.where(slope > 0, left / np.maximum(slope, 1e-12), NEVER).min(axis=1)
        reach = np.where(self.limited, 0.0, np.minimum(np.maximum(reach, 0), NEVER))
        reach[0] = reach[1]  # no torque: nothing is asked
        return np.asarray(reach)


def flux_lead(known: Known, sharing: _core.Sharing, *, by_rule: bool) -> _core.FluxLead:
    """The tables for a machine, its nominal dc-link voltage and a sharing function. Angles that are
    not by rule are kept as they are when motoring: nothing is led."""
    fastest = FASTEST * known.N_r * max(known.omega_m, 1.0) / known.u_dc
    reach = fastest * np.linspace(0, 1, POINTS)
    motoring = Shares(known, sharing, np.linspace(0, np.pi, ANGLES))
    braking = Shares(known, sharing, np.linspace(np.pi, 0, ANGLES))
    shares_do = motoring.reach() if by_rule else np.full(POINTS, NEVER)
    return _core.FluxLead(
        motoring=_packed(motoring.lines(reach), shares_do),
        braking=_packed(braking.lines(reach), np.zeros(POINTS)),
        tau_max=known.tau_max,
        reach_max=float(reach[-1]),
        drop=known.R * float(max(motoring.i.max(), braking.i.max())),
    )


def _packed(lines: tuple[float, FloatArray, FloatArray], enough: FloatArray) -> _core.LeadLines:
    """The tables as the law takes them; enough: the angle per flux up to which no lead is needed
    for the mean."""
    theta_start, x_end, psi_end = lines
    return _core.LeadLines(
        theta_start=theta_start,
        psi_end=psi_end.ravel().tolist(),
        x_end=x_end.ravel().tolist(),
        reach_least=float(enough.min()),
        reach=enough.tolist(),
    )
