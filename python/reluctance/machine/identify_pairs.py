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


def pair_torque(point: OperatingPoint, tau_ref: float) -> float:
    """What the pairs add to a torque without ripple and with the least copper loss, rms [N m]:
    an error of their factor, times this, is an error of the torque."""
    from reluctance.machine.optimum.coupled import at_once  # a tenth of the start-up time
    from reluctance.machine.optimum.profile import best_profile

    if point.coupling is None:
        return 0.0
    profile = best_profile(point, tau_ref)
    tau = point.coupling.tau(at_once(np.atleast_2d(profile.i), point.n_phases), profile.theta_e)
    return float(np.sqrt((tau**2).mean()))


def _columns(
    pulse: HeldPulse, coupling: Coupling, magnetics: Magnetics, R: float
) -> tuple[Array, Array]:
    """What the pair adds to the held phase as believed, and as measured, without c and d [Wb]."""
    theta_e = magnetics.N_r * pulse.theta_m
    i = np.zeros((len(pulse.t), coupling.n_phases))
    i[:, pulse.pulsed] = np.maximum(pulse.i - _offset(pulse.i), 0.0)
    i[:, pulse.held] = pulse.i_held
    believed = coupling.psi(i, np.full(len(i), theta_e))[:, pulse.held]
    turned = np.mod(theta_e - 2 * np.pi * pulse.held / coupling.n_phases, 2 * np.pi)
    alone = _core.magnetics(magnetics, pulse.i_held.copy(), np.full(len(i), turned))[:, 0]
    dt = np.diff(pulse.t)
    mean = (pulse.i_held[1:] + pulse.i_held[:-1]) / 2
    psi = np.insert(np.cumsum(dt * (pulse.u_held[1:] - R * mean)), 0, 0.0)
    within = i.max(axis=1) <= coupling.i_last
    free = np.stack([np.ones(len(i)), pulse.t - pulse.t.mean()], axis=1)[within]
    basis, _ = np.linalg.qr(free)
    both = np.stack([believed, psi - alone], axis=1)[within]
    both -= basis @ (basis.T @ both)
    return both[:, 0], both[:, 1]


def _offset(i: Array) -> float:
    """Mean reading before a pulse begins [A]."""
    begun = int(np.argmax(i > BEGUN * i.max()))
    if begun < 2 * REST_ROWS:
        raise ParameterError(
            f"a pulse begins {begun} rows after its record, need {2 * REST_ROWS} at rest before it"
        )
    return float(i[: begun // 2].mean())
