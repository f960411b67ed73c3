"""Pulses beside a held phase become the factor of the pairs; by the formula of `coupled`."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from coupled import I_MAX, SENSED, WORKING, machine_file, unlike
from test_map_cli import reluctance

import reluctance as rl
from reluctance import ParameterError, _core
from reluctance.base.resources import resources
from reluctance.machine import identify_pairs
from reluctance.machine.coupling import Coupling, Neighbours
from reluctance.machine.held_pulses import COLUMNS, HeldPulse, read_held_pulses
from reluctance.machine.identify_pairs import (
    free_of_drift,
    pair_factor,
    pair_torque,
    phase_of_first,
    pulsed_current,
)
from reluctance.machine.measured_pairs import (
    TERMS,
    Measured,
    _check,
    _powers,
    _shapes,
    kinds_of,
    measured_pairs,
)

R = 1.5
DT = 5e-5


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    path = machine_file(tmp_path_factory.mktemp("machine"), unlike())
    example = resources("examples") / "edge_mpc_mcu.toml"
    return rl.load(example, [f"machine={path}", *WORKING, *SENSED])


def pulse(machine, pair, theta_m, i_held, *, R=R, offset=0.0, drop=0.0):
    """A triangle of current, and the voltage that the held phase takes for its wobbling one."""
    first, second = pair
    rise = np.linspace(0, 0.9 * I_MAX, 60)
    i = np.concatenate([np.zeros(20), rise, rise[::-1], np.zeros(40)])
    t = DT * np.arange(len(i))
    beside = i_held * (1 + 0.05 * np.sin(900 * t))
    currents = np.zeros((len(i), 3))
    currents[:, first], currents[:, second] = i, beside
    theta_e = machine.N_r * theta_m
    turned = np.full(len(i), (theta_e - 2 * np.pi * second / 3) % (2 * np.pi))
    psi = _core.magnetics(machine.magnetics, beside, turned)[:, 0]
    psi = psi + machine.coupling.psi(currents, np.full(len(i), theta_e))[:, second]
    mean = (beside[1:] + beside[:-1]) / 2
    u = np.insert(np.diff(psi) / DT + R * mean + drop, 0, 0.0)
    return HeldPulse(first, second, theta_m, t, i + offset, u, beside + offset)


def recorded(machine, pairs=((0, 1), (2, 0)), positions=6, currents=(0.3, 0.7), **more):
    angles = np.linspace(0, 2 * np.pi / machine.N_r, positions, endpoint=False)
    return [
        pulse(machine, pair, float(angle), part * I_MAX, **more)
        for pair in pairs
        for angle in angles
        for part in currents
    ]


def for_a_table(machine, pairs=((0, 1), (2, 0))):
    return recorded(machine, pairs, 16, (0.1, 0.3, 0.5, 0.7, 0.85))


def field():
    """Angles of phase a and currents of all phases, within what the pulses reach."""
    angles = np.linspace(0, 2 * np.pi, 90)
    levels = np.array([0.0, 0.2, 0.45, 0.8]) * I_MAX
    i = np.stack(np.meshgrid(levels, levels, levels, indexing="ij"), axis=-1).reshape(-1, 3)
    return np.repeat(i, len(angles), axis=0), np.tile(angles, len(i))


def test_the_factor_is_exact_without_noise(drive):
    machine = drive.machine
    pulses = recorded(machine)
    for believed in (1.0, 0.8, 1.3):
        found = pair_factor(pulses, machine.coupling.times(believed), machine.magnetics, R)
        assert believed * found.factor == pytest.approx(1, abs=1e-9)
        assert found.error < 1e-9
        assert found.residual < 1e-9
        assert set(found.of_pair) == {"ab", "ca"}
        assert (found.n_pulses, found.n_positions) == (24, 12)


def test_the_standard_error_is_that_of_the_mean_where_each_position_says_as_much(drive):
    """Whole periods of the angle apart, pulses differ in the factor alone with which they were
    made."""
    machine, factors = drive.machine, np.array([0.7, 0.9, 1.0, 1.2, 1.4])
    pulses = []
    for n, factor in enumerate(factors):
        pairs = machine.coupling.times(factor)
        own = SimpleNamespace(N_r=machine.N_r, magnetics=machine.magnetics, coupling=pairs)
        pulses.append(pulse(own, (0, 1), 0.3 + n * 2 * np.pi / machine.N_r, 0.5 * I_MAX))
    found = pair_factor(pulses, machine.coupling, machine.magnetics, R)
    assert found.factor == pytest.approx(factors.mean(), abs=1e-9)
    assert found.error == pytest.approx(factors.std(ddof=1) / np.sqrt(len(factors)), abs=1e-9)


def test_offsets_drops_and_an_error_of_the_resistance_hardly_matter(drive):
    machine = drive.machine
    pulses = recorded(machine, R=1.1 * R, offset=0.05, drop=2.0)
    found = pair_factor(pulses, machine.coupling, machine.magnetics, R)
    assert found.factor == pytest.approx(1, abs=0.01)
    assert abs(found.factor - 1) < 4 * found.error


def test_one_kind_of_pairs_that_is_wrong_alone_shows(drive):
    """The factor is of all pairs; those of each pair tell where they do not agree."""
    machine = drive.machine
    pulses = recorded(machine)
    wrong = unlike(-0.2, -0.2, 0.3)  # for 0.15
    found = pair_factor(pulses, wrong, machine.magnetics, R)
    assert found.of_pair["ab"] == pytest.approx(1, abs=1e-6)
    assert found.of_pair["ca"] == pytest.approx(0.5, abs=1e-6)
    assert found.error > 0.01


def led(machine, first):
    """The machine as its legs see it where the first of them drives this phase."""
    back = [
        ((p.first - first) % 3, (p.second - first) % 3, p.table) for p in machine.coupling.pairs
    ]
    pairs = tuple(Neighbours(*pair) for pair in back)
    return SimpleNamespace(
        N_r=machine.N_r, magnetics=machine.magnetics, coupling=Coupling(3, pairs)
    )


@pytest.mark.parametrize("first", range(3))
def test_leads_that_are_all_moved_on_show_in_the_pairs(drive, first, tmp_path):
    """As many phases on: alignment and wiring do not see it, for every phase is like the next."""
    machine = drive.machine
    pulses = recorded(led(machine, first), offset=0.02)
    assert phase_of_first(pulses, machine.coupling, machine.magnetics, R) == first
    alike = Coupling(3, led(machine, 1).coupling.pairs[:2] + led(machine, 2).coupling.pairs[:1])
    assert phase_of_first(pulses, alike.mean, machine.magnetics, R) == 0  # does not tell
    drive.save(tmp_path / "d.toml")
    asked = ("map", "identify", written(tmp_path / "p.csv", pulses), "--R_ohm", R)
    asked = (*asked, "--pairs", tmp_path / "d.toml")
    if first == 0:
        assert "next: pair_factor = " in reluctance(*asked)
        return
    line = reluctance(*asked, fails="line")
    assert f"the pairs are where leg a drives phase {'abc'[first]}, and every other leg" in line


@pytest.mark.parametrize(("left_over", "first"), [(0.99, 2), (1.01, 0)])
def test_leads_are_moved_on_where_less_than_a_third_is_left_over(monkeypatch, left_over, first):
    ring = Coupling(3, tuple(Neighbours(k, (k + 1) % 3, None) for k in range(3)))
    moved = {0: 3.0, 1: 4.0, 2: left_over}

    def factor(pulses, coupling, magnetics, R):
        return SimpleNamespace(residual=moved[-coupling.pairs[0].first % 3])

    monkeypatch.setattr(identify_pairs, "pair_factor", factor)
    assert phase_of_first([], ring, None, R) == first


def test_pairs_that_no_factor_makes_right_are_not_answered_with_one(drive, tmp_path):
    machine = drive.machine
    for third, differ in ((0.15, False), (0.14, False), (0.2, True), (-0.15, True)):
        own = SimpleNamespace(
            N_r=machine.N_r, magnetics=machine.magnetics, coupling=unlike(-0.2, -0.2, third)
        )
        pulses = recorded(own)
        found = pair_factor(pulses, machine.coupling, machine.magnetics, R)
        assert found.differ is differ, third
        if third == 0.2:
            drive.save(tmp_path / "d.toml")
            file = written(tmp_path / "p.csv", pulses)
            line = reluctance(
                *("map", "identify", file, "--R_ohm", R, "--pairs", tmp_path / "d.toml"),
                fails="line",
            )
            assert "no factor makes the believed pairs right: ab 1.000, ca 1.333;" in line


def test_samples_past_the_end_of_the_table_are_left_out(drive):
    machine = drive.machine
    pulses = recorded(machine)
    for one in pulses:
        one.i[40:44] += 2 * I_MAX
    found = pair_factor(pulses, machine.coupling, machine.magnetics, R)
    assert found.factor == pytest.approx(1, abs=1e-9)


def test_what_shows_no_pairs_is_refused(drive):
    machine = drive.machine
    pulses = recorded(machine)
    with pytest.raises(ParameterError, match="2 clamped positions, need at least 4"):
        pair_factor(pulses[:4], machine.coupling, machine.magnetics, R)
    with pytest.raises(ParameterError, match="add nothing"):
        pair_factor(pulses, machine.coupling.times(0), machine.magnetics, R)
    late = pulse(machine, (0, 1), 0.3, 5.0)
    cut = HeldPulse(0, 1, 0.3, *(x[24:] for x in (late.t, late.i, late.u_held, late.i_held)))
    with pytest.raises(ParameterError, match="rows after its record"):
        pair_factor([cut], machine.coupling, machine.magnetics, R)


@pytest.mark.long
def test_the_torque_of_pairs_at_a_point_is_that_of_its_currents(drive):
    point = drive.at(drive.omega_nominal)
    rms = pair_torque(point, drive.tau_max)
    k = rl.simulate(drive.with_values({"mismatch.pair_factor": 0.8}), until=0.04, record=None).kpis
    exact = rl.simulate(drive, until=0.04, record=None).kpis
    caused = np.sqrt(k.torque_error_rms**2 - exact.torque_error_rms**2)
    assert 0.2 * rms / drive.tau_max == pytest.approx(caused, rel=0.3)


def measured(machine, pulses, coupling):
    return measured_pairs(
        pulses,
        kinds_of(coupling, pulses),
        machine.magnetics,
        R=R,
        n_phases=3,
        i_max=machine.i_max_A,
    )


def test_a_table_from_pulses_has_the_torque_of_the_formula(drive):
    """The kinds are those of the machine, what is believed of them does not matter."""
    machine = drive.machine
    found = measured(machine, for_a_table(machine), machine.coupling.times(0.3))
    tau, true = found.coupling.tau(*field()), machine.coupling.tau(*field())
    off = np.sqrt(((tau - true) ** 2).mean())
    assert off < 0.01 * np.sqrt((true**2).mean())
    assert found.torque_error(*field()) < 0.01 * np.sqrt((true**2).mean())
    assert {(pair.first, pair.second) for pair in found.coupling.pairs} == {(0, 1), (1, 2), (2, 0)}
    assert found.i_reached == pytest.approx(0.85 * 1.05 * I_MAX, rel=0.01)


def test_pairs_of_a_machine_that_has_none_so_far_are_those_pulsed(drive):
    machine = drive.machine
    pulses = for_a_table(machine, ((1, 0), (1, 2), (0, 2)))
    found = measured(machine, pulses, None)
    assert [pair.letters for pair in found.coupling.pairs] == ["ab", "ac", "bc"]
    tau, true = found.coupling.tau(*field()), machine.coupling.tau(*field())
    assert np.sqrt(((tau - true) ** 2).mean()) < 0.01 * np.sqrt((true**2).mean())


@pytest.mark.parametrize(("rest", "told"), [(8, None), (9, None), (7, "begins 7 rows after its")])
def test_the_offset_of_a_pulsed_current_is_its_mean_long_before_it_begins(rest, told):
    """Over the first half of the rows before it is above a tenth of its top; none is below 0 A."""
    i = np.concatenate([np.arange(rest) % 2 * 0.2, [1.01, 5.0, 10.0, 0.99, 0.0]])
    row = np.zeros(len(i))
    given = HeldPulse(0, 1, 0.0, row, i, row, row)
    if told:
        with pytest.raises(ParameterError, match=f"a pulse {told} record, need 8 at rest before"):
            pulsed_current(given)
        return
    assert pulsed_current(given) == pytest.approx(np.maximum(i - 0.1, 0))


def test_the_torque_of_pairs_is_rms_and_none_without_them(monkeypatch):
    place = "reluctance.machine.identify_pairs.smooth_currents"
    monkeypatch.setattr(place, lambda point, tau_ref: (tau_ref, 2.0))
    coupled = SimpleNamespace(tau=lambda i, theta_e: np.array([-3.0, 4.0]) * i * theta_e)
    assert pair_torque(SimpleNamespace(coupling=None), 1.5) == 0.0
    assert pair_torque(SimpleNamespace(coupling=coupled), 1.5) == pytest.approx(3 * np.sqrt(12.5))


def test_what_drifts_in_a_straight_line_says_nothing_of_a_pair():
    """Offsets, drops and an error of R: the flux linkage is left, of the samples within alone."""
    theta_m, turn, t = 0.3, 2 * np.pi / 3, np.linspace(0, 0.01, 21)
    held = np.full(21, 4.0)
    flux = np.sin(400 * t)
    machine = _core.LeHuy(N_r=4, L_u=0.67e-3, L_a=23.6e-3, L_sat=0.15e-3, i_m=450, psi_m=0.486)
    u = np.insert(np.diff(flux) / np.diff(t), 0, 0.0) + 1.5 * held
    pulse = HeldPulse(0, 1, theta_m, t, held, u, held)
    within = np.arange(21) != 20
    own = np.cos(700 * t)
    clean = free_of_drift(pulse, own[:, None], within, machine, 1.5, turn)
    assert clean.shape == (20, 2)
    for column, x in zip(clean.T, (own, flux), strict=True):
        line = np.polyval(np.polyfit(t[:20], x[:20], 1), t[:20])
        assert column == pytest.approx(x[:20] - line, abs=1e-9)
    off = replace(pulse, u_held=u + 0.7)
    assert free_of_drift(off, own[:, None], within, machine, 1.6, turn) == pytest.approx(clean)
    # What the phase alone has at a wobbling current is none of the pair's.
    wobbling = replace(pulse, i_held=held + 0.5 * np.sin(900 * t))
    angle = np.full(21, (4 * theta_m - turn) % (2 * np.pi))
    alone = _core.magnetics(machine, wobbling.i_held.copy(), angle)[:, 0]
    mean = (wobbling.i_held[1:] + wobbling.i_held[:-1]) / 2
    u = np.insert(np.diff(flux + alone) / np.diff(t) + 1.5 * mean, 0, 0.0)
    found = free_of_drift(replace(wobbling, u_held=u), own[:, None], within, machine, 1.5, turn)
    assert found == pytest.approx(clean, abs=1e-9)


def test_the_error_of_a_torque_is_that_of_a_mean_without_one_at_a_time():
    """Of the mean of some numbers it is their standard deviation over the root of their count."""
    numbers = np.random.default_rng(1).normal(size=(7, 3))
    i, theta_e = np.ones((3, 3)), np.arange(3.0)

    def without(n):
        mean = np.delete(numbers, n, axis=0).mean(axis=0)
        return SimpleNamespace(tau=lambda *at: mean * at[0][:, 0] + at[1])

    found = Measured(None, tuple(without(n) for n in range(7)), 1.0).torque_error(i, theta_e)
    variances = numbers.var(axis=0, ddof=1) / 7
    assert found == pytest.approx(np.sqrt(variances.mean()))


def test_polynomials_of_the_currents_have_their_slopes_and_no_constant():
    i, h = np.array([0.0, 1.0, 3.5, 8.0]), 1e-4
    g, slope, bend = _powers(i, 8.0)
    up, down = _powers(i + h, 8.0), _powers(i - h, 8.0)
    assert g.shape == (4, 5) and not g[0].any()
    assert g[-1] == pytest.approx(np.ones(5)) and g[:, 0] == pytest.approx(i / 8)
    assert slope == pytest.approx((up[0] - down[0]) / (2 * h), rel=1e-6, abs=1e-6)
    assert bend == pytest.approx((up[1] - down[1]) / (2 * h), rel=1e-6, abs=1e-6)
    x = np.polynomial.legendre.leggauss(9)
    at, weight = 4 * (1 + x[0]), x[1] / 2  # over 0 to 8 A
    own = _powers(at, 8.0)[0] / (at / 8)[:, None]
    assert (own.T * weight) @ own == pytest.approx(np.diag(1 / (2 * np.arange(5) + 1)), abs=1e-12)


@pytest.mark.parametrize("phi", [0.0, 0.4, 2.5])
def test_shapes_of_the_angle_mirror_both_phases_and_have_their_slopes(phi):
    """C(-phi) is C(phi) with its phases exchanged, of any coefficients; each is there once."""
    c = np.random.default_rng(2).normal(size=len(TERMS))
    C, mirrored = ((_shapes(x) @ c).reshape(5, 5) for x in (phi, -phi))
    assert mirrored == pytest.approx(C.T)
    h = 1e-5
    slope = (_shapes(phi + h) - _shapes(phi - h)) / (2 * h)
    assert _shapes(phi, 1) == pytest.approx(slope, abs=1e-8)
    # Seven cosines of 15 symmetric parts, six sines of ten antisymmetric ones.
    assert len(TERMS) == 7 * 15 + 6 * 10
    some = np.vstack([_shapes(x) for x in np.linspace(0, 2 * np.pi, 30)])
    assert np.linalg.matrix_rank(some) == len(TERMS)


@pytest.mark.parametrize(
    ("positions", "currents", "told"),
    [
        (13, (0.1, 0.3, 0.5, 0.7, 0.85), None),
        (12, (0.1, 0.3, 0.5, 0.7, 0.85), "12 clamped positions and 5 held currents, need at least"),
        (13, (0.1, 0.3, 0.5, 0.7), "13 clamped positions and 4 held currents, need at least 13"),
        (13, (0.1, 0.3, 0.5, 0.7, 0.73), "13 clamped positions and 4 held currents"),
        (13, (0.1, 0.3, 0.5, 0.7, 0.75), None),
    ],
)
def test_a_table_needs_positions_and_currents(positions, currents, told):
    """Held currents nearer than 4 % of the greatest are one."""
    row = np.zeros(9)
    pulses = [
        HeldPulse(0, 1, 0.05 * place, row, row, row, row + part * 10)
        for place in range(positions)
        for part in currents
    ]
    if told is None:
        _check([(0, 1)], pulses, 10.0)
        return
    with pytest.raises(ParameterError, match=f"pairs ab: {told}"):
        _check([(0, 1)], pulses, 10.0)


def test_a_pair_without_pulses_is_named(drive):
    machine = drive.machine
    pulses = for_a_table(machine, ((0, 1),))
    with pytest.raises(ParameterError, match="no pulses of any of the pairs ca"):
        measured(machine, pulses, machine.coupling)


@pytest.mark.long
def test_the_command_writes_a_table_for_the_machine_file(drive, tmp_path):
    file = written(tmp_path / "p.csv", for_a_table(drive.machine))
    drive.save(tmp_path / "d.toml")
    out = tmp_path / "measured.csv"
    asked = ("map", "identify", file, "--R_ohm", R, "--pairs", tmp_path / "d.toml", "--out", out)
    said = reluctance(*asked)
    assert "the pairs are 1.0000" in said
    assert f'next: pairs = "{out}" in the machine file' in said
    again = drive.with_values({"machine.pairs": str(out)}).machine.coupling
    tau, true = again.tau(*field()), drive.machine.coupling.tau(*field())
    assert np.sqrt(((tau - true) ** 2).mean()) < 0.01 * np.sqrt((true**2).mean())
    blank = drive.with_values({"machine.pair_factor": 0.0})
    blank.save(tmp_path / "blank.toml")
    asked = ("map", "identify", file, "--R_ohm", R, "--pairs", tmp_path / "blank.toml")
    assert "has no pairs" in reluctance(*asked, fails="line")
    assert "the pairs are" not in reluctance(*asked, "--out", out)


def written(path, pulses):
    lines = [",".join(COLUMNS)]
    for one in pulses:
        angle = f"{np.degrees(one.theta_m):.7g}"
        columns = zip(one.t, one.i, one.u_held, one.i_held, strict=True)
        lines += [f"{t:.9g},{i:.9g},{angle},{u:.9g},{b:.9g},{one.pair}" for t, i, u, b in columns]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_a_file_is_read_pulse_by_pulse(drive, tmp_path):
    pulses = recorded(drive.machine)
    read = read_held_pulses([written(tmp_path / "p.csv", pulses)], n_phases=3)
    assert [one.pair for one in read] == [one.pair for one in pulses]
    for one, given in zip(read, pulses, strict=True):
        assert one.theta_m == pytest.approx(given.theta_m, rel=1e-6)
        assert one.u_held == pytest.approx(given.u_held, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("t_s,u_mean_V,i_A,theta_m_deg\n0,0,0,0\n", "u_held_mean_V is missing"),
        (",".join(COLUMNS) + "\n", "there are no rows below the names"),
        (",".join(COLUMNS) + "\n0,0,0,0,0,ab\n", "data row 1: the pulse there has 1 rows"),
        (",".join(COLUMNS) + "\n0,0,0,0,0,ad\n", "pair `ad` is none of phases a, b, c"),
        (",".join(COLUMNS) + "\n0,0,0,0,0,aa\n", "write the pulsed phase and the held one"),
        (",".join(COLUMNS) + "\n0,x,0,0,0,ab\n", "i_A"),
    ],
)
def test_a_file_of_another_kind_is_refused(text, said, tmp_path):
    path = tmp_path / "p.csv"
    path.write_text(text)
    with pytest.raises(ParameterError, match=said):
        read_held_pulses([path], n_phases=3)


def test_the_command_tells_factor_error_and_torque(drive, tmp_path):
    file = written(tmp_path / "p.csv", recorded(drive.machine))
    believed = drive.with_values({"machine.pair_factor": 0.8})
    believed.save(tmp_path / "d.toml")
    asked = ("map", "identify", file, "--R_ohm", R)
    said = reluctance(*asked, "--pairs", tmp_path / "d.toml")
    assert "24 pulses at 12 clamped positions" in said
    assert "the pairs are 1.2500 +- 0.0000 of those believed (ab 1.250, ca 1.250)" in said
    assert "next: pair_factor = 1 in the machine file" in said
    theirs = tmp_path / "theirs.csv"
    theirs.write_text("phase,W\n1,2\n")
    for option, told in (
        (("--out", file), "is read by this command"),
        (("--out", theirs), "no table with the columns that this command writes"),
        (("--out", tmp_path / "m.csv"), "6 clamped positions and 2 held currents, need"),
        (("--N_r", 4), "--N_r goes with a flux table, not with --pairs"),
    ):
        assert told in reluctance(*asked, "--pairs", tmp_path / "d.toml", *option, fails="line")
    assert "need --out" in reluctance(*asked, fails="line")
    plain = resources("examples") / "paper_rated.toml"
    assert "has no pairs" in reluctance(*asked, "--pairs", plain, fails="line")
