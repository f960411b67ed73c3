"""Predictive laws that compute with pairs of phases themselves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from coupled import I_MAX, N_r, coupling, machine_file, table

import reluctance as rl
from reluctance import _core
from reluctance.machine.coupling import Coupling, Neighbours
from reluctance.machine.maps.pairs import mean_table
from test_pair_torque import EXAMPLES, WORKING

PAIRS = {
    "add": coupling(),
    "take": coupling(-0.2),
    "unlike": Coupling(
        3, tuple(Neighbours(k, (k + 1) % 3, table(K)) for k, K in enumerate((-0.2, -0.2, 0.15)))
    ),
}


@pytest.fixture(scope="module", params=list(PAIRS))
def machine(request, tmp_path_factory):
    return machine_file(tmp_path_factory.mktemp(request.param), PAIRS[request.param])


def drive(machine, example, **more):
    overrides = [f"machine={machine}", *WORKING]
    if example == "edge_mpc_mcu":
        overrides.append("sensing.i_range_A=20")
    return rl.load(EXAMPLES / f"{example}.toml", overrides).with_values(more)


@pytest.mark.parametrize("example", ["edge_mpc_mcu", "edge_mpc_fpga", "finite_set_mpc"])
def test_the_torque_is_as_smooth_as_on_phases_that_do_not_couple(machine, example):
    given = drive(machine, example)
    changes = ({"machine.pair_factor": 0.0}, {"control.pair_torque": False}, {})
    errors = [
        rl.simulate(given.with_values(change), until=0.06, record=None).kpis.torque_error_rms
        for change in changes
    ]
    print(machine.parent.name, example, *(f"{100 * x:.3f}" for x in errors))
    assert errors[1] > 3 * errors[0]
    assert errors[2] < 1.25 * errors[0]
