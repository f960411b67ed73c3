"""Laws that compute with pairs of phases themselves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from coupled import I_MAX, SENSED, WORKING, Formula, N_r, coupling, machine_file, table

import reluctance as rl
from reluctance import _core
from reluctance.machine.coupling import Coupling, Neighbours
from reluctance.machine.maps.pairs import mean_table, pair_table

EXAMPLES = Path(__file__).parents[2] / "examples"
PAIRS = {
    "add": coupling(),
    "take": coupling(-0.2),
    "unlike": Coupling(
        3, tuple(Neighbours(k, (k + 1) % 3, table(K)) for k, K in enumerate((-0.2, -0.2, 0.15)))
    ),
}


# Law and pairs, and how much greater the error may be than without pairs. One guide serves unlike
# neighbours, and finite_set_mpc keeps close to it; deadbeat follows it where shares need too much.
CASES = [
    ("edge_mpc_mcu", "take", 1.25),
    pytest.param("edge_mpc_mcu", "add", 1.25, marks=pytest.mark.long),
    pytest.param("edge_mpc_mcu", "unlike", 1.25, marks=pytest.mark.long),
    pytest.param("finite_set_mpc", "take", 1.25, marks=pytest.mark.long),
    pytest.param("finite_set_mpc", "add", 1.25, marks=pytest.mark.long),
    pytest.param("finite_set_mpc", "unlike", 1.5, marks=pytest.mark.long),
    pytest.param("deadbeat", "take", 1.25, marks=pytest.mark.long),
    pytest.param("deadbeat", "unlike", 2.2, marks=pytest.mark.long),
    pytest.param("ditc", "take", 1.25, marks=pytest.mark.long),
    pytest.param("sharing_cubic", "add", 1.25, marks=pytest.mark.long),
    pytest.param("edge_mpc_fpga", "take", 1.25, marks=pytest.mark.long),  # of least ripple
]


def drive(machine, example, **more):
    sensed = SENSED if example == "edge_mpc_mcu" else []
    overrides = [f"machine={machine}", *WORKING, *sensed]
    return rl.load(EXAMPLES / f"{example}.toml", overrides).with_values(more)


def errors(given):
    """Rms torque errors uncoupled, blind and aware [1]."""
    changes = ({"machine.pair_factor": 0.0}, {"control.pair_torque": False}, {})
    found = [
        rl.simulate(given.with_values(change), until=0.06, record=None).kpis.torque_error_rms
        for change in changes
    ]
    print("uncoupled, blind, aware [%]:", *(f"{100 * x:.3f}" for x in found))
    return found


@pytest.mark.parametrize(("example", "pairs", "most"), CASES)
def test_the_torque_is_as_smooth_as_on_phases_that_do_not_couple(example, pairs, most, tmp_path):
    uncoupled, blind, aware = errors(drive(machine_file(tmp_path, PAIRS[pairs]), example))
    if "mpc" in example:  # the others have more error of their own
        assert blind > 3 * uncoupled
    assert aware < most * uncoupled


def test_a_negative_torque_is_the_mirror_image(tmp_path):
    """Torque and speed reversed: the same errors; the pairs are turned round with the rest."""
    given = drive(machine_file(tmp_path, coupling(-0.2)), "edge_mpc_mcu")
    turned = given.with_values({"load.speed_rpm": -1500.0, "reference.tau_Nm": -2.5})
    ahead, back = (
        rl.simulate(x, until=0.06, record=None).kpis.torque_error_rms for x in (given, turned)
    )
    assert back == pytest.approx(ahead, rel=0.1)


@pytest.mark.long
def test_weak_pairs_change_little(tmp_path):
    """The law of pairs with hardly any is the law without them, to what their guides differ by."""
    given = drive(machine_file(tmp_path), "edge_mpc_mcu")
    ripple = [
        rl.simulate(
            given.with_values({"machine.pair_factor": x}), until=0.04, record=None
        ).kpis.torque_error_rms
        for x in (0.0, 1e-6)
    ]
    assert ripple[1] == pytest.approx(ripple[0], rel=0.02)


def test_the_mean_table_is_the_mean_of_the_tables():
    other = pair_table(Formula(0.15).samples(angles=19, currents=9), N_r, tolerance=1e-9)
    kinds = [table(-0.2)] * 2 + [other]  # which has other nodes
    mean = mean_table(kinds)
    random = np.random.default_rng(5)
    phi, a, b = random.uniform(-np.pi, np.pi, 40), *random.uniform(0, I_MAX, (2, 40))
    for name in ("energy", "tau", "psi_first", "L_mutual"):
        expected = np.mean([getattr(kind.at(phi, a, b), name) for kind in kinds], axis=0)
        np.testing.assert_allclose(getattr(mean.at(phi, a, b), name), expected, atol=2e-4)


def test_all_phases_are_alike_with_the_mean_of_their_neighbours():
    alike = PAIRS["unlike"].alike
    assert len({pair.table for pair in alike.pairs}) == 1
    assert [(p.first, p.second) for p in alike.pairs] == [(0, 1), (1, 2), (2, 0)]
    same = PAIRS["take"].alike
    assert same.pairs == PAIRS["take"].pairs


def test_a_law_of_pairs_needs_a_machine_that_may_have_them():
    law = dict(horizon=1, w_psi=[0.0], feedback=[0.0], w_i=0.0, w_sw=1.0, t_end=1e-5)
    guide = _core.ReferenceProfile(np.zeros((1, 2, 3)), tau_max=1.0, omega_m=[0.0], u_dc=1.0)
    known = rl.load(EXAMPLES / "finite_set_mpc.toml").known()
    with pytest.raises(ValueError, match="no pairs"):
        _core.coupled_finite_set_mpc(
            *(known.magnetics, 3, False),
            pairs=PAIRS["add"].core,
            guide=guide,
            **law,
            R=1.0,
            i_max=1.0,
            T_s=1e-5,
            delay=0,
        )
