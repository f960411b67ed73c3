"""What the columns of a run's rows mean: the one list of names, and rows with names.

The order is that of include/srm/sim/recorder.hpp.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
LETTERS = "abcdef"  # of the phases


def waveform_columns(n_phases: int) -> list[str]:
    """Of a waveform row."""
    names = ["t", "theta_m", "omega_m", "tau_ref"]
    return names + [f"{name}_{k}" for k in LETTERS[:n_phases] for name in ("i", "leg", "i_ref")]


def period_columns(n_phases: int) -> list[str]:
    """Of a period row: sums and integrals since the start, extremes within the period."""
    return [
        *("t", "theta_m", "omega_m", "W_f", "turn_ons", "S_on", "S_off"),
        *("tau_min", "tau_max", "omega_min", "omega_max", "i_peak"),
        *("E_dc", "E_winding", "E_mech", "tau", "tau_squared", "error_squared"),
        *(f"i_squared_{k}" for k in LETTERS[:n_phases]),
        "tau_ref",
    ]


@dataclass(frozen=True)
class Rows:
    """Rows of numbers whose columns have names."""

    values: FloatArray  # (n, n_columns)
    names: list[str]

    def __getitem__(self, name: str) -> FloatArray:
        """A column, shape (n,)."""
        return self.values[:, self.names.index(name)]

    def phases(self, name: str) -> FloatArray:
        """The columns of all phases, shape (n_phases, n)."""
        columns = [self.names.index(f"{name}_{k}") for k in LETTERS if f"{name}_{k}" in self.names]
        return np.ascontiguousarray(self.values[:, columns].T)

    def between(self, start: int, end: int) -> Rows:
        """Some of the rows."""
        return Rows(self.values[start:end], self.names)

    def rise(self, name: str) -> float:
        """A column's last value less its first."""
        column = self[name]
        return float(column[-1] - column[0])
