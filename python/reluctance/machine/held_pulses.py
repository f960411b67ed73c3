"""Voltage pulses of one phase while another is held at a current, as commissioning records them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from reluctance.base.errors import ParameterError
from reluctance.base.reading import numbers, place_of, read_rows, reading
from reluctance.machine.coupling import LETTERS
from reluctance.machine.maps.pulses import FEWEST_ROWS, MAX_BYTES
from reluctance.machine.maps.table import Array

COLUMNS = ("t_s", "i_A", "theta_m_deg", "u_held_mean_V", "i_held_A", "pair")


@dataclass(frozen=True)
class HeldPulse:
    """One pulse at one rotor angle. It begins and ends without current in the pulsed phase."""

    pulsed: int  # phase of the drive
    held: int
    theta_m: float  # of the rotor [rad]
    t: Array  # [s]
    i: Array  # of the pulsed phase [A]
    u_held: Array  # mean since the row before [V]
    i_held: Array  # [A]

    @property
    def pair(self) -> str:
        """As `ab`: the pulsed phase and the held one."""
        return LETTERS[self.pulsed] + LETTERS[self.held]


def read_held_pulses(paths: Sequence[str | Path], *, n_phases: int) -> tuple[HeldPulse, ...]:
    """The pulses in some files of `write_pulses`. A pulse ends where the time falls back, or the
    angle or the pair changes.

    Raises
    ------
    ParameterError
        One line: what is wrong with which file, and what to do.
    """
    found: list[HeldPulse] = []
    for path in map(Path, paths):
        with reading(path, "a record of pulses beside a held phase"):
            found += _read(read_rows(path, most_bytes=MAX_BYTES), n_phases)
    return tuple(found)


def _read(table: list[list[str]], n_phases: int) -> list[HeldPulse]:
    names, *rows = table
    missing = [name for name in COLUMNS if name not in names]
    if missing:
        raise ParameterError(
            f"column {missing[0]} is missing; need {', '.join(COLUMNS)} in the first line: record "
            "the pulses beside a held phase"
        )
    if not rows:
        raise ParameterError(
            "there are no rows below the names; record the pulses beside a held phase"
        )
    t, i, theta, u_held, i_held = (
        numbers(rows, place_of(names, name), name) for name in COLUMNS[:-1]
    )
    pairs = [row[place_of(names, COLUMNS[-1])] for row in rows]
    phases = {pair: _phases(pair, n_phases) for pair in dict.fromkeys(pairs)}
    other = np.array([a != b for a, b in pairwise(pairs)], dtype=bool)
    ends = np.flatnonzero((np.diff(t) <= 0) | (np.diff(theta) != 0) | other) + 1
    found = []
    for part in np.split(np.arange(len(t)), ends):
        if len(part) < FEWEST_ROWS:
            raise ParameterError(
                f"data row {part[0] + 1}: the pulse there has {len(part)} rows, need {FEWEST_ROWS} "
                "with a time that rises, one angle and one pair"
            )
        pulsed, held = phases[pairs[part[0]]]
        angle = float(np.radians(theta[part[0]]))
        found.append(HeldPulse(pulsed, held, angle, t[part], i[part], u_held[part], i_held[part]))
    return found


def _phases(pair: str, n_phases: int) -> tuple[int, int]:
    first, second = (LETTERS[:n_phases].find(letter) for letter in pair.ljust(2)[:2])
    if len(pair) != 2 or min(first, second) < 0 or first == second:
        raise ParameterError(
            f"pair `{pair}` is none of phases {', '.join(LETTERS[:n_phases])}; write the pulsed "
            "phase and the held one, as ab"
        )
    return first, second
