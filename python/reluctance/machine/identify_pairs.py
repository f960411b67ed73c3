"""From pulses beside a held phase to the factor of the pairs of a machine.

A pulse from rest and back changes the flux linkage of the held phase by what the pair adds to it,
psi_pair(i, i_held), which is zero without the pulsed current. So

    integral of (u_held - R i_held) dt = psi_alone(i_held) + factor psi_pair(i, i_held) + c + d t

over a pulse, with psi_pair as believed. c and d are free in every pulse: d takes what offsets of
the sensors, drops of the devices and an error of R add. The pulsed phase would not do: its own flux
linkage is large, and a pulse does not show what the held phase adds before its current rises.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.machine.coupling import Coupling, Neighbours
from reluctance.machine.held_pulses import HeldPulse
from reluctance.machine.maps.pulses import REST_ROWS
from reluctance.machine.maps.table import Array
from reluctance.machine.models import Magnetics
from reluctance.machine.operating_point import OperatingPoint

FEWEST = 4  # clamped positions whose agreement tells how certain a factor is
SURE, DIFFERENT = 3.0, 0.2  # errors, and parts of the factor, that two pairs differ by
FAR_BETTER = 1 / 3  # of what is left over, with the leads elsewhere
BEGUN = 0.1  # of a pulse's top: below this current it has not begun for its offset


@dataclass(frozen=True)
class PairFactor:
    """What the pairs are, as a factor on what they were believed to be.

    Attributes
    ----------
    factor, error : float
        And its standard error, from how far the clamped positions agree.
    of_pair, error_of_pair : dict
        The same of each pair alone, the pulsed phase first.
    psi_rms, residual : float
        What the pairs add to the flux linkages, and what is left over, rms [Wb].
    n_pulses, n_positions : int
    """

    factor: float
    error: float
    of_pair: dict[str, float]
    error_of_pair: dict[str, float]
    psi_rms: float
    residual: float
    n_pulses: int
    n_positions: int

    @property
    def differ(self) -> bool:
        """Whether the factors of two pairs are farther apart than their errors and than what a
        factor can leave wrong: then no factor makes these tables right."""
        return any(
            abs(self.of_pair[a] - self.of_pair[b])
            > max(
                SURE * float(np.hypot(self.error_of_pair[a], self.error_of_pair[b])),
                DIFFERENT * abs(self.factor),
            )
            for a, b in combinations(self.of_pair, 2)
        )


def pair_factor(
    pulses: Sequence[HeldPulse], coupling: Coupling, magnetics: Magnetics, R: float
) -> PairFactor:
    """The factor with which believed pairs explain pulses best.

    Parameters
    ----------
    pulses : sequence of HeldPulse
    coupling : Coupling
        As believed.
    magnetics : Magnetics
        Of one phase alone.
    R : float
        Resistance of a phase [ohm].

    Raises
    ------
    ParameterError
        Where the pulses do not show the pairs.
    """
    believed, measured = [], []
    for pulse in pulses:
        x, y = _columns(pulse, coupling, magnetics, R)
        believed.append(x)
        measured.append(y)
    places = [(pulse.pair, round(pulse.theta_m, 3)) for pulse in pulses]
    xx, xy = (
        np.array([x @ z for x, z in zip(believed, of, strict=True)]) for of in (believed, measured)
    )
    if not xx.sum() > 0:
        raise ParameterError("the pairs as believed add nothing to the phases that were held")
    at = {place: k for k, place in enumerate(dict.fromkeys(places))}
    if len(at) < FEWEST:
        raise ParameterError(
            f"{len(at)} clamped positions, need at least {FEWEST} over a period of the angle"
        )
    place = np.array([at[one] for one in places])
    factor, error = _agreed(xx, xy, place)
    left = np.concatenate([y - factor * x for x, y in zip(believed, measured, strict=True)])
    names = np.array([pulse.pair for pulse in pulses])
    alone = {
        str(name): _agreed(xx[names == name], xy[names == name], place[names == name])
        for name in dict.fromkeys(names)
        if xx[names == name].sum() > 0
    }
    return PairFactor(
        factor=factor,
        error=error,
        of_pair={name: of[0] for name, of in alone.items()},
        error_of_pair={name: of[1] for name, of in alone.items()},
        psi_rms=float(np.sqrt((np.concatenate(believed) ** 2).mean())),
        residual=float(np.sqrt((left**2).mean())),
        n_pulses=len(pulses),
        n_positions=len(at),
    )


def _agreed(xx: Array, xy: Array, place: NDArray[np.intp]) -> tuple[float, float]:
    """The factor of pulses, and its standard error from how far their clamped positions agree."""
    factor, n = float(xy.sum() / xx.sum()), len(set(place.tolist()))
    scores = np.bincount(place, weights=xy - factor * xx)
    spread = np.inf if n < 2 else n / (n - 1) * (scores**2).sum()
    return factor, float(np.sqrt(spread) / xx.sum())


def phase_of_first(
    pulses: Sequence[HeldPulse], coupling: Coupling, magnetics: Magnetics, R: float
) -> int:
    """The phase that the first leg drives, where all leads are moved on by as many: 0 where they
    are as believed, or where the pulses do not tell."""
    n, found = coupling.n_phases, {}
    for first in range(n):
        back = tuple(
            Neighbours((pair.first - first) % n, (pair.second - first) % n, pair.table)
            for pair in coupling.pairs
        )
        moved = replace(coupling, pairs=back)
        try:
            found[first] = pair_factor(pulses, moved, magnetics, R).residual
        except ParameterError:  # these pairs add nothing to the phases that were held
            found[first] = np.inf
    best = min(found, key=found.__getitem__)
    return best if found[best] < FAR_BETTER * found[0] else 0


def smooth_currents(point: OperatingPoint, tau_ref: float) -> tuple[Array, Array]:
    """Currents (n, n_phases) [A] of a torque without ripple and with the least copper loss, at
    electrical angles of phase a (n) [rad]: where an error of the pairs is an error of the torque.
    """
    from reluctance.machine.optimum.coupled import at_once  # a tenth of the start-up time
    from reluctance.machine.optimum.profile import best_profile

    profile = best_profile(point, tau_ref)
    return at_once(np.atleast_2d(profile.i), point.n_phases), profile.theta_e


def pair_torque(point: OperatingPoint, tau_ref: float) -> float:
    """What the pairs add to such a torque, rms [N m]: times an error of their factor, it is one of
    the torque."""
    if point.coupling is None:
        return 0.0
    return float(np.sqrt((point.coupling.tau(*smooth_currents(point, tau_ref)) ** 2).mean()))


def _columns(
    pulse: HeldPulse, coupling: Coupling, magnetics: Magnetics, R: float
) -> tuple[Array, Array]:
    """What the pair adds to the held phase as believed, and as measured, without c and d [Wb]."""
    i = np.zeros((len(pulse.t), coupling.n_phases))
    i[:, pulse.pulsed], i[:, pulse.held] = pulsed_current(pulse), pulse.i_held
    theta_e = np.full(len(i), magnetics.N_r * pulse.theta_m)
    believed = coupling.psi(i, theta_e)[:, pulse.held]
    within = i.max(axis=1) <= coupling.i_last
    turn = 2 * np.pi * pulse.held / coupling.n_phases
    both = free_of_drift(pulse, believed[:, None], within, magnetics, R, turn)
    return both[:, 0], both[:, 1]


def free_of_drift(
    pulse: HeldPulse,
    explaining: Array,
    within: NDArray[np.bool_],
    magnetics: Magnetics,
    R: float,
    turn: float,
) -> Array:
    """Explaining columns (n, k), and as the last one what the pair adds to the flux linkage of the
    held phase as measured [Wb]: of the samples `within`, all without c and d.

    turn : electrical angle by which the held phase is behind phase a [rad]
    """
    angle = np.full(len(pulse.t), np.mod(magnetics.N_r * pulse.theta_m - turn, 2 * np.pi))
    alone = _core.magnetics(magnetics, pulse.i_held.copy(), angle)[:, 0]
    mean = (pulse.i_held[1:] + pulse.i_held[:-1]) / 2
    rise = np.diff(pulse.t) * (pulse.u_held[1:] - R * mean)
    added = np.insert(np.cumsum(rise), 0, 0.0) - alone
    drift = np.stack([np.ones(len(pulse.t)), pulse.t - pulse.t.mean()], axis=1)[within]
    basis, _ = np.linalg.qr(drift)
    columns = np.column_stack([explaining, added])[within]
    return np.asarray(columns - basis @ (basis.T @ columns))


def pulsed_current(pulse: HeldPulse) -> Array:
    """Less its mean before the pulse, and none below 0 [A]."""
    return np.maximum(pulse.i - _offset(pulse.i), 0.0)


def _offset(i: Array) -> float:
    """Mean reading before a pulse begins [A]."""
    begun = int(np.argmax(i > BEGUN * i.max()))
    if begun < 2 * REST_ROWS:
        raise ParameterError(
            f"a pulse begins {begun} rows after its record, need {2 * REST_ROWS} at rest before it"
        )
    return float(i[: begun // 2].mean())
