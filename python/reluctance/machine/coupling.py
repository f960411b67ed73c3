"""Which phases of a machine couple, and what that adds to them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.machine.maps.pairs import Array, PairTable, apart
from reluctance.machine.models import Magnetics

LETTERS = "abcdef"


@dataclass(frozen=True)
class Neighbours:
    """Two phases whose poles stand side by side."""

    first: int  # phases of the drive, each 2 pi/n_phases behind the one before
    second: int
    table: PairTable

    @property
    def letters(self) -> str:
        """As `ab`."""
        return LETTERS[self.first] + LETTERS[self.second]


@dataclass(frozen=True)
class Coupling:
    """All pairs of a machine. Phases that are no neighbours do not couple here, and what three
    phases add to their pairs is left out."""

    n_phases: int
    pairs: tuple[Neighbours, ...]

    def tau(self, i: ArrayLike, theta_e: ArrayLike) -> Array:
        """Torque that the pairs add [N m].

        Parameters
        ----------
        i : array_like, shape (..., n_phases)
            Phase currents [A].
        theta_e : array_like, shape (...)
            Electrical angle of phase a [rad].
        """
        i, theta_e = np.asarray(i, dtype=np.float64), np.asarray(theta_e, dtype=np.float64)
        total = np.zeros(np.broadcast_shapes(i.shape[:-1], theta_e.shape))
        for pair in self.pairs:
            theta_first = theta_e - 2 * np.pi * pair.first / self.n_phases
            phi = theta_first - apart(pair.first, pair.second, self.n_phases) / 2
            total = total + pair.table.at(phi, i[..., pair.first], i[..., pair.second]).tau
        return total


def check_pairs(coupling: Coupling, magnetics: Magnetics, i_max: float) -> None:
    """Refuses tables with which two currents up to i_max [A] would have no inductance: of a machine
    that is none. magnetics: of one phase alone.

    Raises
    ------
    ParameterError
        Where a table ends below i_max [A], or the inductance matrix of a pair is not positive
        definite up to it.
    """
    for pair in coupling.pairs:
        if pair.table.i[-1] < i_max * (1 - 1e-9):
            raise ParameterError(
                f"pair of phases {pair.letters}: the table ends at {pair.table.i[-1]:.4g} A, below "
                f"i_max_A = {i_max:.4g}; extend it or lower i_max_A"
            )
    phi, a, b = np.meshgrid(
        np.linspace(-np.pi, np.pi, 61), *(np.linspace(0, i_max, 13),) * 2, indexing="ij"
    )
    for pair in coupling.pairs:
        x, delta = pair.table.at(phi, a, b), apart(pair.first, pair.second, coupling.n_phases)
        L_a = _L_inc(magnetics, a, phi + delta / 2) + x.L_first
        L_b = _L_inc(magnetics, b, phi - delta / 2) + x.L_second
        wrong = (L_a <= 0) | (L_a * L_b <= x.L_mutual**2)
        if wrong.any():
            n = np.unravel_index(np.argmax(wrong), wrong.shape)
            raise ParameterError(
                f"pair of phases {pair.letters}: no positive inductance at {a[n]:.3g} A and "
                f"{b[n]:.3g} A, {np.degrees(phi[n]):.3g} deg; take flux map and pair table from "
                "the same source"
            )


def _L_inc(magnetics: Magnetics, i: Array, theta_e: Array) -> Array:
    """Incremental inductance of one phase [H]."""
    turned = np.mod(theta_e, 2 * np.pi)
    flat = _core.magnetics(magnetics, i.ravel().copy(), turned.ravel().copy())
    return np.asarray(flat[:, 3]).reshape(i.shape)
