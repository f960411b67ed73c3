"""A drive cycle on an efficiency map: speed and torque over time, and the energy that it takes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from reluctance.base.arrays import FloatArray
from reluctance.base.errors import ParameterError
from reluctance.base.reading import numbers, place_of, read_rows, reading
from reluctance.base.units import name_and_unit, to_si
from reluctance.explore.efficiency_map.map import EfficiencyMap

COLUMNS = ("t_s", "speed_rpm", "tau_Nm")
FINE = 0.005  # energies of a ramp over the whole map are then within 1e-4 of the integral
ROUNDING = 1e-9  # of the shaft's energies: less net energy is the rounding of their difference
PIECES = 1_000_000  # of a cycle, in order of magnitude: bounds the memory


@dataclass(frozen=True)
class Cycle:
    """Instants, joined by straight lines."""

    t: FloatArray  # (n,) rising [s]
    omega: FloatArray  # (n,) >= 0 [rad/s]
    tau: FloatArray  # (n,) electromagnetic [N m]


@dataclass(frozen=True)
class Driven:
    """What a cycle takes. Energies in J, over the part of the time that the map covers."""

    E_mech: float  # to the shaft, motoring
    E_braked: float  # from the shaft, braking
    E_in: float  # from the dc link
    E_returned: float  # to the dc link
    loss: dict[str, float]  # "loss": all of them; and by kind
    held: float  # part of the time that the drive can hold [1]
    below: float  # part of the time held, below the map's first speed or torque [1]

    @property
    def efficiency(self) -> float | None:
        """What the shaft gets over what the dc link gives, both net [1]."""
        given, got = self.E_in - self.E_returned, self.E_mech - self.E_braked
        least = ROUNDING * (self.E_mech + self.E_braked)
        return got / given if given > 0 and got > least else None

    def with_units(self) -> dict[str, float | None]:
        """Under border names."""
        kinds = {k.removeprefix("p_").removesuffix("_W"): v for k, v in self.loss.items()}
        return {
            "E_mech_J": self.E_mech,
            "E_braked_J": self.E_braked,
            "E_in_J": self.E_in,
            "E_returned_J": self.E_returned,
            **{f"E_{kind}_J": value for kind, value in kinds.items()},
            "cycle_efficiency": self.efficiency,
            "held_part_of_time": self.held,
            "below_map_part_of_time": self.below,
        }


def read_cycle(path: str | Path) -> Cycle:
    """A cycle from a CSV or .xlsx file with the columns t_s, speed_rpm and tau_Nm, in any order.

    Raises
    ------
    ParameterError
        If the file cannot be read, a column is missing, or a value cannot be meant.
    """
    path = Path(path)
    with reading(path, "a drive cycle"):
        header, *rows = read_rows(path)
        for name in COLUMNS:
            if name not in header:
                raise ParameterError(f"{path} has no column `{name}`, need {', '.join(COLUMNS)}")
        columns = [
            to_si(numbers(rows, place_of(header, name), name), name_and_unit(name)[1])
            for name in COLUMNS
        ]
    t, omega, tau = columns
    if len(t) < 2 or not np.all(np.diff(t) > 0):
        raise ParameterError(f"{path}: need at least two rows with rising t_s")
    if np.any(omega < 0):
        raise ParameterError(f"{path}: speed_rpm = {omega.min():g}, need >= 0; mirror the cycle")
    return Cycle(t, omega, tau)


def driven(cycle: Cycle, motoring: EfficiencyMap, braking: EfficiencyMap | None = None) -> Driven:
    """The energies of a cycle: speed and torque are straight lines between its rows, and the power
    is integrated along them. Parts that the drive cannot hold are left out, and `held` says how
    much time they take; without a map of braking so are those with negative torque. `below` says
    how much of the time lies before the first speed or torque of the map, where loss over torque is
    that of its edge."""
    lines, dt = pieces(cycle, float(motoring.omega[-1]), float(np.abs(motoring.tau).max()))
    p_in, covered, kinds = on_map(lines, motoring, braking)
    p_mech = np.where(covered, lines.tau * lines.omega, 0.0)
    below = (lines.omega < motoring.omega[0]) | (np.abs(lines.tau) < abs(motoring.tau[0]))

    def energy(power: FloatArray) -> float:
        return float(np.sum(dt * power))

    return Driven(
        E_mech=energy(np.maximum(p_mech, 0)),
        E_braked=energy(np.maximum(-p_mech, 0)),
        E_in=energy(np.maximum(p_in, 0)),
        E_returned=energy(np.maximum(-p_in, 0)),
        loss={"loss": energy(p_in - p_mech)} | {kind: energy(p) for kind, p in kinds.items()},
        held=float(np.sum(dt * covered) / np.sum(dt)),
        below=float(np.sum(dt * (covered & below)) / np.sum(dt)),
    )


def pieces(cycle: Cycle, omega_max: float, tau_max: float) -> tuple[Cycle, FloatArray]:
    """The middles of short pieces of a cycle's straight lines, and their lengths [s].

    Over a piece, speed and torque change by a part FINE of those of the map. The torque changes its
    sign at an end of a piece only: motoring and braking have maps of their own.
    """
    before, after = cycle.tau[:-1], cycle.tau[1:]
    turns = np.flatnonzero(before * after < 0)
    part = before[turns] / (before[turns] - after[turns])
    t = np.sort(np.append(cycle.t, cycle.t[turns] + part * np.diff(cycle.t)[turns]))
    omega, tau = np.interp(t, cycle.t, cycle.omega), np.interp(t, cycle.t, cycle.tau)
    way = np.maximum(np.abs(np.diff(omega)) / omega_max, np.abs(np.diff(tau)) / tau_max)
    count = np.ceil(np.clip(way / FINE, 1, max(1, PIECES // len(t)))).astype(int)
    within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    dt = np.repeat(np.diff(t) / count, count)
    middle = np.repeat(t[:-1], count) + (within + 0.5) * dt
    return Cycle(middle, np.interp(middle, t, omega), np.interp(middle, t, tau)), dt


def on_map(
    cycle: Cycle, motoring: EfficiencyMap, braking: EfficiencyMap | None
) -> tuple[FloatArray, FloatArray, dict[str, FloatArray]]:
    """Power from the dc link (n,) [W], where it is known (n,), and losses by kind (n,) [W]; 0
    elsewhere."""
    covered = np.zeros(len(cycle.t), dtype=bool)
    p_in = np.zeros(len(cycle.t))
    kinds = {kind: np.zeros(len(cycle.t)) for kind in motoring.kinds_per_torque}
    for losses, rows in ((motoring, cycle.tau >= 0), (braking, cycle.tau < 0)):
        if losses is None:
            continue
        here = rows & losses.holds(cycle.omega, cycle.tau)
        omega, tau = cycle.omega[here], cycle.tau[here]
        covered |= here
        p_in[here] = losses.p_in(omega, tau)
        for kind in kinds:
            kinds[kind][here] = losses.loss(omega, tau, kind)
    return p_in, covered, kinds
