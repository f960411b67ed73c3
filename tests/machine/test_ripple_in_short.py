"""Parts of the least ripple, each alone: one phase at a time in closed form, deviations within the
voltage, their copper, and what each commutation adds up to."""

from dataclasses import replace

import numpy as np
import pytest
from operating_point import PAPER, POINT, profile
from scipy.optimize import linprog
from test_limit_pairs import MIXED, N
from test_limit_pairs import point as pairs_at

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.machine import optimum
from reluctance.machine.optimum import least_ripple, returning_flux, ripple
from reluctance.machine.optimum.each_phase import each_phase
from reluctance.machine.optimum.least_ripple import _deviation, _smoothed, _state, _voltage
from reluctance.machine.optimum.programme import Programme
from reluctance.machine.optimum.returning_flux import _runs, returning_mean
from reluctance.machine.optimum.ripple import _least
from reluctance.machine.optimum.switching_programme import SwitchingProgramme, weights


@pytest.fixture(autouse=True)
def cache_dir(tmp_path, monkeypatch):
    monkeypatch.setenv("RELUCTANCE_CACHE", str(tmp_path / "cache"))


def solutions(monkeypatch, module):
    """Gets the switching programmes that a module solves, each with what it finds."""
    solved_by = []

    class Kept(SwitchingProgramme):
        def solve(self):
            solved_by.append((self, super().solve()))
            return solved_by[-1][1]

    monkeypatch.setattr(module, "SwitchingProgramme", Kept)
    return solved_by


@pytest.mark.parametrize("d", [0.2, -0.35])
def test_one_phase_at_a_time_has_every_bound_in_closed_form(monkeypatch, d):
    """Of three phases with one always on, all switches together have 4 x 3 F edges in a second; the
    torque is a triangle of |g| u d (1 - d)/f with two edges a pulse, f = 6 F. Where the voltage is
    below 0.98 of the link."""
    gain, u_dc, F, n = 150.0, 200.0, 10e3, 36
    on = np.arange(n) < n // 3
    local = np.where(on, d * u_dc, 0.0), np.where(on, -gain, 0.0), on
    monkeypatch.setattr(ripple, "_local", lambda *_: local)
    given = profile(np.ones(n), u_dc=u_dc, tau_error_rms=0.25)
    found = ripple.ripple_floor(POINT, given, switching_frequency=F)
    pp = gain * u_dc * abs(d) * (1 - abs(d)) / (6 * F)
    assert found.bound_pp == pytest.approx(pp, rel=1e-6)
    for name in ("bound_rms", "on_profile_rms", "returning_rms", "pulse_width_rms"):
        assert getattr(found, name) == pytest.approx(pp / np.sqrt(12), rel=0.02), name
    assert (found.switching_frequency, found.profile_rms) == (F, 0.25)


@pytest.mark.parametrize("seed", range(3))
def test_the_peak_is_the_least_that_both_kinds_of_vectors_allow(seed):
    """E_1 and O_1 change with the shares of the vectors: no shares that hold the torque have both
    below, and some of them reach it."""
    draw = np.random.default_rng(seed)
    u_dc, gain = 200.0, draw.uniform(-2, 2, 2)
    u = draw.uniform(-0.8, 0.8, 2) * u_dc
    vectors = np.array([(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1)])
    slope = vectors @ gain * u_dc - u @ gain
    even = (vectors == 0).sum(axis=1) % 2 == 0
    # Weights a and 1 - a on the two sums: by duality the greatest of the least weighted sums.
    held = {"A_eq": [slope / u_dc, np.ones(9)], "b_eq": [0, 1]}
    sums = [
        linprog(np.abs(slope) * np.where(even, a, 1 - a), **held).fun
        for a in np.linspace(0, 1, 301)
    ]
    assert _least(u, gain, u_dc)[1] == pytest.approx(max(sums), rel=3e-3)


def test_a_phase_at_rest_has_no_part_in_the_ripple(monkeypatch):
    """Below a thousandth of the peak; gain and voltage are of the middle of an interval."""
    n = 36
    i = np.zeros(n)
    i[:12] = 100.0
    i[20], i[25] = 0.19, 0.21  # half of it in the middle, each side
    u = np.full(n, 50.0)
    at_u, gain, flows = ripple._local(POINT, profile(i, u=u))
    assert np.flatnonzero(flows).tolist() == [*range(12), 24, 25, 35]
    assert np.array_equal(at_u, np.where(flows, 50.0, 0.0)) and not gain[~flows].any()
    middle = 2 * np.pi * (np.arange(n) + 0.5) / n
    ahead = (i + np.roll(i, -1)) / 2
    h = 1e-4
    up, down = (_core.magnetics(PAPER, ahead + x, middle) for x in (h, -h))
    exact = (up[:, 2] - down[:, 2]) / (up[:, 0] - down[:, 0])
    assert gain[:11] == pytest.approx(exact[:11], rel=1e-5)


@pytest.mark.parametrize(
    ("points", "F", "told"),
    [(35, 1e4, "n_phases = 3, need a divisor of the 35"), (36, 0.0, "switching_frequency = 0")],
)
def test_ripple_of_no_frequency_or_of_other_phases_is_refused(points, F, told):
    with pytest.raises(ParameterError, match=told):
        ripple.ripple_floor(POINT, profile(np.ones(points)), switching_frequency=F)


def test_runs_around_the_circle_are_numbered_where_none_is_cut():
    yes = np.array([1, 1, 0, 0, 1, 0, 1, 1], bool)
    numbers = _runs(yes)
    assert (numbers == -1).tolist() == (~yes).tolist()
    assert numbers[0] == numbers[1] == numbers[6] == numbers[7] != numbers[4]
    assert {*numbers.tolist()} == {-1, 0, 1}
    assert _runs(np.ones(5, bool)).tolist() == [0] * 5
    assert _runs(np.zeros(5, bool)).tolist() == [-1] * 5


@pytest.mark.parametrize("seed", [5, 6, 7])
def test_fluxes_return_within_each_commutation(seed):
    """Of phases that share one angle only, as they come in and as they go out, each flux linkage is
    on the profile there, and the torque alone is held elsewhere. Nine weights: 1 %."""
    n, u_dc = 9, 100.0
    random = np.random.default_rng(seed)
    flows = np.arange(n) <= n // 3  # the last angle is the first of the next phase
    u = np.where(flows, random.uniform(-0.8, 0.8, n) * u_dc, 0.0)
    gain = np.where(flows, random.uniform(50, 200, n), 0.0)
    found = returning_mean(u, gain, flows, n_phases=3, u_dc=u_dc)
    free = [_least(u[j : j + 1], gain[j : j + 1], u_dc)[0] for j in range(1, 3)]
    shared = np.array([0, 3])
    drifts, _, returns = _least(u[shared], gain[shared], u_dc)
    assert found == pytest.approx((sum(free) + returns) / 3, rel=0.01)
    assert returns > 1.05 * drifts


def test_volt_seconds_of_each_phase_add_up_to_nothing_over_each_commutation(monkeypatch):
    """Of three angles, over which the gains change: as a phase comes in, and as it goes out."""
    solved_by = solutions(monkeypatch, returning_flux)
    n, u_dc = 18, 100.0
    random = np.random.default_rng(4)
    flows = np.arange(n) < 9
    u = np.where(flows, random.uniform(-0.8, 0.8, n) * u_dc, 0.0)
    gain = np.where(flows, random.uniform(50, 200, n), 0.0)
    returning_mean(u, gain, flows, n_phases=3, u_dc=u_dc)
    ((made, x),) = solved_by
    off = np.zeros((6, 3))
    for j, angle in enumerate(made.angles):
        off[j, angle.on] = x[list(angle.shares)] @ (angle.vectors - angle.mean)
        assert off[j] @ gain.reshape(3, 6)[:, j] == pytest.approx(0, abs=1e-6)  # the torque
    assert np.abs(off[:3]).max() > 1e-3  # they do wander
    assert off[:3].sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-8)


def test_pairs_of_weights_have_a_norm_of_one_and_are_their_own_reverse():
    w = weights()
    assert w[0] == 0 and w[-1] == 1 and np.all(np.diff(w) > 0)
    assert w**1.5 + w[::-1] ** 1.5 == pytest.approx(np.ones(len(w)))


def test_a_phase_near_full_voltage_is_driven_as_the_profile_drives_it():
    """From 0.98 of the link on, its mean is required; below, only the torque is."""
    n, u_dc = 12, 100.0
    on = np.arange(n) < 4
    for part, held in ((0.97, 0), (0.99, 1), (-0.99, 1)):
        made = SwitchingProgramme(
            np.where(on, part * u_dc, 0.0), on * 5.0, on, n_phases=3, u_dc=u_dc
        )
        angle = made.angles[0]
        assert angle.on.tolist() == [0] and angle.vectors[:, 0].tolist() == [-1, 0, 1]
        assert angle.slope == pytest.approx((np.array([-1, 0, 1]) - part) * 5 * u_dc)
        x = made.solve()
        shares = x[list(angle.shares)]
        assert shares.sum() == pytest.approx(1)
        mean = shares @ angle.vectors[:, 0]
        assert (mean == pytest.approx(part)) == bool(held)
    made.require([(angle.shares[0], 1.0)], 2.0)  # more than all of the time
    with pytest.raises(RuntimeError, match="no least ripple found"):
        made.solve()


def test_deviations_for_less_ripple_make_no_torque_and_are_within_the_voltage():
    """To first order, over the phases at each angle; none where a current begins or rests."""
    table = optimum.profile_table(POINT, 20.0, n_points=36, n_levels=2)
    i, psi = table.i[1], table.psi[1]
    flows = i > 1e-3 * i.max()
    h = table.theta_e[1] / (POINT.N_r * POINT.omega_m)
    d = _deviation(POINT, table, i, psi, flows, h)
    assert np.abs(d).max() > 0.01 * psi.max()
    assert not d[~(flows & np.roll(flows, 1))].any()
    gain = _state(POINT, i, table.theta_e, flows).gain
    torque = (gain * d).reshape(3, -1).sum(axis=0)
    assert torque == pytest.approx(np.zeros(12), abs=1e-6 * np.abs(gain * d).max())
    u = _voltage(POINT.R, i, psi, h) + (np.roll(d, -1) - d) / h
    on = (i + np.roll(i, -1)) / 2 > 1e-3 * i.max()
    assert np.abs(u[on]).max() <= 240 * (1 + 1e-6)
    assert (psi + d)[flows].min() > 0


def test_a_current_below_a_thousandth_of_the_peak_switches_nothing(monkeypatch):
    """What the interior point leaves of a phase at rest is no current that a leg drives. Where one
    flows, the gain is that of the middle of the interval."""
    asked = []

    class Kept(SwitchingProgramme):
        def __init__(self, u, gain, flows, **given):
            asked.append((u, gain, flows))
            super().__init__(u, gain, flows, **given)

    monkeypatch.setattr(least_ripple, "SwitchingProgramme", Kept)
    table = optimum.profile_table(POINT, 20.0, n_points=36, n_levels=2)
    h = table.theta_e[1] / (POINT.N_r * POINT.omega_m)
    flows = table.i[1] > 1e-3 * table.i[1].max()
    for rest in (0.0, 0.9e-3, 1.1e-3):
        i = np.where(flows, table.i[1], rest * table.i[1].max())
        _deviation(POINT, table, i, table.psi[1], flows, h)
    none, less, more = (mid for _, _, mid in asked)
    at_rest = ~flows & ~np.roll(flows, -1)  # at both ends of the interval
    assert at_rest.sum() > 10 and more[at_rest].all()
    assert not none[at_rest].any() and not less[at_rest].any()
    for u, gain, mid in asked:
        assert not u[~mid].any() and not gain[~mid].any()
    ahead, d = (table.i[1] + np.roll(table.i[1], -1)) / 2, 1e-4
    middle = table.theta_e + np.pi / 36
    up, down = (_core.magnetics(PAPER, ahead + x, middle) for x in (d, -d))
    exact = (up[:, 2] - down[:, 2]) / (up[:, 0] - down[:, 0])
    inside = flows & np.roll(flows, -1)
    assert asked[0][1][inside] == pytest.approx(exact[inside], rel=1e-4)


def test_copper_of_a_deviation_is_priced_beside_the_ripple(monkeypatch):
    """At i/L, twenty times the ripple of one phase at a time over the sum of i^2; and nine tenths
    of a flux linkage may be taken away. Where a current flows from the point before."""
    priced, gains = [], []

    class Kept(SwitchingProgramme):
        def __init__(self, u, gain, flows, **given):
            gains.append(gain)
            super().__init__(u, gain, flows, **given)

        def unknowns(self, cost, least):
            if cost.any():
                priced.append((*cost, least))
            return super().unknowns(cost, least)

    monkeypatch.setattr(least_ripple, "SwitchingProgramme", Kept)
    table = optimum.profile_table(POINT, 20.0, n_points=36, n_levels=2)
    i, psi, theta = table.i[1], table.psi[1], table.theta_e
    h = theta[1] / (POINT.N_r * POINT.omega_m)
    flows = i > 1e-3 * i.max()
    _deviation(POINT, table, i, psi, flows, h)
    u = (np.roll(psi, -1) - psi) / h + POINT.R * (i + np.roll(i, -1)) / 2
    d = np.minimum(np.abs(u) / 240, 1)
    size = (np.abs(gains[0]) * 240 * d * (1 - d)) ** (2 / 3)
    price = 20 * size.reshape(3, -1).max(axis=0).sum() / (i**2).sum()
    L = _core.magnetics(PAPER, i, theta)[:, 3]
    k = np.flatnonzero(flows & np.append(False, flows[:-1]))
    assert len(k) > 10 and not flows[-1]
    assert np.array(priced) == pytest.approx(np.stack([price * i[k] / L[k], -0.9 * psi[k]], axis=1))


def test_flux_linkages_deviate_by_what_the_legs_give_more_than_the_profile(monkeypatch):
    """Over each interval on which a current flows, from point to point."""
    solved_by = solutions(monkeypatch, least_ripple)
    table = optimum.profile_table(POINT, 20.0, n_points=36, n_levels=2)
    h = table.theta_e[1] / (POINT.N_r * POINT.omega_m)
    flows = table.i[1] > 1e-3 * table.i[1].max()
    d = _deviation(POINT, table, table.i[1], table.psi[1], flows, h)
    ((made, x),) = solved_by
    rise = np.diff(np.append(d, d[0])).reshape(3, 12)
    assert np.abs(rise).max() > 0.1 * h * 240 and len(made.angles) == 12
    for j, angle in enumerate(made.angles):
        more = x[list(angle.shares)] @ angle.vectors - angle.mean
        assert rise[angle.on, j] == pytest.approx(h * 240 * more, abs=1e-6 * h * 240)


def test_less_ripple_is_the_same_profile_in_other_units():
    """Eight times the flux linkages, voltages and resistance; and it is another profile than before
    from the first point on at which a current flows, with none at rest."""
    larger = _core.LeHuy(N_r=4, L_u=5.36e-3, L_a=188.96e-3, L_sat=1.2e-3, i_m=450.0, psi_m=3.744)
    other = replace(POINT, magnetics=larger, R=8 * POINT.R, u_dc=8 * POINT.u_dc)
    table = optimum.profile_table(POINT, 20.0, n_points=36, n_levels=2)
    flows = table.i[1] > 1e-3 * table.i[1].max()
    rest = np.where(flows, table.i[1], 0.5e-3 * table.i[1].max())
    given = replace(table, i=np.stack([table.i[0], rest]))
    fields = ("psi", "u_dc", "tau_ref", "tau_error_max", "tau_error_rms")
    found = optimum.least_ripple_table(POINT, given)
    scaled = replace(given, **{name: 8 * getattr(given, name) for name in fields})
    assert optimum.least_ripple_table(other, scaled).i == pytest.approx(found.i, rel=1e-6)
    assert not found.i[1][~flows].any() and not np.allclose(found.i[1], given.i[1], rtol=0.01)
    h = table.theta_e[1] / (POINT.N_r * POINT.omega_m)
    d = _deviation(POINT, given, given.i[1], given.psi[1], flows, h)
    free = np.flatnonzero(flows & np.roll(flows, 1))
    assert d[free[0]] != 0


def test_smoothing_keeps_the_sum_and_reaches_half_its_width_to_each_side():
    d = np.zeros(72)
    d[1] = 1.0
    smooth = _smoothed(d, 25.0)  # five points
    assert smooth.sum() == pytest.approx(1) and smooth.argmax() == 1
    assert np.flatnonzero(smooth > 1e-12).tolist() == [0, 1, 2, 3, 71]
    assert smooth[[0, 71]] == pytest.approx(smooth[[2, 3]])
    assert _smoothed(d, 1.0) == pytest.approx(d)


def test_phases_with_other_neighbours_make_the_torque_of_the_mean_together():
    """Next to the currents of the mean, within the voltage; no torque needs no current."""
    real = pairs_at(MIXED)
    mean = replace(real, coupling=real.coupling.mean)
    table = optimum.profile_table(mean, 2.0, n_points=N, n_levels=2, smoothing=0.0)
    none, found = each_phase(real, table).i
    assert none.shape == found.shape == (3, N) and not none.any()
    _, u, tau = Programme(real, n_points=N).waveforms(found.ravel())
    assert tau == pytest.approx(np.full(N, 2.0), rel=1e-4)
    assert np.abs(u).max() <= real.u_dc * (1 + 1e-6) and found.min() >= 0
    assert 0.005 < np.abs(found - table.i[1]).max() / table.i[1].max() < 0.3
