"""Which couplings a machine can have."""

import numpy as np
import pytest
from coupled import MACHINES

from reluctance import ParameterError, _core
from reluctance.machine.coupling import Coupling, Neighbours, check_pairs
from reluctance.machine.library import machine_from, machine_table
from reluctance.machine.maps.pairs import PairSamples, pair_table


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
