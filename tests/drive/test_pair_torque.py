"""The torque of pairs of phases, taken off what a controller asks of its law."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from coupled import I_MAX, WORKING, machine_file

import reluctance as rl
from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.drive.laws.own_law import core_of

EXAMPLES = Path(__file__).parents[2] / "examples"


def on_the_coupled_machine(folder, example, pairs=None):
    """An example whose law leaves the pairs to the controller, with the machine of `coupled`."""
    machine = machine_file(folder, pairs)
    path = folder / f"{example}.toml"
    text = (EXAMPLES / f"{example}.toml").read_text()
    path.write_text(text.replace('machine = "paper_6_4"', f'machine = "{machine}"'))
    return path


class Asked(rl.Law):
    """Keeps what it is asked for."""

    def __init__(self):
        self.seen = []

    def step(self, y, tau_ref):
        self.seen.append(tau_ref)
        return [rl.Order.hold(rl.Leg.freewheel)] * y.n_phases


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return on_the_coupled_machine(tmp_path_factory.mktemp("coupled"), "pwm_current")


def asked(given, i, theta_e, reference):
    law = Asked()
    known = given.known()
    controller = _core.Controller(core_of(law, known), given.frame(known), given.pairs(known))
    y = _core.Measurement(i=i, theta_e=theta_e, omega_m=100.0, u_dc=160.0)
    orders = _core.step(controller, y, reference)
    assert orders[-1] == reference  # in the record stands what the drive was asked for
    return law.seen[-1]


def test_the_law_is_asked_for_the_rest(file):
    given = rl.load(file, WORKING)
    pairs = given.machine.coupling
    random = np.random.default_rng(3)
    cut = 0
    for reference in (2.0, -2.0, 0.1, -0.1):
        for _ in range(50):
            i, theta_e = random.uniform(0, I_MAX, 3), random.uniform(0, 2 * np.pi)
            left = reference - float(pairs.tau(i, theta_e))
            if left * reference < 0:
                left, cut = 0.0, cut + 1
            assert asked(given, list(i), theta_e, reference) == pytest.approx(left, abs=1e-12)
    assert 0 < cut < 100


@pytest.mark.parametrize(
    ("example", "by_itself"),
    [
        ("pwm_current", False),
        ("sharing_cubic", True),
        ("deadbeat", True),
        ("ditc", True),
        ("finite_set_mpc", True),
        ("paper_rated", True),
        ("edge_mpc_mcu", True),
    ],
)
def test_the_pairs_are_known_once_to_the_law_or_to_the_controller(tmp_path, example, by_itself):
    given = rl.load(on_the_coupled_machine(tmp_path, example), WORKING)
    assert given.pairs_known
    assert (given.pairs(given.known()) is None) == by_itself


def test_zero_stays_zero_and_the_key_turns_it_off(file):
    given = rl.load(file, WORKING)
    i = [9.0, 11.0, 0.0]
    assert asked(given, i, 2.5, 0.0) == 0
    assert asked(given, i, 2.5, 2.0) != 2
    blind = given.with_values({"control.pair_torque": False})
    assert asked(blind, i, 2.5, 2.0) == 2


def test_a_wrong_belief_takes_off_what_it_believes(file):
    given = rl.load(file, WORKING)
    i, theta_e = [9.0, 11.0, 4.0], 2.0
    tau = float(given.machine.coupling.tau(i, theta_e))
    assert abs(tau) > 0.05
    for changed, part in (
        ({"mismatch.pair_factor": 0.8}, 0.8),
        ({"mismatch.flux_factor": 1.1}, 1.1),
    ):
        found = asked(given.with_values(changed), i, theta_e, 2.0)
        assert found == pytest.approx(2.0 - part * tau, abs=1e-12)
    none = given.with_values({"mismatch.pair_factor": 0.0})
    assert asked(none, i, theta_e, 2.0) == 2


def test_a_belief_about_pairs_needs_pairs():
    with pytest.raises(ParameterError, match="phases do not couple"):
        rl.load(EXAMPLES / "sharing_cubic.toml", ["mismatch.pair_factor=0.9"]).known()


@pytest.mark.long
def test_a_supervised_drive_knows_the_pairs_too(tmp_path):
    given = rl.load(on_the_coupled_machine(tmp_path, "deadbeat"), WORKING)
    errors = []
    for change in ({}, {"control.pair_torque": False}):  # at 10 us, for the time
        supervised = replace(
            given.with_values({"control.T_s_us": 10.0, **change}),
            supervision=rl.Supervision(enable_s=0.0),
        )
        result = rl.simulate(supervised, until=0.25, record=None)
        assert result.events[-1].mode == "run"
        errors.append(result.kpis.torque_error_rms)
    assert errors[0] < 0.8 * errors[1]


def test_a_saved_drive_takes_its_pairs_along(file, tmp_path):
    given = rl.load(file, WORKING)
    (tmp_path / "there").mkdir()
    given.save(tmp_path / "there" / "drive.toml")
    again = rl.load(tmp_path / "there" / "drive.toml")
    assert again.machine.coupled
    runs = [rl.simulate(x, until=0.003, record=None).periods.values for x in (given, again)]
    assert runs[0].tobytes() == runs[1].tobytes()
