"""Parts of the search for the limit, each alone: what a programme tries in turn, a torque that
falls, and phases that couple, against their tables."""

from dataclasses import replace

import numpy as np
import pytest
from operating_point import PAPER, POINT, profile
from test_limit_pairs import ALIKE, MIXED, N, at_instants, linked
from test_limit_pairs import point as pairs_at

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.machine import optimum
from reluctance.machine.optimum import envelope
from reluctance.machine.optimum.coupled import at_once, of_pairs, solved
from reluctance.machine.optimum.least_ripple import _state, _voltage
from reluctance.machine.optimum.programme import REST, SLACK, Programme, checked_inputs


@pytest.fixture(autouse=True)
def cache_dir(tmp_path, monkeypatch):
    monkeypatch.setenv("RELUCTANCE_CACHE", str(tmp_path / "cache"))


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


def test_a_point_may_be_of_a_small_machine_without_resistance():
    """Voltage and current have no least value; what is no number of theirs is refused."""
    assert replace(POINT, i_max=0.5, u_dc=0.5, R=0.0).i_max == 0.5
    for name, value in (("i_max", 0.0), ("u_dc", 0.0), ("R", -1e-9), ("omega_m", np.inf)):
        with pytest.raises(ParameterError, match=f"{name} = "):
            replace(POINT, **{name: value})
