"""Parts of the search for the limit, each alone: ripple of one phase at a time in closed form, what
a programme tries in turn, a torque that falls, and phases that couple, against their tables."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog
from test_limit_pairs import ALIKE, MIXED, N, at_instants, linked
from test_limit_pairs import point as pairs_at

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.machine import optimum
from reluctance.machine.optimum import (
    OperatingPoint,
    Profile,
    envelope,
    least_ripple,
    returning_flux,
    ripple,
)
from reluctance.machine.optimum.coupled import at_once, of_pairs, solved
from reluctance.machine.optimum.each_phase import each_phase
from reluctance.machine.optimum.least_ripple import _deviation, _smoothed, _state, _voltage
from reluctance.machine.optimum.programme import REST, SLACK, Programme, checked_inputs
from reluctance.machine.optimum.returning_flux import _runs, returning_mean
from reluctance.machine.optimum.ripple import _least
from reluctance.machine.optimum.switching_programme import SwitchingProgramme, weights

PAPER = _core.LeHuy(N_r=4, L_u=0.67e-3, L_a=23.62e-3, L_sat=0.15e-3, i_m=450.0, psi_m=0.468)
POINT = OperatingPoint(PAPER, n_phases=3, R=0.72, i_max=150.0, u_dc=240.0, omega_m=50 * np.pi)


@pytest.fixture(autouse=True)
def cache_dir(tmp_path, monkeypatch):
    monkeypatch.setenv("RELUCTANCE_CACHE", str(tmp_path / "cache"))


def profile(i, psi=None, **values):
    theta_e = 2 * np.pi * np.arange(i.shape[-1]) / i.shape[-1]
    usual = {"tau_error_max": 0.0, "tau_error_rms": 0.0, "i_rms": 1.0, "p_cu": 1.0, "u_dc": 240.0}
    usual |= {"tau_ref": 0.0, "omega_m": 0.0, "u": 0 * i, "i_peak": float(i.max())}
    return Profile(theta_e=theta_e, i=i, psi=0 * i if psi is None else psi, **usual | values)


# Ripple of one phase at a time.


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
    solved_by = []

    class Kept(SwitchingProgramme):
        def solve(self):
            solved_by.append((self, super().solve()))
            return solved_by[-1][1]

    monkeypatch.setattr(returning_flux, "SwitchingProgramme", Kept)
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


# What a programme tries in turn.


class Scripted(Programme):
    """Finds what it is told to, and keeps what it was asked."""

    def __init__(self, *found, **given):
        super().__init__(given.pop("at", POINT), n_points=36, **given)
        self.asked, self.found = [], found

    def _solve(self, objective, constraint, start, *, tau_ref, s=(0.0, 0.0)):
        self.asked.append((objective, constraint, s))
        of = [f for f in self.found if f[0] == objective]
        (_, value, found) = of[min(sum(a[0] == objective for a in self.asked), len(of)) - 1]
        return start, value, found


def test_the_least_error_is_relaxed_in_steps_until_a_least_copper_is_found():
    """A ten-thousandth of it, ten and a hundred times as much, then a thousandth of the torque."""
    e, tau = 2.0, 20.0
    made = Scripted(("copper", 0.0, False), ("error", e, True))
    with pytest.raises(RuntimeError, match=r"no optimum found at tau_ref = 20\.0 N m"):
        made.best(tau, "rms")
    bounds = [s for objective, constraint, s in made.asked if (objective, constraint)[1] == "rms"]
    assert bounds[:4] == [(0.0, np.inf)] * 4  # the least error, from each of four starts
    given = [e * (1 + SLACK), e * (1 + 10 * SLACK), e * (1 + 100 * SLACK), e + 1e-3 * tau]
    assert bounds[4:] == [(pytest.approx(x), pytest.approx(x)) for x in given]
    assert [c for _, c, _ in made.asked[:4]] == ["none"] * 4


def test_another_least_error_is_tried_as_well_where_it_is_another():
    """Of four starts: one finds none, and one the same as the least to a ten-thousandth."""
    e, other = 2.0, 2.0 * (1 + 2 * SLACK)
    found = [("error", x, True) for x in (other, e)]
    found += [("error", e * (1 + SLACK / 2), True), ("error", 1.0, False)]
    made = Scripted(*found, ("copper", 0.0, False))
    with pytest.raises(RuntimeError):
        made.best(20.0, "rms")
    given = [s[0] for objective, constraint, s in made.asked if s[0] == s[1] > 0]
    slack = (1 + SLACK, 1 + 10 * SLACK, 1 + 100 * SLACK)
    want = [x * part for part in slack for x in (e, other)]
    assert given == pytest.approx([*want, e + 0.02, other + 0.02])


def test_where_the_least_error_is_none_a_profile_without_ripple_is_looked_for_again():
    """Up to a millionth of the torque; from the least errors as well, which may be others."""
    for e, again in ((0.9e-6 * 20, 5), (1.1e-6 * 20, 0)):
        made = Scripted(("copper", 0.0, False), ("error", e, True))
        with pytest.raises(RuntimeError):
            made.best(20.0, "max")
        tried = [constraint for objective, constraint, _ in made.asked if objective == "copper"]
        assert tried[4 : 4 + again] == ["none"] * again and tried[4 + again] == "max"


def test_above_a_torque_with_ripple_none_without_is_looked_for():
    copper = [("copper", 0.0, False)] * 4 + [("copper", 0.0, True)]
    made = Scripted(*copper, ("error", 3.0, True))
    made.best(20.0, "max")
    count = len(made.asked)
    made.best(20.0, "max")
    assert [c for _, c, _ in made.asked[count:]] == ["max"] * 5
    count = len(made.asked)
    made.best(19.9, "max")
    assert [c for _, c, _ in made.asked[count:]] == ["none"]
    assert not made.best(0.0, "max").any()


def test_searches_that_find_nothing_say_so():
    made = Scripted(("torque", 0.0, False), ("weighted", 0.0, False))
    with pytest.raises(RuntimeError, match="no greatest torque found at 1500 rpm and 240 V"):
        made.greatest_torque()
    with pytest.raises(RuntimeError, match="no greatest mean found below 7 N m"):
        made.greatest_mean(7)
    assert made.weighted(7.0) is None


@pytest.mark.parametrize(
    ("held", "search"),
    [
        ("constant", lambda made, i: made.greatest_torque(i)[1]),
        ("held", lambda made, i: made.greatest_mean(30.0, i)),
    ],
)
@pytest.mark.parametrize(("first", "best"), [(3.0, 2), (6.0, 0)])
def test_the_greatest_torque_is_that_of_the_best_start(held, search, first, best):
    """Of those that led to an optimum: the given one, pulses, weak ones and flat ones."""
    asked, values = [], (first, 9.0, 5.0, 4.0, 1.0)

    class Told(Programme):
        def _solve(self, objective, constraint, start, *, tau_ref, s=(0.0, 0.0)):
            assert (objective, constraint, s) == ("torque", held, (0.0, np.inf))
            asked.append(start)
            n = len(asked) - 1
            return np.full(36, 10.0 + n), values[n], n != 1

    given = np.full(36, 12.5)
    found = search(Told(POINT, n_points=36), given)
    assert asked[0] is given and len(asked) == (4 if held == "constant" else 5)
    assert {*found} == {10.0 + best}


@pytest.mark.parametrize(("weight", "weaker"), [(1.0, True), (10.0, False)])
def test_the_best_weighted_current_has_the_least_of_losses_and_ripple(weight, weaker):
    """log(mean(i^2)) + w mean(error^2)/tau_ref^2, of those that are optima, here of pulses: 0.8 of
    the currents have 0.64 of the losses and lack about a third of the torque."""

    class Told(Programme):
        def _solve(self, objective, constraint, start, *, tau_ref, s=(0.0, 0.0)):
            assert (objective, constraint, tau_ref) == ("weighted", "mean", 20.0)
            return start, 0.0, np.ptp(start) > 0

    made = Told(POINT, n_points=36, ripple_weight=weight)
    strong = made.start(20.0)
    weak, none = 0.8 * strong, np.full(36, 20.0)
    error = [made.waveforms(i)[2] / 20 - 1 for i in (strong, weak)]
    ripple = weight * (np.mean(error[1] ** 2) - np.mean(error[0] ** 2))
    assert (np.log(0.64) + ripple < 0) == weaker and abs(np.log(0.64) + ripple) > 0.3
    for starts in ((strong, weak, none), (none, weak, strong)):
        assert np.array_equal(made.weighted(20.0, *starts), weak if weaker else strong)


def test_starts_share_the_torque_as_the_sine_and_two_never_end():
    """Each phase makes its part at its angle, up to i_max."""
    made = Programme(POINT, n_points=36)
    i = made.start(20.0)
    theta = made.theta_e
    assert not i[19:].any() and i[0] == 0
    tau = _core.magnetics(PAPER, i, theta)[:, 2]
    part = np.maximum(np.sin(theta), 0)
    total = np.tile(part.reshape(3, -1).sum(axis=0), 3)
    assert tau[1:18] == pytest.approx(20 * (part / total)[1:18], rel=1e-3)
    assert made.start(1e4)[1:18] == pytest.approx(np.full(17, 150.0), rel=1e-6)
    pulses, weak, low, high = made.starts(20.0)
    assert np.array_equal(pulses, i) and np.array_equal(weak, made.start(2.0))
    assert {*low} == {150 / 8} and {*high} == {75.0}


def test_a_current_ends_that_is_none_somewhere():
    made = Programme(POINT, n_points=36)
    i = np.full(36, 10.0)
    for least, ends in ((0.999 * REST * 150, True), (1.001 * REST * 150, False), (0.0, True)):
        i[3] = least
        assert made.ends(i) == ends


@pytest.mark.parametrize(
    ("points", "n_points", "smoothing", "told"),
    [
        (3, 35, 0.0, "n_points = 35, need a multiple of n_phases = 3, at least 36; try 180"),
        (3, 33, 0.0, "n_points = 33"),
        (3, 37, 0.0, "n_points = 37"),
        (4, 44, 0.0, "at least 48; try 240"),
        (3, 36, -0.1, "smoothing = -0.1, need a weight >= 0 rad"),
    ],
)
def test_a_grid_that_fits_no_phases_is_refused(points, n_points, smoothing, told):
    at = replace(POINT, n_phases=points)
    with pytest.raises(ParameterError, match=told):
        checked_inputs(at, n_points, smoothing)
    assert checked_inputs(at, 12 * points, 0.0)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"tau_max": 0.0}, "tau_max = 0.0, need a torque > 0 N m"),
        ({"n_levels": 1}, "n_levels = 1, need at least 2"),
        ({"norm": "least"}, "norm = least"),
        ({"ripple_weight": -1.0}, "ripple_weight = -1.0, need a weight >= 0"),
    ],
)
def test_a_table_that_cannot_be_meant_is_refused(given, told):
    with pytest.raises(ParameterError, match=told):
        optimum.profile_table(POINT, given.pop("tau_max", 5.0), n_points=36, **given)


def test_two_levels_are_no_torque_and_all_of_it():
    table = optimum.profile_table(POINT, 5.0, n_points=36, n_levels=2, ripple_weight=0.0)
    assert table.tau_ref.tolist() == [0, 5] and not table.i[0].any() and table.i[1].any()
    assert (table.omega_m, table.u_dc) == (POINT.omega_m, 240.0)


def test_torque_against_the_rotation_is_greatest_as_of_the_machine_turned_round():
    """At -omega the same torque drives that brakes at omega; each speed counts for itself."""
    told = []
    speeds = [150.0, -150.0]
    plus = optimum.torque_speed_envelope(POINT, speeds, n_points=36, progress=told.append)
    minus = optimum.torque_speed_envelope(POINT, speeds, n_points=36, direction=-1)
    assert told == [0.5, 1.0]
    assert minus.tau_max == pytest.approx(-plus.tau_max[::-1], rel=1e-6)
    assert minus.i_rms == pytest.approx(plus.i_rms[::-1], rel=1e-4)
    assert plus.p_cu == pytest.approx(3 * POINT.R * plus.i_rms**2)
    at = replace(POINT, omega_m=150.0)  # the copper is that of all but a part of the torque
    best = optimum.best_profile(at, plus.tau_max[0] * (1 - SLACK), n_points=36)
    assert best.tau_error_max < 1e-5 * plus.tau_max[0]
    assert (plus.i_rms[0], plus.i_peak[0]) == pytest.approx((best.i_rms, best.i_peak), rel=1e-3)
    with pytest.raises(ParameterError, match="finite speeds"):
        optimum.torque_speed_envelope(POINT, [1.0, np.nan], n_points=36)


@pytest.mark.parametrize("direction", [1, -1])
def test_each_speed_is_searched_from_the_next_one_nearer_to_standstill(monkeypatch, direction):
    """Driving and braking, each by itself; its copper is that of nearly all of the torque."""
    searched, asked = [], []

    def most(speed):
        return 20 - abs(speed) / 100

    class Told(Programme):
        def greatest_torque(self, *starts):
            searched.append((self.point.omega_m, [start[0] for start in starts]))
            return most(self.point.omega_m), np.full(36, 50 + self.point.omega_m / 10)

        def best(self, tau_ref, norm, *starts, near=None):
            asked.append((tau_ref, norm, *(start[0] for start in starts)))
            return starts[0]

    monkeypatch.setattr(envelope, "Programme", Told)
    speeds = np.array([300.0, -200, 100, -400, 200, -100])
    found = optimum.torque_speed_envelope(POINT, speeds, n_points=36, direction=direction)
    own = (direction * speeds).tolist()
    nearer = {s: [x for x in own if x * s > 0 and abs(x) < abs(s)] for s in own}
    starts = {s: [50 + max(nearer[s], key=abs) / 10] if nearer[s] else [] for s in own}
    assert searched == [(s, starts[s]) for s in sorted(own, key=abs)]
    assert asked == [(most(s) * (1 - SLACK), "max", 50 + s / 10) for s, _ in searched]
    assert found.tau_max == pytest.approx(direction * most(speeds))
    assert found.i_peak == pytest.approx(50 + direction * speeds / 10)
    assert np.array_equal(found.omega_m, speeds)


# A torque that changes.


def test_a_torque_falls_from_the_currents_before_by_volt_seconds():
    """At standstill without resistance: each phase loses or gains u t of flux linkage, whichever
    lessens its torque, from its own current at its own angle."""
    at = replace(POINT, R=0.0, omega_m=0.0)
    theta = 2 * np.pi * np.arange(36) / 36
    start = profile(40 + 20 * np.cos(theta - 1.0), tau_ref=30.0)
    step = optimum.fastest_torque_step(at, -20.0, start=start, n_angles=5, share=0.6)
    assert step.share == 0.6 and step.theta_e == pytest.approx(2 * np.pi * np.arange(5) / 5)
    currents = np.linspace(0, 150, 3001)
    for theta_0, time in zip(step.theta_e, step.time, strict=True):
        left = 0.0
        for k in range(3):
            angle = (theta_0 - 2 * np.pi * k / 3) % (2 * np.pi)
            curve = _core.magnetics(PAPER, currents, np.full(3001, angle))
            i_0 = np.interp(angle, np.append(theta, 2 * np.pi), np.append(start.i, start.i[0]))
            psi = np.interp(i_0, currents, curve[:, 0]) + np.array([1, -1]) * 240 * time
            left += np.interp(np.interp(psi, curve[:, 0], currents), currents, curve[:, 2]).min()
        assert left == pytest.approx(30 - 0.6 * 50, abs=0.2)
    assert step.mean == pytest.approx(step.time.mean()) and step.longest == step.time.max()


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"share": 0.0}, "share = 0.0, need a share in"),
        ({"share": 1.01}, "share = 1.01"),
        ({"n_angles": 0}, "n_angles = 0, need at least 1 angle"),
        ({"start": profile(np.ones(36), tau_ref=8.0)}, "tau_ref = 8.0, need another torque"),
    ],
)
def test_a_step_that_cannot_be_meant_is_refused(given, told):
    with pytest.raises(ParameterError, match=told):
        optimum.fastest_torque_step(POINT, 8.0, **given)


def test_a_step_that_takes_longer_than_is_looked_at_is_infinite():
    """At once where the torque is there already; all of a change may be asked for."""
    slow = optimum.fastest_torque_step(POINT, 41.0, n_angles=2, t_end=1e-5)
    assert np.isinf(slow.time).all() and np.isinf(slow.longest)
    all_of_it = optimum.fastest_torque_step(POINT, 10.0, n_angles=1, share=1.0)
    most = optimum.fastest_torque_step(POINT, 10.0, n_angles=1)
    assert all_of_it.time[0] > most.time[0] > 0 and most.share == 0.95


# Phases that couple.


def test_all_phases_at_once_are_each_behind_by_a_part_of_the_period():
    own = np.arange(12)
    assert at_once(own, 3)[0].tolist() == [0, 8, 4]
    assert at_once(np.stack([own, own + 100, own + 200]), 3)[5].tolist() == [5, 101, 209]


def test_only_phases_that_flow_share_the_flux():
    random = np.random.default_rng(2)
    L = random.uniform(0, 0.2, (4, 3, 3)) + np.eye(3)
    flux = random.uniform(-1, 1, (4, 3))
    flow = np.array([[1, 1, 1], [1, 0, 1], [0, 0, 0], [0, 1, 0]], bool)
    found = solved(L, flow, flux)
    for j, on in enumerate(flow):
        k = np.flatnonzero(on)
        assert found[j, k] == pytest.approx(np.linalg.solve(L[j][np.ix_(k, k)], flux[j, k]))
        assert not found[j, ~on].any()


def alike():
    """Currents over the period of a phase, some at rest, and where they flow."""
    at = pairs_at(ALIKE)
    theta = 2 * np.pi * np.arange(N) / N
    i = np.maximum(5 * np.sin(theta + 0.4) + 1.0, 0.0)
    return at, theta, i, i > 0


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("n_currents", [1, 3])
def test_what_pairs_add_in_a_programme_is_that_of_their_tables(n_currents, direction):
    """Below the first node, between nodes and little past the last one; of one current for all
    phases, or of one each. Backwards, angles fall from point to point."""
    import casadi as ca

    pairs = pairs_at(MIXED if n_currents == 3 else ALIKE).coupling
    random = np.random.default_rng(n_currents)
    own = random.uniform(0, 12, (n_currents, N)) * random.integers(0, 2, (n_currents, N))
    own[:, :3] = 0.3, 12.0, 12.1
    theta = 2 * np.pi * np.arange(N) / N
    back = direction * np.arange(N)
    x = ca.MX.sym("x", n_currents * N)
    f = ca.Function("f", [x], of_pairs(pairs, x, theta[back], direction, n_currents))
    psi, tau = (np.array(v.full()).reshape(n_currents, N) for v in f(own[:, back].ravel()))
    at_same = at_once(own, 3)
    expected = pairs.psi(at_same, theta)
    found = at_once(psi[:, back], 3)
    assert found == pytest.approx(expected, abs=1e-9)
    total = at_once(tau[:, back], 3).sum(axis=1)
    assert total == pytest.approx(direction * pairs.tau(at_same, theta), abs=1e-9)


def test_a_state_of_phases_that_couple_is_that_of_their_tables():
    """Flux linkage and torque, by the tables; slopes by small steps of the flux linkage of one
    phase, with those of the others that flow held."""
    at, theta, i, flows = alike()
    state = _state(at, i, theta, flows)
    angle = theta[:, None] - 2 * np.pi * np.arange(3) / 3
    all_i = at_instants(np.broadcast_to(i, (3, N)))
    psi, tau = linked(at, all_i, angle)
    assert state.psi == pytest.approx(psi[:, 0])
    alone = _core.magnetics(at.magnetics, i, theta)
    assert state.mutual == pytest.approx(psi[:, 0] - alone[:, 0])
    assert at_once(state.tau, 3).sum(axis=1) == pytest.approx(tau)
    h = 1e-5
    steps = [
        (linked(at, all_i + h * row, angle), linked(at, all_i - h * row, angle))
        for row in np.eye(3)
    ]
    L = np.stack([(a[0] - b[0]) / (2 * h) for a, b in steps], axis=-1)
    tau_i = np.stack([(a[1] - b[1]) / (2 * h) for a, b in steps], axis=-1)
    assert state.L == pytest.approx(L[:, 0, 0], rel=1e-4)
    on, flux = at_once(flows, 3), np.linspace(-1e-3, 1e-3, N)
    rise = state.rise(flux)
    for j in range(N):
        k = np.flatnonzero(on[j])
        if not on[j, 0]:
            assert state.gain[j] == 0 == rise[j]
            continue
        exact = np.linalg.solve(L[j][np.ix_(k, k)].T, tau_i[j, k])
        assert state.gain[j] == pytest.approx(exact[0], rel=1e-3, abs=1e-4 * abs(state.gain).max())
        by = np.linalg.solve(L[j][np.ix_(k, k)], at_once(flux, 3)[j, k])
        assert rise[j] == pytest.approx(by[0], rel=1e-3, abs=1e-6)


def test_the_voltage_of_a_profile_is_the_mean_over_each_interval():
    """R i + dpsi/dt of straight lines between the points, around the period."""
    i, psi = np.array([1.0, 3.0, 2.0]), np.array([0.1, 0.4, 0.2])
    assert _voltage(2.0, i, psi, 0.1) == pytest.approx(np.array([4 + 3, 5 - 2, 3 - 1]))
    assert _voltage(2.0, i, psi, -0.1) == pytest.approx(np.array([4 - 3, 5 + 2, 3 + 1]))


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
    solved_by = []

    class Kept(SwitchingProgramme):
        def solve(self):
            solved_by.append((self, super().solve()))
            return solved_by[-1][1]

    monkeypatch.setattr(least_ripple, "SwitchingProgramme", Kept)
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
