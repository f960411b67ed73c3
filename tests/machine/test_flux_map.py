"""Laws of the flux map: one co-energy function, as accurate as its table, rising everywhere."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Chebyshev
from scipy.interpolate import BSpline

from reluctance import ParameterError, _core, _core_parts
from reluctance.machine.maps import FluxTable, fit_surface, surface
from reluctance.machine.maps.surface import _inductance, rising

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


def test_a_rotor_of_one_pole_is_one():
    table = sampled(np.linspace(0, 150, 16), np.linspace(0, np.pi, 13))
    assert FluxTable(1, table.i, table.theta_e, table.psi).N_r == 1


def test_four_angles_of_a_whole_period_are_no_half_of_one():
    psi = np.outer(np.arange(4.0), [1.0, 2.0, 3.0, 2.0])
    theta_e = np.pi / 2 * np.arange(4)
    assert not FluxTable(4, np.arange(4.0), theta_e, psi).half
    assert FluxTable(4, np.arange(4.0), theta_e * 2 / 3, psi).half


@pytest.mark.parametrize(("bend", "resolved"), [(0.5, True), (0.7, True), (0.9, False)])
def test_a_quintic_is_taken_where_it_differs_by_a_hundredth_from_a_cubic(bend, resolved):
    """Flux linkage of degree 5 over eight currents: then exact, to what few pieces leave; midway
    between the samples the cubic is off by 0.6, 0.85 and 1.1 % of the greatest."""
    L = Chebyshev([1, 0, 0, 0, bend], domain=[0, 10])
    i, between = np.linspace(0, 10, 8), np.linspace(0, 10, 101)
    found, _ = _inductance(i, L.integ(lbnd=0)(i)[:, None] * [1.0, 0.5])
    off = np.abs(found(between) / L(between)[:, None] / [1.0, 0.5] - 1).max()
    assert off < 0.002 if resolved else off > 0.1


def test_cells_of_the_angle_are_those_of_the_samples():
    """Of half a period, and of a whole one whose sides differ; a cubic has three more."""
    half = sampled(np.linspace(0, 150, 8), np.linspace(0, np.pi, 31))
    assert fit_surface(half).coefficients.shape[1:] == (30 + 3, 5)
    whole = leaning(np.linspace(0, 100, 8), np.linspace(0, 2 * np.pi, 49)[:-1])
    fitted = fit_surface(whole, symmetric=False)
    assert fitted.coefficients.shape[1:] == (48 + 3, 5) and fitted.theta_span == 2 * np.pi
    assert fit_surface(whole).coefficients.shape[1:] == (24 + 3, 5)


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


T = np.array([0.0, 0, 0, 3, 7, 15, 15, 15])  # knots of five coefficients
UNEVEN = np.array([0, 0.5, 1, 2, 3, 5, 6, 8, 9, 11, 13, 15])


def rises(i):
    """Flux at i of each coefficient on T: integrals of B-splines, by the trapezoid rule."""
    fine = np.linspace(0, 15, 150_001)
    columns = []
    for n in range(5):
        B = np.nan_to_num(BSpline.basis_element(T[n : n + 4], extrapolate=False)(fine))
        columns.append(np.interp(i, fine, np.append(0, np.cumsum((B[1:] + B[:-1]) / 2) * 1e-4)))
    return np.stack(columns, axis=1)


def test_flux_that_rises_is_gone_through_by_its_own_inductance():
    c = np.array([[0.3, 0.25, 0.1, 0.04, 0.02], [0.1, 0.12, 0.08, 0.08, 0.01]]).T
    found = rising(UNEVEN, rises(UNEVEN) @ c, T)
    assert found.c == pytest.approx(c, rel=1e-4) and found.k == 2
    steep, weight = 1e3 * c + [[0], [0], [0], [-1], [0]], np.linspace(1, 2, 11)
    found = rising(UNEVEN, rises(UNEVEN) @ steep, T, weight=weight)
    assert found.c == pytest.approx(steep, rel=1e-4)


def test_flux_that_falls_has_the_nearest_inductance_above_a_thousandth_of_the_largest():
    """At the least of weighed squares and roughness its slope is none, or upwards from the floor;
    roughness counts what a coefficient is above it by the flux that adds, in units of its level."""
    random = np.random.default_rng(3)
    psi = np.tanh(UNEVEN / 5)[:, None] * [0.4, 0.6] + 0.03 * random.normal(size=(12, 2))
    psi[0], psi[8:, 1] = 0, psi[8:, 1] - 0.3
    weight, level, smoothing = 1 / (1 + UNEVEN[1:]), np.array([4.0, 3, 3, 1, 1]), 0.02
    c = rising(UNEVEN, psi, T, weight=weight, level=level, smoothing=smoothing).c
    alike = rising(UNEVEN, psi, T, weight=np.ones(11), level=np.ones(5), smoothing=smoothing)
    assert rising(UNEVEN, psi, T, smoothing=smoothing).c == pytest.approx(alike.c)
    floor = 1e-3 * (psi[1:] / UNEVEN[1:, None]).max()
    A, W = rises(UNEVEN[1:]), weight[:, None] ** 2
    D = np.diff(np.diag((T[3:] - T[:-3]) / 3 / level), 3, axis=0)
    slope = A.T @ (W * (A @ c - psi[1:])) + smoothing * D.T @ D @ (c - floor)
    at_floor = c < floor * (1 + 1e-9)
    assert 0 < at_floor.sum() < 5 and c.min() == pytest.approx(floor)
    assert slope[~at_floor] == pytest.approx(0, abs=1e-5 * np.abs(slope).max())
    assert slope[at_floor].min() > 0


def test_flux_out_of_reach_gives_the_nearer_end():
    ends = MAP.current(np.array([-0.1, 0.0, 9.0, np.nan]), np.full(4, 2.0), 120.0)
    assert list(ends) == [0, 0, 120, 0]


def test_float_differs_from_double_by_rounding_only():
    points = grid(np.linspace(0, 200, 97), np.linspace(0, 2 * np.pi, 91)[:-1])
    double, single = _core.magnetics(MAP, *points), _core_parts.magnetics_single(MAP, *points)
    assert np.all(np.abs(single - double).max(axis=0) < 1e-5 * np.abs(double).max(axis=0))
    assert np.abs(single[:, L_INC] / double[:, L_INC] - 1).max() < 1e-4


@pytest.mark.parametrize(("name", "most"), [("i", 1e5), ("psi", 1e3), ("tau", 1e7)])
def test_numbers_of_no_machine_are_refused(name, most):
    told = {"i": "current", "psi": "flux", "tau": "torque"}[name]
    ramp = np.linspace(0, 1, 5)
    parts = {"i": ramp, "psi": np.outer(ramp, np.ones(5)), "tau": -np.outer(ramp, np.ones(5))}
    theta = np.linspace(0, np.pi, 5)
    FluxTable(4, theta_e=theta, **parts | {name: most * parts[name]})
    with pytest.raises(ParameterError, match=f"{told} reaches 1.01e") as fault:
        FluxTable(4, theta_e=theta, **parts | {name: 1.01 * most * parts[name]})
    assert f"need at most {most:g} in SI units" in str(fault.value)


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
