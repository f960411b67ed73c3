"""Which couplings a machine can have."""

from dataclasses import replace

import numpy as np
import pytest
from coupled import MACHINES

from reluctance import ParameterError, _core
from reluctance.machine.coupling import Coupling, Neighbours, behind, check_pairs
from reluctance.machine.library import machine_from, machine_table
from reluctance.machine.maps.pairs import PairSamples, pair_table


def test_functions_of_both_currents_of_a_pair_are_kept():
    """W = s(phi) f(a) g(b): its torque depends on the first current by f alone, on the second by g
    alone; two functions hold both."""
    i, phi = np.arange(1, 8) / 7, np.linspace(0, np.pi, 13)
    x, a, b = np.meshgrid(phi, i, i, indexing="ij")
    s, slope = np.sin(x) ** 2, np.sin(2 * x)
    samples = PairSamples(
        phi,
        i,
        s * a**2 * b**3,
        slope * a**2 * b**3,
        2 * s * a * b**3,
        3 * s * a**2 * b**2,
    )
    table = pair_table(samples, 4, tolerance=1e-9)
    assert table.rank == 2
    at = table.f[:, 1:]
    again = np.einsum("npq,pa,qb->nab", table.slope, at, at)
    assert 4 * again == pytest.approx(samples.tau, abs=1e-9)


def test_a_table_is_judged_up_to_its_last_current_and_not_by_the_line_past_it():
    """W = k a^2 b^2: at a = b the inductances are L + 2 k a^2, and L past the last current, where f
    is a straight line; the mutual one is 4 k a^2 in both."""
    machine = machine_from(machine_table("onelab_6_4", MACHINES))
    i_max, phi = machine.i_max_A, np.linspace(0, np.pi, 13)
    theta_e = np.linspace(0, 2 * np.pi, 181)
    L = _core.magnetics(machine.magnetics, np.full(181, i_max * (1 - 1e-9)), theta_e)[:, 3].min()

    def judged(part):
        i = i_max * np.arange(1, 8) / 7
        x, a, b = np.meshgrid(phi, i, i, indexing="ij")
        k, h = part * L / i_max**2, 1 + 1e-3 * np.cos(x)
        samples = PairSamples(
            phi,
            i,
            k * h * a**2 * b**2,
            -4 * k * 1e-3 * np.sin(x) * a**2 * b**2,
            2 * k * h * a * b**2,
            2 * k * h * a**2 * b,
        )
        alike = pair_table(samples, 4, tolerance=1e-9)
        pairs = tuple(Neighbours(n, (n + 1) % 3, alike) for n in range(3))
        check_pairs(Coupling(3, pairs), machine.magnetics, i_max)

    judged(0.8)
    with pytest.raises(ParameterError, match="the least eigenvalue"):
        judged(3.0)


A, B, C = object(), object(), object()  # tables of pairs, told apart as they are


def pairs_of(n_phases, *tables):
    """Each phase with the next: the tables in turn."""
    pairs = [Neighbours(k, (k + 1) % n_phases, tables[k % len(tables)]) for k in range(n_phases)]
    return Coupling(n_phases, tuple(pairs))


def test_phases_are_alike_where_each_sees_the_same_neighbours():
    assert pairs_of(3, A).is_alike and pairs_of(4, A).is_alike
    assert not pairs_of(3, A, A, B).is_alike and not pairs_of(4, A, B).is_alike
    missing = replace(pairs_of(3, A), pairs=pairs_of(3, A).pairs[:2])
    assert not missing.is_alike


def test_a_winding_in_reverse_order_is_the_same_winding_where_a_phase_mirrors_it():
    """Reversed twice it is itself; the mirror m has pair (k, k + 1) in the place (m-k-1, m-k)."""
    for coupling in (
        pairs_of(3, A),
        pairs_of(3, A, A, B),
        pairs_of(4, A, B),
        pairs_of(4, A, A, A, B),
    ):
        again = coupling.reversed.reversed
        assert {(p.first, p.second, p.table) for p in again.pairs} == {
            (p.first, p.second, p.table) for p in coupling.pairs
        }
        m = coupling.mirror
        assert m is not None
        of = {(p.first, p.second): p.table for p in coupling.pairs}
        n = coupling.n_phases
        for (a, b), table in of.items():
            assert of[(m - b) % n, (m - a) % n] is table
    assert pairs_of(3, A, B, C).mirror is None


def test_a_factor_multiplies_what_was_there_and_one_changes_nothing():
    coupling = pairs_of(3, A)
    assert coupling.times(1.0) is coupling
    assert coupling.times(0.5).times(3.0).factor == pytest.approx(1.5)
    assert pairs_of(3, A).pairs[2].letters == "ca"


@pytest.mark.parametrize(
    ("first", "second", "n", "degrees"),
    [(0, 1, 3, 60), (1, 2, 3, 180), (2, 0, 3, 300), (0, 1, 4, 45)],
)
def test_a_pair_lies_half_way_between_its_phases(first, second, n, degrees):
    assert np.degrees(behind(first, second, n)) == pytest.approx(degrees)


class Unlike:
    rank = 1

    def __init__(self, angles, end):
        self.phi, self.i = np.zeros(angles), np.array([0.0, end])


def test_tables_of_one_machine_have_the_same_angles_and_end():
    unlike = [Unlike(5, 9.0), Unlike(6, 9.0), Unlike(5, 8.0)]
    for other in unlike[1:]:
        with pytest.raises(ParameterError, match="differ in their angles or in their last current"):
            pairs_of(3, unlike[0], unlike[0], other)._made()
    assert pairs_of(3, *unlike).i_last == 8
