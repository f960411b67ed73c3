"""Pulses beside a held phase become the factor of the pairs; by the formula of `coupled`."""

from types import SimpleNamespace

import numpy as np
import pytest
from coupled import I_MAX, SENSED, WORKING, machine_file, unlike
from test_map_cli import reluctance

import reluctance as rl
from reluctance import ParameterError, _core
from reluctance.base.resources import resources
from reluctance.machine.coupling import Coupling, Neighbours
from reluctance.machine.held_pulses import COLUMNS, HeldPulse, read_held_pulses
from reluctance.machine.identify_pairs import pair_factor, pair_torque, phase_of_first
from reluctance.machine.measured_pairs import kinds_of, measured_pairs

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
