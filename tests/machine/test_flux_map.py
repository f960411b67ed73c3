"""Laws of the flux map: one co-energy function, as accurate as its table, rising everywhere."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from reluctance import _core, _core_parts
from reluctance.machine.maps import FluxTable, fit_surface, surface

PAPER = _core.LeHuy(N_r=4, L_u=0.67e-3, L_a=23.62e-3, L_sat=0.15e-3, i_m=450.0, psi_m=0.468)
PSI, W_C, TAU, L_INC, PSI_THETA = range(5)


def grid(i, theta_e):
    return [x.ravel() for x in np.meshgrid(i, theta_e, indexing="ij")]


def sampled(i, theta_e):
    """The paper's machine as a table."""
    y = _core.magnetics(PAPER, *grid(i, theta_e)).reshape(len(i), len(theta_e), 5)
    return FluxTable(4, i, theta_e, y[:, :, PSI], y[:, :, TAU])


def leaning(i, theta_e):
    """A machine without symmetry: saturation and a torque curve that leans to one side."""
    shape = (1 - np.cos(theta_e - 0.15 * np.sin(theta_e) ** 2)) / 2
    psi = 2e-3 * i[:, None] + 0.3 * (1 - np.exp(-i[:, None] / 30)) * shape
    return FluxTable(6, i, theta_e, psi)


MAP = surface(sampled(np.linspace(0, 150, 46), np.linspace(0, np.pi, 31)))
WHOLE = surface(
    leaning(np.linspace(0, 100, 21), np.linspace(0, 2 * np.pi, 49)[:-1]), symmetric=False
)

currents = st.floats(0, 260)  # beyond the table too
angles = st.floats(0, 2 * np.pi, exclude_max=True)
machines = st.sampled_from([MAP, WHOLE])


def at(machine, i, theta_e):
    return machine.magnetics(np.array([i]), np.array([theta_e]))[0]


@pytest.mark.parametrize(
    ("i", "n_theta"),
    [
        (np.linspace(0, 450, 46), 31),
        (np.linspace(0, 450, 31), 46),
        (np.linspace(0, 150, 46), 31),
        (np.linspace(0, 150, 31), 46),
        (450 * np.linspace(0, 1, 31) ** 2, 46),
    ],
)
def test_a_sampled_machine_comes_back(i, n_theta):
    machine = surface(sampled(i, np.linspace(0, np.pi, n_theta)))
    points = grid(np.linspace(0, i[-1], 301), np.linspace(0, 2 * np.pi, 181)[:-1])
    ours, exact = machine.magnetics(*points), _core.magnetics(PAPER, *points)
    assert np.abs(ours - exact)[:, TAU].max() < 1e-4 * np.abs(exact[:, TAU]).max()
    assert np.abs(ours[:, L_INC] / exact[:, L_INC] - 1).max() < 0.01
    assert np.abs(ours - exact)[:, PSI].max() < 1e-3 * exact[:, PSI].max()


@settings(deadline=None)
@given(machine=machines, i=currents, theta_e=angles)
def test_all_outputs_are_derivatives_of_one_coenergy(machine, i, theta_e):
    h_i, h = 1e-3, 1e-4
    scale = np.abs(at(machine, machine.i_last, np.pi / 2)) + np.abs(at(machine, 10.0, np.pi))
    here = at(machine, i + h_i, theta_e)
    up, down = at(machine, i + 2 * h_i, theta_e), at(machine, i, theta_e)
    ahead = at(machine, i + h_i, theta_e + h)
    behind = at(machine, i + h_i, (theta_e - h) % (2 * np.pi))
    by_i = (up - down) / (2 * h_i)
    by_theta_m = (ahead - behind) / (2 * h) * machine.N_r
    assert by_i[W_C] == pytest.approx(here[PSI], abs=1e-5 * scale[PSI])
    assert by_i[PSI] == pytest.approx(here[L_INC], abs=1e-3 * scale[L_INC])
    assert by_i[TAU] == pytest.approx(here[PSI_THETA], abs=1e-4 * scale[PSI_THETA])
    assert by_theta_m[W_C] == pytest.approx(here[TAU], abs=1e-4 * scale[TAU])
    assert by_theta_m[PSI] == pytest.approx(here[PSI_THETA], abs=1e-4 * scale[PSI_THETA])


@settings(deadline=None)
@given(machine=machines, i=currents, theta_e=angles)
def test_inductance_stays_above_its_proven_bound(machine, i, theta_e):
    assert machine.inductance_bound > 0
    assert at(machine, i, theta_e)[L_INC] >= machine.inductance_bound * (1 - 1e-12)


@given(machine=machines, theta_e=angles)
def test_no_current_makes_no_flux_and_no_torque(machine, theta_e):
    psi, W_c, tau, _, psi_theta = at(machine, 0.0, theta_e)
    assert (psi, W_c, tau, psi_theta) == (0, 0, 0, 0)


@given(i=currents)
def test_a_symmetric_map_has_no_torque_at_unaligned_and_aligned(i):
    for theta_e in (0.0, np.pi):
        assert at(MAP, i, theta_e)[TAU] == 0
        assert at(MAP, i, theta_e)[PSI_THETA] == 0


@settings(deadline=None)
@given(i=currents, theta_e=st.floats(0.01, np.pi))
def test_a_symmetric_map_mirrors(i, theta_e):
    one, other = at(MAP, i, theta_e), at(MAP, i, 2 * np.pi - theta_e)
    scale = np.abs(at(MAP, 150.0, np.pi / 2)) + 1e-3
    assert np.abs(one - other * [1, 1, -1, 1, -1]).max(initial=0, where=scale > 0) < 1e-9 * max(
        scale.max(), 1
    )


@settings(deadline=None)
@given(machine=machines, excess=st.floats(0, 200), theta_e=angles)
def test_past_the_table_flux_keeps_its_last_slope(machine, excess, theta_e):
    last = at(machine, machine.i_last, theta_e)
    beyond = at(machine, machine.i_last + excess, theta_e)
    assert beyond[L_INC] == pytest.approx(last[L_INC], rel=1e-9)
    assert beyond[PSI] == pytest.approx(last[PSI] + excess * last[L_INC], rel=1e-9)


def test_second_derivatives_are_continuous_across_every_knot():
    theta_e = np.linspace(0, 2 * np.pi, 50)[:-1]
    for machine in (MAP, WHOLE):
        for knot in machine.knots[1:]:
            below = machine.magnetics(np.full(49, knot * (1 - 1e-12)), theta_e)
            above = machine.magnetics(np.full(49, knot * (1 + 1e-12)), theta_e)
            assert np.abs(above - below).max() <= 1e-8 * np.abs(above).max()
            assert np.allclose(above[:, L_INC], below[:, L_INC], rtol=1e-8)


def test_a_whole_period_keeps_its_two_sides():
    i, theta_e = np.linspace(0, 100, 33), np.linspace(0, 2 * np.pi, 101)[:-1]
    exact = leaning(i, theta_e).psi.ravel()
    ours = WHOLE.magnetics(*grid(i, theta_e))[:, PSI]
    assert np.abs(ours - exact).max() < 1e-4 * exact.max()
    left, right = at(WHOLE, 50.0, 1.0), at(WHOLE, 50.0, 2 * np.pi - 1.0)
    assert abs(left[PSI] - right[PSI]) > 0.02 * exact.max()


@settings(deadline=None)
@given(machine=machines, i=st.floats(0, 99), theta_e=angles)
def test_current_from_flux_inverts_flux(machine, i, theta_e):
    psi = at(machine, i, theta_e)[PSI]
    current = machine.current(np.array([psi]), np.array([theta_e]), 100.0)
    assert current[0] == pytest.approx(i, abs=1e-9)
    single = _core_parts.current_single(machine, np.array([psi]), np.array([theta_e]), 100.0)
    assert at(machine, single[0], theta_e)[PSI] == pytest.approx(psi, abs=2e-7)


def test_flux_out_of_reach_gives_the_nearer_end():
    ends = MAP.current(np.array([-0.1, 0.0, 9.0, np.nan]), np.full(4, 2.0), 120.0)
    assert list(ends) == [0, 0, 120, 0]


def test_float_differs_from_double_by_rounding_only():
    points = grid(np.linspace(0, 200, 97), np.linspace(0, 2 * np.pi, 91)[:-1])
    double, single = _core.magnetics(MAP, *points), _core_parts.magnetics_single(MAP, *points)
    assert np.all(np.abs(single - double).max(axis=0) < 1e-5 * np.abs(double).max(axis=0))
    assert np.abs(single[:, L_INC] / double[:, L_INC] - 1).max() < 1e-4


def test_a_table_that_would_not_be_a_machine_is_refused():
    fitted = fit_surface(sampled(np.linspace(0, 150, 20), np.linspace(0, np.pi, 17)))
    parts = dict(N_r=4, knots=fitted.knots, theta_span=np.pi)
    good = fitted.coefficients
    falling, magnet, hole = good.copy(), good.copy(), good.copy()
    falling[3, 5, 2] *= -1
    magnet[0, :, 1] = 0.01
    hole[2, 2, 2] = np.nan
    for bad, word in ((falling, "inductance"), (magnet, "zero current"), (hole, "finite")):
        with pytest.raises(ValueError, match=word):
            _core.FluxMap(coefficients=bad, **parts)
    with pytest.raises(ValueError, match="rise"):
        _core.FluxMap(coefficients=good, **(parts | dict(knots=fitted.knots * 0)))
