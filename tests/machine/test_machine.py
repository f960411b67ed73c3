"""Laws of the machine model: one co-energy function and its derivatives."""

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reluctance import _core, _core_parts

GENERIC = _core.LeHuy(N_r=4, L_u=0.67e-3, L_a=23.6e-3, L_sat=0.15e-3, i_m=450, psi_m=0.486)
PAPER = _core.LeHuy(N_r=4, L_u=0.67e-3, L_a=23.62e-3, L_sat=0.15e-3, i_m=450, psi_m=0.468)
PSI, W_C, TAU, L_INC, PSI_THETA = range(5)

currents = st.floats(0.0, 450.0)
angles = st.floats(0.0, 2 * np.pi, exclude_max=True)
machines = st.sampled_from([GENERIC, PAPER])


def at(machine, i, theta_e):
    i, theta_e = np.broadcast_arrays(np.asarray(i, float), np.asarray(theta_e, float))
    return _core.magnetics(machine, i.ravel().copy(), theta_e.ravel().copy())


# Check values of the generic machine: published defaults, recomputed by hand to five digits.
# Current, flux linkage aligned / in the middle / unaligned, torque in the middle.
CHECK_VALUES = [
    (10, 0.18103, 0.09386, 0.00670, 1.824),
    (20, 0.28504, 0.14922, 0.01340, 6.174),
    (50, 0.40059, 0.21705, 0.03350, 25.324),
    (100, 0.43196, 0.24948, 0.06700, 60.750),
    (150, 0.44091, 0.27070, 0.10050, 94.458),
    (200, 0.44849, 0.29125, 0.13400, 125.729),
    (300, 0.46350, 0.33225, 0.20100, 180.828),
    (450, 0.48600, 0.39375, 0.30150, 244.856),
]


@pytest.mark.parametrize(("i", "aligned", "middle", "unaligned", "tau"), CHECK_VALUES)
def test_generic_machine_has_the_published_values(i, aligned, middle, unaligned, tau):
    values = at(GENERIC, i, [np.pi, np.pi / 2, 0.0])
    assert values[:, PSI] == pytest.approx([aligned, middle, unaligned], abs=6e-6)
    assert values[1, TAU] == pytest.approx(tau, abs=6e-4)


def test_parameters_follow_from_the_datasheet():
    assert pytest.approx(0.4185, rel=1e-12) == GENERIC.A
    assert pytest.approx(0.0560335, rel=1e-6) == GENERIC.B


@given(machines, currents, angles)
def test_flux_and_torque_are_the_derivatives_of_coenergy(machine, i, theta_e):
    h = 1e-4
    i = max(i, h)
    value = at(machine, i, theta_e)[0]
    by_i = at(machine, [i - h, i + h], theta_e)
    by_angle = at(machine, i, theta_e + np.array([-h, h]))
    assert np.diff(by_i[:, W_C])[0] / (2 * h) == pytest.approx(value[PSI], abs=2e-8)
    assert np.diff(by_i[:, PSI])[0] / (2 * h) == pytest.approx(value[L_INC], abs=2e-8)
    per_mechanical = machine.N_r / (2 * h)
    assert np.diff(by_angle[:, W_C])[0] * per_mechanical == pytest.approx(value[TAU], abs=2e-4)
    assert np.diff(by_angle[:, PSI])[0] * per_mechanical == pytest.approx(
        value[PSI_THETA], abs=2e-6
    )
    assert np.diff(by_i[:, TAU])[0] / (2 * h) == pytest.approx(value[PSI_THETA], abs=1e-6)


@given(machines, currents, angles)
def test_flux_rises_with_current(machine, i, theta_e):
    assert at(machine, i, theta_e)[0, L_INC] > 0


@given(machines, currents, angles)
def test_flux_is_even_and_torque_odd_about_aligned(machine, i, theta_e):
    before, after = at(machine, i, [theta_e, 2 * np.pi - theta_e])
    assert after[PSI] == pytest.approx(before[PSI], rel=1e-9, abs=1e-12)
    assert after[TAU] == pytest.approx(-before[TAU], rel=1e-9, abs=1e-9)


@given(machines, currents)
def test_torque_motors_before_aligned_and_vanishes_at_both_positions(machine, i):
    values = at(machine, i, np.linspace(0, np.pi, 37))
    assert np.all(values[:, TAU] > -1e-12)  # rounding near zero current
    assert values[[0, -1], TAU] == pytest.approx(0, abs=1e-9)


def test_torque_of_a_flat_top_is_the_coenergy_between_its_angles():
    # 200 A from 45 to 75 deg before alignment: 48.764 J a stroke, 12 strokes a revolution.
    theta_e = np.radians([0.0, 120.0])
    stroke = np.diff(at(GENERIC, 200.0, theta_e)[:, W_C])[0]
    assert stroke == pytest.approx(48.764, abs=1e-3)
    assert 12 * stroke / (2 * np.pi) == pytest.approx(93.1323, abs=1e-3)


@given(st.floats(-80.0, 80.0, exclude_min=True))
def test_exponential_is_within_two_ulp(x):
    mpmath.mp.dps = 30
    ours = _core_parts.exp(x)
    exact = mpmath.exp(mpmath.mpf(x))
    assert abs(ours - exact) <= 2 * np.spacing(float(exact))


@given(st.floats(-1e5, 1e5))
def test_angles_wrap_into_one_turn(theta):
    wrapped = _core_parts.wrap(theta)
    assert 0 <= wrapped < 2 * np.pi
    assert np.exp(1j * wrapped) == pytest.approx(np.exp(1j * theta), abs=1e-10)


@given(st.integers(-1000, 1000), st.integers(-3, 3))
def test_multiples_of_a_turn_do_not_wrap_past_its_edges(turns, ulps):
    theta = np.float32(turns) * np.float32(2 * np.pi)
    for _ in range(abs(ulps)):
        theta = np.nextafter(theta, np.float32(np.sign(ulps) * np.inf))
    assert 0 <= _core.wrap_float(float(theta)) < np.float32(2 * np.pi)


@pytest.mark.parametrize("theta", [np.nan, np.inf, -np.inf, 1e30])
def test_an_impossible_angle_wraps_to_zero(theta):
    assert _core_parts.wrap(theta) == 0
