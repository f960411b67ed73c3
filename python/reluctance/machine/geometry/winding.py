"""Windings: which phase and which polarity the coil on each stator pole has."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reluctance.machine.geometry.steel import Array


@dataclass(frozen=True)
class Winding:
    """Concentrated coils, pole k of phase k modulo n_phases, those of a phase in like paths."""

    n_phases: int
    polarity: tuple[int, ...]  # (N_s) +1: flux out of the pole at positive current
    turns: int  # per pole
    parallel_paths: int
    coil: Coil | None = None  # None: the coil fills its half of the slot

    def reverses(self, n_sectors: int) -> bool:
        """Whether each of these sectors has the polarity of the one before, reversed."""
        n = len(self.polarity) // n_sectors
        ahead = self.polarity[n:] + self.polarity[:n]
        reverse = all(a == -b for a, b in zip(self.polarity, ahead, strict=True))
        return n_sectors > 1 and reverse

    @property
    def turns_of_flux(self) -> float:
        """Turns that the phase current goes through in each pole: the paths share it."""
        return self.turns / self.parallel_paths

    @property
    def balanced(self) -> bool:
        """Whether the flux of each phase has as many poles out as in."""
        return all(sum(self.polarity[k :: self.n_phases]) == 0 for k in range(self.n_phases))


@dataclass(frozen=True)
class Coil:
    """A coil side as a rectangle next to its pole."""

    from_middle: float  # of the pole to the near side [m]
    width: float  # [m]
    r_inner: float  # along the middle of the pole [m]
    height: float  # [m]

    def covers(self, along: Array, across: Array) -> Array:
        """1 where a point lies in the coil, else 0; from the shaft and from the middle of the pole
        [m]."""
        aside = (across >= self.from_middle) & (across <= self.from_middle + self.width)
        high = (along >= self.r_inner) & (along <= self.r_inner + self.height)
        return np.asarray(aside & high, dtype=np.float64)
