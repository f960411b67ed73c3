"""The pairs of a machine as a CSV file, from a field solver, a bench, or a solved geometry."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from itertools import groupby
from operator import itemgetter
from pathlib import Path

import numpy as np

from reluctance.base.errors import ParameterError
from reluctance.base.reading import numbers, place_of, read_rows, reading
from reluctance.machine.coupling import LETTERS, Coupling, Neighbours
from reluctance.machine.maps.pairs import Array, PairSamples, PairTable, pair_table, reasons

COLUMNS = (
    *("pairs", "phi_e_deg", "i_first_A", "i_second_A"),
    *("energy_J", "tau_Nm", "psi_first_Wb", "psi_second_Wb"),
)

AS_IT_IS = 1e-6  # of the torque: what a file holds was kept on purpose [1]


def write_pairs(coupling: Coupling, path: Path) -> None:
    """Writes the tables at the angles and currents of their samples, one after the other, with the
    factor of the coupling."""
    of: dict[PairTable, list[str]] = {}
    for pair in coupling.pairs:
        of.setdefault(pair.table, []).append(pair.letters)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for table, names in of.items():
            s = table.samples()
            nodes = _nodes(np.degrees(s.phi).round(10), s.i)
            figures = (
                coupling.factor * x.ravel() for x in (s.energy, s.tau, s.psi_first, s.psi_second)
            )
            for row in zip(*nodes, *figures, strict=True):
                places, values = row[:3], row[3:]
                texts = [*(repr(float(x)) for x in places), *(f"{x:.10g}" for x in values)]
                writer.writerow([" ".join(names), *texts])


def read_pairs(path: Path, *, N_r: int, n_phases: int) -> Coupling:
    """The pairs of a file.

    Raises
    ------
    ParameterError
        With one line: no such file, a column, a number, a phase, a node that is missing, or tables
        that are not of one co-energy.
    """
    with reading(path, "the pairs of a machine"):
        names, *rows = read_rows(path)
        missing = [name for name in COLUMNS if name not in names]
        if missing or not rows:
            raise ParameterError(
                f"column {[*missing, COLUMNS[0]][0]} is missing; need {', '.join(COLUMNS)} in the "
                "first line, and rows"
            )
        places = [place_of(names, name) for name in COLUMNS]
        return _coupling([[row[k] for k in places] for row in rows], N_r, n_phases)


def _coupling(rows: list[list[str]], N_r: int, n_phases: int) -> Coupling:
    """Of rows with COLUMNS in their order."""
    pairs: list[Neighbours] = []
    for names, alike in groupby(rows, key=itemgetter(0)):
        samples = _samples(list(alike))
        if why := reasons(samples, N_r):
            raise ParameterError(f"pairs {names}: {why[0]}")
        table = pair_table(samples, N_r, tolerance=AS_IT_IS)
        for name in names.split():
            first, second = (LETTERS[:n_phases].find(letter) for letter in name.ljust(2)[:2])
            if len(name) != 2 or min(first, second) < 0 or first == second:
                raise ParameterError(
                    f"pair `{name}` is none of phases {', '.join(LETTERS[:n_phases])}; "
                    "write the first phase and the second, as ab"
                )
            pairs.append(Neighbours(first, second, table))
    check_ring(pairs, n_phases)
    return Coupling(n_phases=n_phases, pairs=tuple(pairs))


def check_ring(pairs: Sequence[Neighbours], n_phases: int) -> None:
    """Every phase has the same neighbours: beside a pair all others as far apart are there, each
    once. A table of another number of phases is none."""
    there = [frozenset((pair.first, pair.second)) for pair in pairs]
    for n, pair in enumerate(pairs):
        if there[n] in there[:n] and n_phases > 2:  # of two phases each is on both sides
            raise ParameterError(f"pair {pair.letters} is named twice; remove one")
    apart = sorted({min(abs(a - b), n_phases - abs(a - b)) for a, b in map(sorted, there)})
    lacking = {
        "".join(LETTERS[k] for k in sorted(both)): None
        for d in apart
        for both in ({k, (k + d) % n_phases} for k in range(n_phases))
        if both not in there
    }
    if lacking:
        raise ParameterError(
            f"pairs {', '.join(lacking)} are missing beside {', '.join(p.letters for p in pairs)}: "
            f"each of {n_phases} phases has neighbours as far apart; is it the table of another "
            "machine?"
        )


def _samples(rows: list[list[str]]) -> PairSamples:
    columns = [numbers(rows, k, name) for k, name in enumerate(COLUMNS[1:], 1)]
    phi, i = np.unique(columns[0]), np.unique(columns[1])
    nodes = _nodes(phi, i)
    if len(rows) != len(nodes[0]) or not np.array_equal(np.array(columns[:3]), np.array(nodes)):
        raise ParameterError(
            f"{len(rows)} rows are no grid of {len(phi)} angles and {len(i)} currents of "
            "both phases; need every angle with every first and second current, rising"
        )
    if phi[0] != 0 or phi[-1] != 180 or len(phi) < 5 or len(i) < 3 or i[0] <= 0:
        raise ParameterError(
            f"angles {phi[0]:g} to {phi[-1]:g} deg and currents from {i[0]:g} A; need at "
            "least 5 angles from 0 to 180 deg and 3 currents above 0"
        )
    shape = (len(phi), len(i), len(i))
    return PairSamples(np.radians(phi), i, *(column.reshape(shape) for column in columns[3:]))


def _nodes(phi: Array, i: Array) -> tuple[Array, Array, Array]:
    """Angle, first and second current of every node, the last one fastest."""
    grid = np.meshgrid(phi, i, i, indexing="ij")
    return grid[0].ravel(), grid[1].ravel(), grid[2].ravel()
