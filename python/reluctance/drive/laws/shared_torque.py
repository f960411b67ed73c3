"""Torque sharing functions: their keys in a [control] table, and angles by rule."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from reluctance import _core
from reluctance.base.arrays import FloatArray
from reluctance.base.errors import ParameterError
from reluctance.base.units import ask_about_radians
from reluctance.drive.laws.hand_over import ALWAYS, TORQUES, HandsOver
from reluctance.drive.tables.known import Known

TABLE_POINTS = 33  # of srm::Sharing
NO_SHARE = 1e-3  # of the torque: less, or as much short of all of it, is no sharing
# Default overlap, as part of the angle beside a stroke in which torque is positive. The rest is
# left free at both ends, where torque is dear. On the source paper's machine at its rated point
# 1/2, 2/3 and 1 give torque errors of 1.8, 1.3 and 1.0 % rms (cubic, at 49.4, 49.1 and 49.3 A
# rms) and 2.1, 1.4 and 2.6 % (linear).
OVERLAP_PART = 2 / 3
CURRENTS, ANGLES = 120, 361  # of the flux of a share
NO_FLUX = 1e-6  # of the torque: a smaller share is none
ROUNDS = 12  # of shares and pairs, each halfway
LOST = 0.005  # of the mean torque: what feedback would leave alone (mean_torque_feedback.hpp)
FILLS = np.geomspace(0.01, 3, 120)  # tried: what the rise of the flux takes of half a period


def sharing_angles(n_phases: int, x: float, y: float) -> dict[str, float]:
    """Turn-on in the first half of the angle that two phases can share, overlap in the rest."""
    free = 180 - 360 / n_phases
    on = free / 2 * x
    return {
        "theta_on_deg": round(on, 2),
        "theta_ov_deg": round((free - on) * (0.1 + 0.9 * y) - 0.01, 2),
    }


class SharedTorque(HandsOver):
    """The part of the torque that each phase gives at an angle."""

    knows_pairs: ClassVar[bool] = True
    sharing: Literal["linear", "cubic", "sinusoidal", "exponential", "optimal", "table"] = "cubic"
    theta_on_deg: float | None = None  # electrical; by default OVERLAP_PART, centred on 90 deg
    theta_ov_deg: float | None = None  # overlap
    share_table: list[float] = Field(default_factory=list)  # the rise, with sharing = "table"

    @model_validator(mode="after")
    def angles_come_in_pairs(self) -> SharedTorque:
        if (self.theta_on_deg is None) != (self.theta_ov_deg is None):
            raise ValueError("needs both theta_on_deg and theta_ov_deg, or neither")
        if self.sharing == "optimal" and self.theta_on_deg is not None:
            raise ValueError("sharing = 'optimal' finds its angles itself; remove theta_on_deg")
        if self.theta_on_deg is not None and self.theta_ov_deg is not None:
            ask_about_radians(theta_on_deg=self.theta_on_deg, theta_ov_deg=self.theta_ov_deg)
        return self

    @model_validator(mode="after")
    def table_is_a_rise(self) -> SharedTorque:
        table = self.share_table
        if self.sharing != "table":
            if table:
                raise ValueError("share_table has no effect without sharing = 'table'; remove it")
            return self
        if len(table) != TABLE_POINTS or table[0] != 0 or table[-1] != 1:
            raise ValueError(f"share_table: need {TABLE_POINTS} shares, the first 0, the last 1")
        if not 0 <= min(table) <= max(table) <= 1:
            raise ValueError(
                f"share_table: {min(table):g} to {max(table):g}, need shares from 0 to 1 of the "
                "torque"
            )
        return self

    def check(self, known: Known) -> None:
        super().check(known)
        free = 180 - 360 / known.n_phases
        if free <= 0:
            raise ParameterError(
                "[control] law shares torque between phases, but with n_phases = "
                f"{known.n_phases} no angle has two that can give it; use another law"
            )
        if self.theta_on_deg is None or self.theta_ov_deg is None:
            return
        if not self._sharing(self.theta_on_deg, self.theta_ov_deg).is_feasible(known.n_phases):
            raise ParameterError(
                f"[control] theta_on_deg = {self.theta_on_deg:g}, theta_ov_deg = "
                f"{self.theta_ov_deg:g}: need theta_on_deg >= 0, theta_ov_deg > 0 and together at "
                f"most {free:g}, so that every phase with a share can give torque"
            )

    def shares(self, known: Known) -> _core.Sharing:
        """The sharing function, with angles by rule where the table gives none."""
        if self.sharing == "optimal":
            return _optimal(known)
        return self._sharing(*self.angles(known))

    def used(self, known: Known) -> dict[str, float]:
        if self.sharing == "optimal":
            return super().used(known)
        on, ov = self.angles(known)
        return super().used(known) | {"theta_on_deg": on, "theta_ov_deg": ov}

    def angles(self, known: Known) -> tuple[float, float]:
        """Turn-on angle and overlap [deg]; by rule the usual overlap, or all of the free angle
        where the current limit needs it."""
        if self.theta_on_deg is not None and self.theta_ov_deg is not None:
            return self.theta_on_deg, self.theta_ov_deg
        free = 180 - 360 / known.n_phases
        ends = [((1 - part) / 2 * free, part * free) for part in (OVERLAP_PART, 1.0)]
        return min(ends, key=lambda angles: max(_load(known, self._sharing(*angles)), 1.0))

    def own(self, known: Known) -> tuple[str, str]:
        return f"sharing = {self.sharing!r}", f"i_max_A = {known.i_max:g} does not suffice for it"

    def boundary(self, known: Known) -> tuple[FloatArray, FloatArray]:
        """That of the shares. Angles that are not by rule are kept when motoring."""
        sharing = self.shares(known)
        braking = feasible_shares(known, sharing, np.linspace(np.pi, 0, ANGLES))
        if self.theta_on_deg is not None:
            return np.full(TORQUES, ALWAYS), braking
        return feasible_shares(known, sharing, np.linspace(0, np.pi, ANGLES)), braking

    def _sharing(self, on_deg: float, ov_deg: float) -> _core.Sharing:
        return _core.Sharing(
            shape=getattr(_core.Shape, self.sharing),
            theta_on=np.radians(on_deg),
            theta_ov=np.radians(ov_deg),
            table=self.share_table or [0.0] * TABLE_POINTS,
        )


def _load(known: Known, sharing: _core.Sharing) -> float:
    """The greatest share of the greatest torque, over what a phase gives at i_max [1]. Over
    the stroke centred on 90 deg: further out the other phases can help."""
    part = np.pi / known.n_phases
    theta = np.linspace(np.pi / 2 - part, np.pi / 2 + part, 121)
    share = np.array([sharing.share(known.n_phases, float(angle)) for angle in theta])
    most = _core.magnetics(known.magnetics, np.full_like(theta, known.i_max), theta)[:, 2]
    return float(np.max(share * known.tau_max / most))


def feasible_shares(known: Known, sharing: _core.Sharing, theta: FloatArray) -> FloatArray:
    """The greatest omega_e/u_dc at which the voltage lets phases follow their shares, for torques
    0..tau_max, (TORQUES,) [rad/Wb]; none where i_max does not give a share.

    Flux rises by at most (u_dc - R i)/omega_e in a radian. Where that is less than the shares ask
    for it lags behind them until they rise less, and the torque that is lost on the way may be
    LOST of the mean.

    Parameters
    ----------
    theta : array, shape (n_angles,)
        Angles in the order of motion [rad].
    """
    share = _share(known, sharing, theta)
    torques = known.tau_max * np.linspace(0, 1, TORQUES)[1:, None]
    wanted = _of_phases(known, sharing, torques, theta) * share
    i = known.i_max * np.linspace(0, 1, CURRENTS) ** 1.5
    grid = np.broadcast_arrays(i[:, None], theta[None, :])
    at = _core.magnetics(known.magnetics, *(np.ascontiguousarray(v).ravel() for v in grid))
    psi, tau = at[:, 0].reshape(grid[0].shape), at[:, 2].reshape(grid[0].shape)
    tau = np.maximum.accumulate(np.maximum(tau, 0.0), axis=0)
    psi_ref, i_ref = np.zeros((2, *wanted.shape))
    for n in np.flatnonzero(share > NO_FLUX):
        psi_ref[:, n] = np.interp(wanted[:, n], tau[:, n], psi[:, n])
        i_ref[:, n] = np.interp(wanted[:, n], tau[:, n], i)
    left = 1 - known.R * (i_ref[:, 1:] + i_ref[:, :-1]) / 2 / known.u_dc
    way = np.cumsum(left * np.abs(np.diff(theta)), axis=1)
    rise = np.concatenate([np.zeros((len(way), 1)), way], axis=1)  # at omega_e/u_dc = 1 [Wb]
    reach = np.pi / psi_ref.max(axis=1, keepdims=True) * FILLS  # (TORQUES - 1, len(FILLS))
    line = rise[:, None, :] / reach[:, :, None]
    reached = line + np.minimum.accumulate(psi_ref[:, None, :] - line, axis=2)
    given = np.zeros(reach.shape)
    for n in np.flatnonzero(share > NO_FLUX):
        given += np.interp(reached[:, :, n], psi[:, n], tau[:, n])
    asked = np.sum(np.minimum(wanted, tau[-1]), axis=1, keepdims=True)
    lost = np.maximum.accumulate(1 - given / asked, axis=1)
    count = np.sum(lost <= LOST, axis=1)  # of the speeds that are not too high
    most = np.where(count > 0, reach[np.arange(len(reach)), count - 1], 0.0)
    most = np.where((wanted > tau[-1]).any(axis=1), 0.0, most)
    return np.append(most[0], most)  # no torque: nothing is asked


def _share(known: Known, sharing: _core.Sharing, theta: FloatArray) -> FloatArray:
    at = np.mod(theta, 2 * np.pi)
    return np.array([sharing.share(known.n_phases, float(angle)) for angle in at])


def _of_phases(
    known: Known, sharing: _core.Sharing, torques: FloatArray, theta: FloatArray
) -> FloatArray:
    """What phases alone have to give for torques (n_torques, 1), at angles (n_angles,) of a phase,
    where pairs of them add to it or take from it; (n_torques, n_angles) [N m]. The currents of the
    shares, past i_max where these ask for it, and the torque of the pairs follow from each other.
    """
    if known.pairs is None:
        return np.broadcast_to(torques, (len(torques), len(theta)))
    n_phases, n = known.n_phases, 60 * known.n_phases
    grid = 2 * np.pi * np.arange(n) / n
    share = _share(known, sharing, grid)
    i = np.linspace(0, 2 * known.i_max, CURRENTS)
    tau = _core.magnetics(known.magnetics, np.tile(i, n), np.repeat(grid, len(i)))[:, 2]
    rising = np.maximum.accumulate(np.maximum(tau.reshape(n, -1), 0.0), axis=1)
    left = np.broadcast_to(torques, (len(torques), n))
    for _ in range(ROUNDS):
        own = np.zeros(left.shape)
        for j in np.flatnonzero(share > NO_FLUX):
            own[:, j] = np.interp(left[:, j] * share[j], rising[j], i)
        of_all = [np.roll(own, k * n // n_phases, axis=1) for k in range(n_phases)]
        tau_pairs = known.pairs.tau(np.stack(of_all, axis=-1), grid)
        left = (left + np.maximum(torques - tau_pairs, 0.0)) / 2
    return np.array([np.interp(theta, grid, row, period=2 * np.pi) for row in left])


def _optimal(known: Known) -> _core.Sharing:
    """The share that a phase has while it takes over in the least-copper profile without ripple
    (`reluctance.machine.optimum`): optimised offline for this machine, torque, speed and dc
    voltage."""
    from reluctance.machine import optimum  # a tenth of the start-up time

    machine = known.machine
    profile = optimum.best_profile(known.at(known.omega_m), known.tau_max)
    free = np.pi - 2 * np.pi / machine.n_phases
    share = machine.tau(profile.i, profile.theta_e) / known.tau_max
    on = float(profile.theta_e[max(int(np.argmax(share > NO_SHARE)) - 1, 0)])
    whole = float(profile.theta_e[int(np.argmax(share > 1 - NO_SHARE))])
    end = min(whole if whole > on else free, free)
    rise = np.interp(np.linspace(on, end, TABLE_POINTS), profile.theta_e, share)
    rise = np.maximum.accumulate(np.clip(rise, 0.0, 1.0))
    rise[0], rise[-1] = 0.0, 1.0
    return _core.Sharing(
        shape=_core.Shape.table, theta_on=on, theta_ov=end - on, table=rise.tolist()
    )
