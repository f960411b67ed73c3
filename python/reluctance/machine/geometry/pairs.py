"""Two neighbouring phases of a cross-section over the angle and both currents.

Poles side by side have one polarity or two, and a winding has pairs of one or both kinds: each kind
is solved once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from reluctance.base.cache import cached
from reluctance.machine.coupling import apart
from reluctance.machine.geometry.file import Geometry
from reluctance.machine.geometry.mesh import Grid
from reluctance.machine.geometry.position import Position, at_angle
from reluctance.machine.geometry.samples import TOLERANCE, rotor_angle
from reluctance.machine.geometry.solve import Field, solve
from reluctance.machine.geometry.solved import content, system_of
from reluctance.machine.geometry.steel import Array
from reluctance.machine.geometry.system import System
from reluctance.machine.maps.pairs import PairSamples

ANGLES, CURRENTS = 13, 7  # nodes over half a period, and above zero (docs/geometry.md)
# Power of the steps of the currents. Near zero they are closer, since a phase with little current
# links the flux of its neighbour: on the 6/4 machine of the library, NN, with three functions, 1
# leaves 0.54 % rms of the flux linkage between the nodes, 1.25 and 1.5 leave 0.20 to 0.21 % [1].
SPREAD = 1.5
ALGORITHM = 3  # raised whenever the same geometry gives other numbers


@dataclass(frozen=True)
class PairsSolved:
    """The samples of all kinds of pairs; the first axis of the arrays is the kind."""

    phi: Array
    i: Array
    energy: Array
    tau: Array
    psi_first: Array
    psi_second: Array

    def samples(self, kind: int) -> PairSamples:
        """Of one kind."""
        each = (self.energy, self.tau, self.psi_first, self.psi_second)
        return PairSamples(self.phi, self.i, *(x[kind] for x in each))


def currents(i_max: float) -> Array:
    """Nodes above zero [A]."""
    return i_max * (np.arange(1, CURRENTS + 1) / CURRENTS) ** SPREAD


def kind_of(geometry: Geometry, k: int) -> tuple[bool, ...]:
    """Wherever the phases of poles k and k + 1 stand side by side: True for one polarity."""
    polarity, N_s = geometry.polarity, geometry.stator_poles
    places = range(k, k + N_s, geometry.phases)
    return tuple(sorted(polarity[p % N_s] == polarity[(p + 1) % N_s] for p in places))


def pairs_solved(
    geometry: Geometry, poles: list[int], *, told: Callable[[float], None] | None = None
) -> PairsSolved:
    """The phases of each of these stator poles and of the next one."""
    inputs = [*content(geometry, Grid()), poles, ANGLES, CURRENTS, SPREAD]
    return cached(PairsSolved, inputs, lambda: _solve(geometry, poles, told), algorithm=ALGORITHM)


def _solve(
    geometry: Geometry, poles: list[int], told: Callable[[float], None] | None
) -> PairsSolved:
    system = system_of(geometry)
    phi = np.linspace(0, np.pi, ANGLES)
    i = currents(geometry.map.current_max_A)
    found = []
    for n, pole in enumerate(poles):

        def share(part: float, n: int = n) -> None:
            if told is not None:
                told((n + part) / len(poles))

        found.append(sample_pair(system, pole, phi, i, told=share))
    each = ("energy", "tau", "psi_first", "psi_second")
    return PairsSolved(phi, i, *(np.array([getattr(x, name) for x in found]) for name in each))


def sample_pair(
    system: System,
    pole: int,
    phi: Array,
    i: Array,
    *,
    told: Callable[[float], None] | None = None,
) -> PairSamples:
    """The phases of a stator pole and of the next one, at angles phi from 0 to pi [rad] and
    currents i above 0 [A]. told: gets the share that is done."""
    n, section, n_phases = len(i) + 1, system.section, system.winding.n_phases
    ahead = section.N_r * n_phases // section.N_s  # phases of the drive from a pole to the next
    delta = apart(0, ahead, n_phases)
    values = np.zeros((len(phi), n, n, 4))
    for m, angle in enumerate(phi):
        alpha = rotor_angle(system, angle + delta / 2, pole)
        values[m] = _at(at_angle(system, alpha), pole, np.append(0.0, i))
        if told is not None:
            told((m + 1) / len(phi))
    both, first, second = values[:, 1:, 1:], values[:, 1:, :1], values[:, :1, 1:]
    energy, tau, _, _ = np.moveaxis(both - first - second, -1, 0)
    # A phase without current links the flux of the other.
    psi_first, psi_second = (both - first)[..., 2], (both - second)[..., 3]
    return PairSamples(phi, i, energy, tau, psi_first, psi_second)


def _at(position: Position, pole: int, i: Array) -> Array:
    """Co-energy, torque and both flux linkages over both currents, (n_i, n_i, 4)."""
    system = position.system
    a, b = (k % system.winding.n_phases for k in (pole, pole + 1))
    values = np.zeros((len(i), len(i), 4))
    row: Field | None = None
    for m in range(len(i)):
        field = row = _next(position, row, a, i[m])
        for n in range(len(i)):
            if n > 0:
                field = _next(position, field, b, i[n])
            values[m, n] = field.coenergy, field.tau, field.psi[a], field.psi[b]
    return values


def _next(position: Position, before: Field | None, k: int, current: float) -> Field:
    """The field with another current of phase k, from the one before it."""
    if before is None:
        i = np.zeros(position.system.winding.n_phases)
        return solve(position, i, tolerance=TOLERANCE)
    i = before.i.copy()
    step, i[k] = current - i[k], current
    start = before.A + step * before.tangent(k)[0]
    return solve(position, i, start=start, tolerance=TOLERANCE)
