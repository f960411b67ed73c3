"""Pulses: the speed above which they cannot be full, and where currents are computed."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import reluctance as rl
from reluctance import _core
from reluctance.drive.laws import pulse_table
from reluctance.drive.laws.angle_table import AngleTable
from reluctance.drive.laws.pulses import full_flux_speed, period

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture
def known():
    return rl.load(EXAMPLES / "angle_table.toml").known()


def test_a_period_is_that_of_one_rotor_pole(known):
    """1500 rpm and four rotor poles: 10 ms."""
    assert period(replace(known, omega_m=50 * np.pi)) == pytest.approx(10e-3)


def test_at_the_full_flux_speed_half_a_period_builds_up_the_greatest_flux_linkage(known):
    speed = full_flux_speed(known)
    most = _core.magnetics(known.magnetics, np.array([known.i_max]), np.array([np.pi]))[0, 0]
    assert known.u_dc * period(replace(known, omega_m=speed)) / 2 == pytest.approx(most)


def nodes(monkeypatch, known, omega, tau):
    """Speeds [rad/s] and torques [N m] that `pulse_table` computes currents at."""
    angles = AngleTable(np.array(omega), np.array(tau), *np.zeros((2, len(omega), len(tau))))
    seen = []

    def noted(kind, inputs, compute, algorithm):
        seen.extend(value for value in inputs if isinstance(value, list))
        return kind(np.zeros((len(seen[-4]), len(seen[-3]))))

    monkeypatch.setattr(pulse_table, "cached", noted)
    pulse_table.pulse_table(known, angles, 1.0, hard=False)
    return [np.array(values) for values in seen[-4:-2]]


@pytest.mark.parametrize(("working", "between"), [(130.0, True), (90.0, False), (450.0, False)])
def test_speeds_are_those_of_the_table_the_working_one_and_some_between(
    monkeypatch, known, working, between
):
    """Nowhere farther apart than an eighth of the greatest; none outside of the table."""
    omega = [100.0, 160.0, 400.0]
    found, _ = nodes(monkeypatch, replace(known, omega_m=working), omega, [10.0, 40.0])
    assert {*omega} <= {*found.tolist()}
    assert (working in found) == between
    assert found[0] == 100 and found[-1] == 400
    assert (np.diff(found) > 0).all() and np.diff(found).max() <= 400 / 8 + 1e-9


@pytest.mark.parametrize(("tau_max", "top"), [(30.0, 40.0), (55.0, 55.0)])
def test_torques_lie_closer_where_they_are_small_and_hold_those_of_the_table(
    monkeypatch, known, tau_max, top
):
    """Twelve steps of their square root, without those next to one of the table's."""
    _, found = nodes(monkeypatch, replace(known, tau_max=tau_max), [100.0, 200.0], [10.0, 40.0])
    assert found[0] == 0 and found[-1] == top and {10.0, 40.0} <= {*found.tolist()}
    steps = top * (np.arange(13) / 12) ** 2
    for torque in steps[1:-1]:
        off = np.abs(torque - np.array([10.0, 40.0])).min()
        assert (np.abs(found - torque).min() < 1e-12) == (off < 1e-12 or off > 0.02 * top)
