"""The pairs of a geometry as those of a drive: their phases, and the table of each kind."""

from __future__ import annotations

from collections.abc import Callable

from reluctance.base.errors import ParameterError
from reluctance.machine.coupling import Coupling, Neighbours, check_pairs
from reluctance.machine.geometry.file import Geometry
from reluctance.machine.geometry.pairs import kind_of, pairs_solved
from reluctance.machine.maps.pairs import PairSamples, PairTable, pair_table
from reluctance.machine.models import Magnetics


def coupling_of(
    geometry: Geometry,
    magnetics: Magnetics,
    i_max: float,
    *,
    told: Callable[[float], None] | None = None,
) -> Coupling:
    """The pairs of a machine, solved or from the cache, and checked up to i_max [A].

    Parameters
    ----------
    geometry : Geometry
    magnetics : Magnetics
        Of one phase alone.
    i_max : float
        Greatest current [A].
    told : callable, optional
        Gets the share that is done, 0 to 1.

    Raises
    ------
    ParameterError
        See `check_pairs`.
    """
    N_r, n_phases = geometry.rotor_poles, geometry.phases
    starts = range(n_phases if n_phases > 2 else 1)  # of two phases both neighbours are one pair
    kinds = [kind_of(geometry, pole) for pole in starts]
    poles = sorted({kinds.index(kind) for kind in kinds})
    solved = pairs_solved(geometry, poles, told=told)

    def neighbours(pole: int, table: PairTable) -> Neighbours:
        return Neighbours(phase_of(geometry, pole), phase_of(geometry, pole + 1), table)

    def table_of(pole: int, samples: PairSamples) -> PairTable:
        """The table of the least rank that the tolerance allows and that passes the check: the
        samples have no inductances, and a rank may miss them where the iron saturates most."""
        chosen = geometry.map.pair_rank
        table = pair_table(samples, N_r, rank=chosen)
        while True:
            try:
                check_pairs(Coupling(n_phases, (neighbours(pole, table),)), magnetics, i_max)
                return table
            except ParameterError:
                if chosen is not None or table.rank == len(samples.i):
                    raise
            table = pair_table(samples, N_r, rank=table.rank + 1)

    tables = {kinds[pole]: table_of(pole, solved.samples(n)) for n, pole in enumerate(poles)}
    return Coupling(n_phases, tuple(neighbours(pole, tables[kinds[pole]]) for pole in starts))


def phase_of(geometry: Geometry, pole: int) -> int:
    """The phase of the drive, each 2 pi/n_phases behind the one before, on a stator pole."""
    return pole * geometry.rotor_poles * geometry.phases // geometry.stator_poles % geometry.phases
