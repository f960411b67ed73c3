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
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.machine.coupling import Coupling
from reluctance.machine.held_pulses import HeldPulse
from reluctance.machine.maps.pulses import REST_ROWS
from reluctance.machine.maps.table import Array
from reluctance.machine.models import Magnetics
from reluctance.machine.operating_point import OperatingPoint

FEWEST = 4  # clamped positions whose agreement tells how certain a factor is
BEGUN = 0.1  # of a pulse's top: below this current it has not begun for its offset


@dataclass(frozen=True)
class PairFactor:
    """What the pairs are, as a factor on what they were believed to be.

    Attributes
    ----------
    factor, error : float
        And its standard error, from how far the clamped positions agree.
    of_pair : dict
        The same of each pair alone, the pulsed phase first.
    psi_rms, residual : float
        What the pairs add to the flux linkages, and what is left over, rms [Wb].
    n_pulses, n_positions : int
    """

    factor: float
    error: float
    of_pair: dict[str, float]
    psi_rms: float
    residual: float
    n_pulses: int
    n_positions: int


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
    factor = float(xy.sum() / xx.sum())
    at = {place: k for k, place in enumerate(dict.fromkeys(places))}
    if len(at) < FEWEST:
        raise ParameterError(
            f"{len(at)} clamped positions, need at least {FEWEST} over a period of the angle"
        )
    scores = np.bincount([at[place] for place in places], weights=xy - factor * xx)
    left = np.concatenate([y - factor * x for x, y in zip(believed, measured, strict=True)])
    names = np.array([pulse.pair for pulse in pulses])
    n = len(at)
    return PairFactor(
        factor=factor,
        error=float(np.sqrt(n / (n - 1) * (scores**2).sum()) / xx.sum()),
        of_pair={
            str(name): float(xy[names == name].sum() / xx[names == name].sum())
            for name in dict.fromkeys(names)
            if xx[names == name].sum() > 0
        },
        psi_rms=float(np.sqrt((np.concatenate(believed) ** 2).mean())),
        residual=float(np.sqrt((left**2).mean())),
        n_pulses=len(pulses),
        n_positions=n,
    )


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
