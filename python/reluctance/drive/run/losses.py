"""Losses that the loop leaves out: iron, from the flux waveforms, and switching, from datasheets.

Both are computed after the run and do not act back on it: the dc link is taken to deliver them
beside what the loop drew, p_in = p_mech + p_cu + p_dev + p_fe + p_sw once the flux is periodic.
"""

from itertools import pairwise
from math import gamma

import numpy as np

from reluctance.base.arrays import FloatArray
from reluctance.machine.loss_data import Iron, SwitchingEnergies


def switching_loss(energies: SwitchingEnergies, S_on: float, S_off: float) -> float | None:
    """Mean switching loss [W]; None where no energies are given.

    Parameters
    ----------
    energies : SwitchingEnergies
    S_on, S_off : float
        Sums of u_dc i over the turn-ons and turn-offs of all switches, per second [VA/s].
    """
    if energies.u_sw_ref_V is None or energies.i_sw_ref_A is None:
        return None
    energy = (energies.E_on_mJ + energies.E_rr_mJ) * S_on + energies.E_off_mJ * S_off
    return 1e-3 * energy / (energies.u_sw_ref_V * energies.i_sw_ref_A)


def iron_loss(iron: Iron, t: FloatArray, psi: FloatArray) -> float:
    """Mean iron loss of flux waveforms by the improved generalised Steinmetz equation,

        p = k_i/T int |dpsi/dt|^alpha (Delta psi)^(beta - alpha) dt,

    with Delta psi the peak-to-peak flux of the loop that each instant belongs to, minor loops apart
    (K. Venkatachalam, C. R. Sullivan, T. Abdallah, H. Tacca, IEEE COMPEL 2002). Bias has no effect.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Rising instants over whole periods [s].
    psi : ndarray, shape (n_phases, n)
        Flux linkages [Wb]; straight between the instants.

    Returns
    -------
    float
        Of the whole machine [W].
    """
    alpha, beta = iron.alpha, iron.beta
    k = iron.p_ref_W / len(psi) / (iron.f_ref_Hz**alpha * iron.psi_ref_Wb**beta)
    cosine = 2 * np.sqrt(np.pi) * gamma((alpha + 1) / 2) / gamma(alpha / 2 + 1)  # int |cos|^alpha
    k_i = k / ((2 * np.pi) ** (alpha - 1) * cosine * 2 ** (beta - alpha))
    steps = np.diff(t)
    keep = steps > 0
    total = 0.0
    for flux in psi:
        change = np.diff(flux)[keep]
        weight = np.abs(change) ** alpha * steps[keep] ** (1 - alpha)
        start = int(np.argmin(flux[:-1][keep])) if change.size else 0
        for span, part in loops(np.roll(change, -start), np.roll(weight, -start)):
            total += span ** (beta - alpha) * part
    return float(k_i * total / (t[-1] - t[0]))


def loops(change: FloatArray, weight: FloatArray) -> list[tuple[float, float]]:
    """Each loop of a waveform: its peak-to-peak value, and the weight of the steps in it.

    A swing that lies within its neighbours is a minor loop: it is taken out together with the part
    of the next swing that leads back to where it began. What stays are the swings of major loops.

    Parameters
    ----------
    change : ndarray, shape (n,)
        Change over each step.
    weight : ndarray, shape (n,)
        What is to be summed; within a step proportional to the change.
    """
    found: list[tuple[float, float]] = []
    swings: list[_Swing] = []
    for swing in _swings(change, weight):
        swings.append(swing)
        while len(swings) >= 3 and swings[-2].span <= min(swings[-3].span, swings[-1].span):
            last, minor, before = swings.pop(), swings.pop(), swings.pop()
            back, rest = last.split(minor.span)
            found.append((minor.span, minor.weight + back))
            swings.append(before.joined(rest))
    return found + [(swing.span, swing.weight) for swing in swings]


class _Swing:
    """A monotone piece of a waveform: cumulated magnitude of change, and weight, from its start."""

    def __init__(self, level: FloatArray, weight: FloatArray) -> None:
        self.level, self.cumulated = level, weight

    @property
    def span(self) -> float:
        return float(self.level[-1])

    @property
    def weight(self) -> float:
        return float(self.cumulated[-1])

    def split(self, at: float) -> "tuple[float, _Swing]":
        """The weight of the piece up to this change, and the rest."""
        part = float(np.interp(at, self.level, self.cumulated))
        n = int(np.searchsorted(self.level, at, side="right"))
        level = np.concatenate([[0.0], self.level[n:] - at])
        return part, _Swing(level, np.concatenate([[0.0], self.cumulated[n:] - part]))

    def joined(self, other: "_Swing") -> "_Swing":
        level = np.concatenate([self.level, self.span + other.level[1:]])
        return _Swing(level, np.concatenate([self.cumulated, self.weight + other.cumulated[1:]]))


def _swings(change: FloatArray, weight: FloatArray) -> list[_Swing]:
    """The monotone pieces between turning points; a step without change belongs to none."""
    moves = change != 0
    change, weight = change[moves], weight[moves]
    if change.size == 0:
        return []
    turns = np.flatnonzero(np.diff(np.sign(change))) + 1
    return [
        _Swing(
            np.concatenate([[0.0], np.cumsum(np.abs(change[a:b]))]),
            np.concatenate([[0.0], np.cumsum(weight[a:b])]),
        )
        for a, b in pairwise([0, *turns, len(change)])
    ]
