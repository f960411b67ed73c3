"""The pairs of a geometry as those of a drive: their phases, and the table of each kind."""

from __future__ import annotations

from collections.abc import Callable

from reluctance.machine.coupling import Coupling, Neighbours
from reluctance.machine.geometry.file import Geometry
from reluctance.machine.geometry.pairs import kind_of, pairs_solved
from reluctance.machine.maps.pairs import pair_table


def coupling_of(geometry: Geometry, *, told: Callable[[float], None] | None = None) -> Coupling:
    """The pairs of a machine, solved or from the cache.

    Parameters
    ----------
    geometry : Geometry
    told : callable, optional
        Gets the share that is done, 0 to 1.
    """
    N_r, n_phases = geometry.rotor_poles, geometry.phases
    starts = range(n_phases if n_phases > 2 else 1)  # of two phases both neighbours are one pair
    kinds = [kind_of(geometry, pole) for pole in starts]
    poles = sorted({kinds.index(kind) for kind in kinds})
    solved = pairs_solved(geometry, poles, told=told)
    tables = {
        kinds[pole]: pair_table(solved.samples(n), N_r, rank=geometry.map.pair_rank)
        for n, pole in enumerate(poles)
    }
    return Coupling(
        n_phases=n_phases,
        pairs=tuple(
            Neighbours(phase_of(geometry, pole), phase_of(geometry, pole + 1), tables[kinds[pole]])
            for pole in starts
        ),
    )


def phase_of(geometry: Geometry, pole: int) -> int:
    """The phase of the drive, each 2 pi/n_phases behind the one before, on a stator pole."""
    return pole * geometry.rotor_poles * geometry.phases // geometry.stator_poles % geometry.phases
