"""A flux guide, and the weights that follow from it and from the wanted switching frequency.

A deviation from the guide can be made good only where the guide leaves some of the voltage. So the
weights follow the reserve, the share of the conduction in which it does: the less, the closer the
guide must be kept. docs/control/best_mpc.md has the measurements.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.machine.operating_point import OperatingPoint

if TYPE_CHECKING:
    from reluctance.machine.coupling import Coupling
    from reluctance.machine.optimum import Table

FULL_VOLTAGE = 0.98  # of the dc link: above, a leg is held
TORQUE_ERROR = 1e-3  # rms, relative: a profile with less is one without ripple [1]
CONDUCTS_MOST = 0.9  # of the period: a guide with more has hardly an end [1]
LEAST_RESERVE = 0.2  # that weights are made for; the least that was tried is 0.25
NEAR = 1.15  # of working torque and voltage: how far powers are measured
# Least current of a guide, against its greatest: below it is zero, and the phase is idle. What the
# optimiser leaves there is 1e-6 of the greatest; 1e-4 is 7 mA on the paper's machine.
NO_CURRENT = 1e-4


def packed(
    tables: Sequence[Table],
    quantity: Literal["i", "psi"],
    point: OperatingPoint,
    pairs: Coupling | None = None,
) -> _core.ReferenceProfile:
    """Current [A] or flux linkage [Wb] of tables for rising speeds, as a law takes it.

    Where phases couple it has the flux linkage of a phase alone, and apart what its neighbours add.
    The tables are those of the point, whose phases have the same neighbours. Where `pairs` differ
    from one to the next, each phase has its own profile next to them.
    """
    theta_e = tables[0].theta_e
    windings = [] if point.coupling is None else [point.coupling]
    mirrored: list[int] = []
    rows = [np.stack([table.i for table in tables])[np.newaxis]]  # all phases, speed, torque, angle
    if pairs is not None and not pairs.is_alike:
        n, m = pairs.n_phases, pairs.mirror
        windings = [pairs] if m is not None else [pairs, pairs.reversed]
        mirrored = [(m - k) % n if m is not None else n + -k % n for k in range(n)]
        rows = [_of_each(replace(point, coupling=winding), tables) for winding in windings]
    drop = resistive_drop(tables, point.R)
    if not drop < tables[0].u_dc:
        raise ParameterError(
            f"the resistance that the control knows, {point.R:.4g} ohm, drops {drop:.4g} V at the "
            f"greatest current of its profile, need less than u_dc_V = {tables[0].u_dc:g}; lower "
            "[mismatch] R_factor where it is given, else [machine] R_ohm"
        )
    least = NO_CURRENT * float(tables[0].i.max())
    rows = [np.where(i < least, 0.0, i) for i in rows]
    i, mutual = np.concatenate(rows), None
    if not windings:
        psi = np.stack([table.psi for table in tables])[np.newaxis]
        alone = np.where(i > 0, psi, 0.0)
    else:
        alone = _alone(point, i, theta_e)
        both = zip(windings, rows, strict=True)
        mutual = np.concatenate([_mutual(winding, row, theta_e) for winding, row in both])
    return _core.ReferenceProfile(
        i if quantity == "i" else alone,
        tau_max=tables[0].tau_ref[-1],
        omega_m=[abs(table.omega_m) for table in tables],
        u_dc=tables[0].u_dc,
        drop=drop,
        mutual=mutual,
        mirrored=mirrored,
    )


def resistive_drop(tables: Sequence[Table], R: float) -> float:
    """What a resistance takes at the greatest current of the profiles [V]."""
    return R * float(tables[0].i.max())


def _of_each(point: OperatingPoint, tables: Sequence[Table]) -> NDArray[np.float64]:
    """Currents next to those of the tables, (n_phases, n_speeds, n_levels, n_angles) [A]."""
    from reluctance.machine.optimum.each_phase import each_phase

    return np.stack([each_phase(point, table).i.swapaxes(0, 1) for table in tables], axis=1)


def _alone(
    point: OperatingPoint, i: NDArray[np.float64], theta_e: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Flux linkage of a phase without its neighbours [Wb]."""
    angles = np.broadcast_to(theta_e, i.shape)
    columns = _core.magnetics(point.magnetics, i.ravel(), angles.ravel())
    return np.asarray(columns[:, 0]).reshape(i.shape)


def _mutual(
    coupling: Coupling, i: NDArray[np.float64], theta_e: NDArray[np.float64]
) -> NDArray[np.float64]:
    """What the neighbours add to it [Wb]."""
    from reluctance.machine.optimum.coupled import at_once  # a tenth of the start-up time

    stroke = len(theta_e) // coupling.n_phases
    found = np.empty(i.shape)
    for speed, torque in np.ndindex(i.shape[1:3]):
        added = coupling.psi(at_once(i[:, speed, torque], coupling.n_phases), theta_e)
        for k in range(len(i)):
            found[k, speed, torque] = np.roll(added[:, k], -k * stroke)
    return found


def no_guide(tau_max: float) -> _core.ReferenceProfile:
    """Of a law that follows none; tau_max: most that its feedback may ask for [N m]."""
    return _core.ReferenceProfile(np.zeros((1, 1, 2, 3)), tau_max=tau_max, omega_m=[0.0], u_dc=1.0)


def nearest_level(table: Table, tau_ref: float) -> int:
    """The row nearest to a torque [N m], zero torque left out."""
    return 1 + int(np.argmin(np.abs(table.tau_ref[1:] - tau_ref)))


def voltage(point: OperatingPoint, table: Table, level: int) -> NDArray[np.float64]:
    """What a row takes at each angle, at the speed of the table, (n_points,) [V]."""
    psi = table.psi[level]
    slope = (np.roll(psi, -1) - np.roll(psi, 1)) * psi.size / (4 * np.pi)  # [Wb/rad]
    return np.asarray(point.R * table.i[level] + point.N_r * table.omega_m * slope)


@dataclass(frozen=True)
class FluxGuide:
    """Profiles of one or several speeds without ripple, at a working torque."""

    tables: tuple[Table, ...]  # of rising speeds
    point: OperatingPoint  # of the machine; speed and voltage are those of the tables
    tau_ref: float  # [N m]
    f_switch: float  # wanted turn-ons per switch per second [Hz]
    slack: float = 1.0  # factor on psi_slack [1]
    pairs: Coupling | None = None  # of phases, as they are

    @cached_property
    def profiles(self) -> _core.ReferenceProfile:
        """Flux linkage over torque, angle and speed."""
        return packed(self.tables, "psi", self.point, self.pairs)

    @property
    def reserve(self) -> list[float]:
        """Share of the conduction that leaves some voltage, (n_speeds,) [1]."""
        return [self._reserve(table) for table in self.tables]

    @property
    def conducts(self) -> list[float]:
        """Share of the period in which a phase has current, (n_speeds,) [1]."""
        return [float(np.mean(self._conducting(table))) for table in self.tables]

    @property
    def ripples(self) -> list[bool]:
        """Whether the profile has ripple of its own, (n_speeds,)."""
        levels = [nearest_level(table, self.tau_ref) for table in self.tables]
        return [
            bool(table.tau_error_rms[j] > TORQUE_ERROR * table.tau_ref[j])
            for table, j in zip(self.tables, levels, strict=True)
        ]

    @property
    def feedback(self) -> list[float]:
        """1 where only feedback holds the mean of a law that looks a few samples ahead, else 0,
        (n_speeds,)."""
        pairs = zip(self.ripples, self.conducts, strict=True)
        return [float(ripples or conducts > CONDUCTS_MOST) for ripples, conducts in pairs]

    @property
    def psi_slack(self) -> list[float]:
        """How far a phase may leave the guide, (n_speeds,) [Wb]: reserve^2 times the flux linkage
        of a switching period."""
        period = self.tables[0].u_dc / self.f_switch
        return [self.slack * period * reserve**2 for reserve in self.reserve]

    @property
    def w_psi(self) -> list[float]:
        """Weight of the distance to the guide, (n_speeds,) [N^2 m^2/Wb^2]: with full reserve all
        of the flux linkage counts as all of the torque."""
        levels = [nearest_level(table, self.tau_ref) for table in self.tables]
        per_flux = [t.tau_ref[j] / t.psi[j].max() for t, j in zip(self.tables, levels, strict=True)]
        return [(g / r) ** 2 for g, r in zip(per_flux, self.reserve, strict=True)]

    @property
    def w_sw(self) -> float:
        """What a turn-on may cost [N^2 m^2 s]. The lowest speed decides: above it less of a period
        is left to switch in, and at the same cost there are fewer turn-ons."""
        return self._weight(1.0, 1.0)

    @property
    def w_sw_powers(self) -> tuple[float, float]:
        """Powers of torque and dc-link voltage that this cost grows with, near the working point
        [1]: what a law needs that learns another flux map (control/frame/learning.hpp)."""
        points = ((1.0, 1.0), (1 / NEAR, 1.0), (NEAR, 1.0), (1.0, 1 / NEAR), (1.0, NEAR))
        weights = np.array([self._weight(tau, u) for tau, u in points])
        if np.any(weights <= 0):  # one long pulse: nothing switches
            return 0.0, 0.0
        tau, u = np.log(weights[2::2] / weights[1::2]) / (2 * np.log(NEAR))
        return float(tau), float(u)

    def _weight(self, tau: float, u: float) -> float:
        """Cost of a turn-on at such parts of working torque and nominal voltage."""
        lowest = self.tables[0]
        return _core.switching_weight(
            self.point.magnetics,
            guide=self.profiles,
            R=self.point.R,
            tau_ref=tau * self.tau_ref,
            omega_m=lowest.omega_m,
            u_dc=u * lowest.u_dc,
            i_max=self.point.i_max,
            f_switch=self.f_switch,
        )

    def _conducting(self, table: Table) -> NDArray[np.bool_]:
        """Where the guide has current, over the angle."""
        row = table.i[nearest_level(table, self.tau_ref)]
        return np.asarray(row > self.point.i_max / 200)

    def _reserve(self, table: Table) -> float:
        u = voltage(self.point, table, nearest_level(table, self.tau_ref))
        conducts = self._conducting(table)
        if not conducts.any():
            return 1.0
        share = np.mean(np.abs(u[conducts]) < FULL_VOLTAGE * table.u_dc)
        return max(float(share), LEAST_RESERVE)
