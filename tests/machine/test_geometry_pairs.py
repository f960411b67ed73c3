"""Pairs of phases: the table against fields of both phases, and the file that a geometry makes."""

import csv
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from command import command
from coupled import I_MAX, Formula, N_r, coupling
from geometries import COARSE, changed, drive_file, geometry, write

import reluctance as rl
from reluctance.base.errors import ParameterError
from reluctance.base.schema import checked
from reluctance.base.toml_file import read_toml
from reluctance.machine.coupling import Coupling, Neighbours, apart, check_pairs
from reluctance.machine.geometry import coupling_of, pairs
from reluctance.machine.geometry.coupling_of import phase_of
from reluctance.machine.geometry.file import Geometry
from reluctance.machine.geometry.pairs import ANGLES, currents, kind_of, sample_pair
from reluctance.machine.geometry.position import at_angle
from reluctance.machine.geometry.samples import rotor_angle, sample
from reluctance.machine.geometry.solve import solve
from reluctance.machine.geometry.solved import solved, system_of
from reluctance.machine.library import flattened
from reluctance.machine.maps.pairs import pair_table, reasons
from reluctance.machine.maps.surface import surface
from reluctance.machine.pair_file import read_pairs, write_pairs

MACHINES = Path(__file__).parents[2] / "machines"
SEED = int(np.random.SeedSequence().generate_state(1)[0])
KINDS = {  # poles, and the polarity of all stator poles where it is not that of the sectors
    "6/4 NN": (6, 4, "NNNSSS", 0),
    "6/4 NS": (6, 4, "NSNSNS", 0),
    "8/6 NN": (8, 6, "NNNNSSSS", 0),
    "8/6 NS": (8, 6, "NNNNSSSS", 3),
    "12/8 NN": (12, 8, "NNNSSSNNNSSS", 0),
    "12/8 NS": (12, 8, "NNNSSSNNNSSS", 2),
}


@cache
def case(N_s, N_r, polarity):
    """A machine of these poles on the bore of the good file."""
    arcs = {6: (30.0, 32.0), 8: (21.0, 23.0), 12: (14.0, 15.0)}[N_s]
    return geometry(
        machine__stator_poles=N_s,
        machine__rotor_poles=N_r,
        machine__phases=4 if N_s == 8 else 3,
        stator__pole_arc_deg=arcs[0],
        rotor__pole_arc_deg=arcs[1],
        winding__polarity=polarity,
        map__coupling="pairs",
    )


@cache
def coarse(name):
    """System, geometry, pole and samples of a kind of pair on a coarse mesh."""
    N_s, N_r, polarity, pole = KINDS[name]
    found = case(N_s, N_r, polarity)
    system = system_of(found, COARSE)
    i = np.array([3.0, 6.0, 9.0, 12.0, 15.0])
    return system, found, pole, sample_pair(system, pole, np.linspace(0, np.pi, 9), i)


def both(system, pole, phi, a, b):
    """Energy, torque and both flux linkages of a pair less each phase alone, by three fields."""
    n = system.winding.n_phases
    ahead = system.section.N_r * n // system.section.N_s
    alpha = rotor_angle(system, phi + apart(0, ahead, n) / 2, pole)
    first, second = np.eye(n)[pole % n], np.eye(n)[(pole + 1) % n]
    fields = [
        solve(at_angle(system, alpha), i, tolerance=1e-6)
        for i in (a * first + b * second, a * first, b * second)
    ]
    parts = [np.array([f.coenergy, f.tau, f.psi @ first, f.psi @ second]) for f in fields]
    energy, tau, _, _ = parts[0] - parts[1] - parts[2]
    psi_first, psi_second = parts[0][2] - parts[1][2], parts[0][3] - parts[2][3]
    return np.array([energy, tau, psi_first, psi_second])


@pytest.mark.long
@pytest.mark.parametrize("name", ["6/4 NN", "8/6 NS", "12/8 NN"])
def test_a_table_of_rank_4_has_the_torque_of_the_field(name):
    """At random angles and currents, to 1.5 times the rated: torque 0.5 % rms of the peak of one
    phase at rated current, flux linkages 0.3 % of the aligned one. None: 5 % and more."""
    print(f"seed {SEED}")
    random = np.random.default_rng(SEED)
    N_s, N_r, polarity, pole = KINDS[name]
    found = case(N_s, N_r, polarity)
    system, i_max = system_of(found), found.map.current_max_A
    i = currents(i_max)
    table = pair_table(sample_pair(system, pole, np.linspace(0, np.pi, ANGLES), i), N_r, rank=4)
    rated = sample(system, np.array([0, 2 / 3 * i_max]), np.linspace(0, np.pi, 31))
    phi = random.uniform(-np.pi, np.pi, 40)
    a, b = random.uniform(0, i_max, (2, 40))
    exact = np.array([both(system, pole, *point) for point in zip(phi, a, b, strict=True)])
    state = table.at(phi, a, b)
    left = state.tau - exact[:, 1]
    print(name, "torque left, none and rank 4 [%]:", end=" ")
    for error in (exact[:, 1], left):
        print(f"{100 * np.sqrt(np.mean(error**2)) / rated.tau.max():.3g}", end=" ")
    assert np.sqrt(np.mean(left**2)) < 5e-3 * rated.tau.max()
    assert np.sqrt(np.mean(exact[:, 1] ** 2)) > 10 * np.sqrt(np.mean(left**2))
    for found_psi, psi in ((state.psi_first, exact[:, 2]), (state.psi_second, exact[:, 3])):
        assert np.sqrt(np.mean((found_psi - psi) ** 2)) < 3e-3 * rated.psi.max()


@pytest.mark.parametrize("name", ["onelab_6_4", "emdlab_6_4_6kw"])
def test_the_stored_pairs_are_those_of_their_geometry(name):
    """At two points of the library's machines with pairs; the whole table takes a while."""
    given = flattened(read_toml(MACHINES / "geometry" / f"{name}.toml"))
    given["winding"]["polarity"] = "NSNSNS"
    del given["model"]
    case = checked(Geometry, given, "[machine]")
    system = system_of(case)
    stored = read_pairs(MACHINES / f"{name}_pairs.csv", N_r=4, n_phases=3)
    (table,) = {pair.table for pair in stored.pairs}
    i = case.map.current_max_A
    alone = np.loadtxt(MACHINES / f"{name}.csv", delimiter=",", skiprows=1)
    psi_peak, tau_peak = alone[:, 2].max(), alone[:, 3].max()
    for phi, a, b in ((np.radians(45.0), i, i), (np.radians(120.0), i, i * 5 / 7)):
        state = table.at(*(np.array([x]) for x in (phi, a, b)))
        exact = both(system, 0, phi, a, b)
        assert state.tau[0] == pytest.approx(exact[1], abs=0.005 * tau_peak)
        assert state.psi_first[0] == pytest.approx(exact[2], abs=0.004 * psi_peak)
        assert state.psi_second[0] == pytest.approx(exact[3], abs=0.004 * psi_peak)


def test_the_table_of_the_page_keeps_the_gate():
    """docs/geometry_pairs.csv: rank 4 leaves at most 0.5 % rms of the torque."""
    with (Path(__file__).parents[2] / "docs" / "geometry_pairs.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert {row["pair"][-2:] for row in rows} == {"NN", "NS"}
    for row in rows:
        assert float(row["tau_rank4_rms_pct"]) < 0.5 < float(row["tau_none_rms_pct"])


@pytest.mark.long
@pytest.mark.parametrize(
    "name",
    ["6/4 NS", "8/6 NN", "12/8 NS"],
)
def test_both_phases_of_a_pair_mirror_each_other(name):
    """dW'(phi, a, b) = dW'(-phi, b, a), by fields."""
    system, _, pole, _ = coarse(name)
    one, other = both(system, pole, 0.9, 12.0, 5.0), both(system, pole, -0.9, 5.0, 12.0)
    scale = np.abs(one)
    assert other[0] == pytest.approx(one[0], abs=1e-5 * scale[0])
    assert other[1] == pytest.approx(-one[1], abs=1e-4 * scale[1] + 1e-7)
    assert other[2:] == pytest.approx(one[:1:-1], abs=1e-5 * scale[2:].max())


@pytest.mark.parametrize(("m", "a", "b"), [(0, 3, 3), (2, 4, 1), (6, 0, 2)])
def test_samples_of_a_pair_are_what_both_phases_have_less_each_alone(m, a, b):
    """At angles from the middle of both; by three fields, each from nothing."""
    system, _, pole, samples = coarse("12/8 NN")
    found = both(system, pole, samples.phi[m], samples.i[a], samples.i[b])
    names = ("energy", "tau", "psi_first", "psi_second")
    sampled = np.array([getattr(samples, name)[m, a, b] for name in names])
    scales = np.array([np.abs(getattr(samples, name)).max() for name in names])
    assert found / scales == pytest.approx(sampled / scales, abs=1e-4)
    if m == 0:  # each mirrors the other
        assert abs(sampled[1]) < 1e-4 * scales[1]
        assert sampled[2] == pytest.approx(sampled[3], rel=1e-4)


def test_torque_and_flux_linkages_are_derivatives_of_one_coenergy():
    table = pair_table(coarse("12/8 NN")[3], 8, rank=3)
    phi, a, b, h = 0.7, 6.5, 11.0, 1e-4
    x = table.at(phi, a, b)

    def slope(name, *step):
        more, less = (table.at(*np.add((phi, a, b), s * np.array(step))) for s in (h, -h))
        return (getattr(more, name) - getattr(less, name)) / (2 * h)

    assert x.tau == pytest.approx(8 * slope("energy", 1, 0, 0), rel=1e-5)
    assert x.psi_first == pytest.approx(slope("energy", 0, 1, 0), rel=1e-5)
    assert x.psi_second == pytest.approx(slope("energy", 0, 0, 1), rel=1e-5)
    assert x.L_first == pytest.approx(slope("psi_first", 0, 1, 0), rel=1e-4)
    assert x.L_second == pytest.approx(slope("psi_second", 0, 0, 1), rel=1e-4)
    assert x.L_mutual == pytest.approx(slope("psi_first", 0, 0, 1), rel=1e-4)
    alone = table.at(phi, a, 0.0)
    assert [alone.energy, alone.tau, alone.psi_first] == pytest.approx([0, 0, 0], abs=1e-12)
    assert alone.psi_second != 0  # the flux of the other phase


@pytest.mark.long
def test_a_table_holds_its_nodes_and_mirrors():
    samples = coarse("8/6 NN")[3]
    table = pair_table(samples, 6, rank=5)  # of five currents: nothing is left out
    phi, a, b = np.meshgrid(samples.phi, samples.i, samples.i, indexing="ij")
    x, mirrored = table.at(phi, a, b), table.at(-phi, b, a)
    np.testing.assert_allclose(x.energy, samples.energy, atol=1e-5 * np.abs(samples.energy).max())
    # The spline over cells of 5 deg goes through the values, and near the slopes.
    np.testing.assert_allclose(x.tau, samples.tau, atol=2e-3 * np.abs(samples.tau).max())
    assert np.sqrt(np.mean((x.tau - samples.tau) ** 2)) < 1e-3 * np.abs(samples.tau).max()
    np.testing.assert_allclose(mirrored.energy, x.energy, atol=1e-5 * np.abs(x.energy).max())
    np.testing.assert_allclose(mirrored.tau, -x.tau, atol=1e-9 * np.abs(x.tau).max())
    assert reasons(samples, 6) == []


def test_a_table_of_a_formula_holds_its_nodes_mirrors_and_has_its_slopes():
    """Between the last node and past it; each slope by small steps of what it is the slope of."""
    samples = Formula().samples()
    table = pair_table(samples, N_r, tolerance=1e-9)
    assert table.rank == 2 and len(table.phi) == 73
    nodes = table.at(*np.meshgrid(samples.phi, samples.i, samples.i, indexing="ij"))
    assert nodes.energy == pytest.approx(samples.energy, abs=1e-12)
    for name in ("tau", "psi_first", "psi_second"):
        given = getattr(samples, name)
        assert getattr(nodes, name) == pytest.approx(given, abs=3e-3 * np.abs(given).max()), name
    back = table.samples()
    assert back.tau == pytest.approx(samples.tau, abs=1e-9) and np.array_equal(back.i, samples.i)
    random = np.random.default_rng(1)
    phi, (a, b) = random.uniform(-np.pi, np.pi, 300), random.uniform(0, 1.6 * I_MAX, (2, 300))
    x, mirrored = table.at(phi, a, b), table.at(-phi, b, a)
    assert mirrored.energy == pytest.approx(x.energy, abs=1e-12)
    assert mirrored.tau_first == pytest.approx(-x.tau_second, abs=1e-12)
    h = 1e-5
    more = [table.at(phi + p, a + q, b + r) for p, q, r in h * np.eye(3)]
    less = [table.at(phi - p, a - q, b - r) for p, q, r in h * np.eye(3)]
    for name, of, n, scale in (
        ("tau", "energy", 0, N_r), ("psi_first", "energy", 1, 1), ("psi_second", "energy", 2, 1),
        ("L_first", "psi_first", 1, 1), ("L_second", "psi_second", 2, 1),
        ("L_mutual", "psi_first", 2, 1), ("tau_first", "tau", 1, 1), ("tau_second", "tau", 2, 1),
    ):  # fmt: skip
        slope = scale * (getattr(more[n], of) - getattr(less[n], of)) / (2 * h)
        most = np.abs(slope).max()
        assert getattr(x, name) == pytest.approx(slope, abs=1e-4 * most), name


def test_a_table_has_the_fewest_functions_that_leave_less_of_the_torque_than_allowed():
    """Rms over its greatest value; and no more of them than there are currents."""
    samples = Formula().samples()
    left = pair_table(samples, N_r, rank=1).samples().tau - samples.tau
    off = np.sqrt((left**2).mean()) / np.abs(samples.tau).max()
    assert 0.002 < off < 0.2  # the usual tolerance, and what would be no table
    for tolerance, rank in ((1.001 * off, 1), (0.999 * off, 2), (0.0, 7)):
        assert pair_table(samples, N_r, tolerance=tolerance).rank == rank
    assert pair_table(samples, N_r).rank == 2 and pair_table(samples, N_r, rank=9).rank == 7


def test_functions_of_a_table_are_the_same_in_any_unit_of_its_energy():
    samples = Formula().samples()
    tau = samples.tau * np.multiply.outer(samples.i, samples.i) ** 2  # of other functions
    one, other = (
        pair_table(replace(samples, energy=x * samples.energy, tau=tau), N_r, rank=1).samples().tau
        for x in (1.0, 1e3)
    )
    assert other == pytest.approx(one, rel=1e-9, abs=1e-9 * np.abs(one).max())


def test_slopes_over_the_current_cease_within_half_of_the_last_one():
    """Their bend falls in two straight lines, at whose ends are the last knots."""
    table = pair_table(Formula().samples(), N_r, tolerance=1e-9)
    assert table.knots[-3:] == pytest.approx([I_MAX, 1.25 * I_MAX, 1.5 * I_MAX])
    i = I_MAX * np.array([0.999999, 1.000001, 1.1, 1.2, 1.249999, 1.250001, 1.3, 1.4, 1.5, 2.0])
    bend, slope = (table._over_current(i, n) for n in (2, 1))
    scale = np.abs(slope).max()
    for knot in table.knots[-3:]:
        around = knot * np.array([1 - 1e-9, 1 + 1e-9])
        before, behind = table._over_current(around).T
        assert before == pytest.approx(behind, rel=1e-6)
        before, behind = table._over_current(around, 1).T
        assert before == pytest.approx(behind, abs=1e-6 * scale)
    assert bend[:, 0] == pytest.approx(bend[:, 1], rel=1e-3)
    assert bend[:, 4] == pytest.approx(bend[:, 5], rel=1e-3)
    for k in (1, 5):  # of each line
        lines = np.diff(bend[:, k : k + 4]) / np.diff(i[k : k + 4])
        assert lines == pytest.approx(np.repeat(lines[:, :1], 3, axis=1), rel=1e-3)
    assert np.abs(slope[:, -2:]).max() < 1e-12 * scale > np.abs(bend[:, -1:]).max()
    assert np.abs(slope[:, 2]).max() > 0.1 * scale


def test_inductances_do_not_jump_where_the_pieces_past_the_last_current_begin():
    """A regulated current passes i_max by its band."""
    core, theta_e = coupling().core, np.linspace(0, 2 * np.pi, 24)
    table = coupling().pairs[0].table
    assert table.i[-1] == I_MAX and len(table.knots) == len(table.i) + 2
    for i in table.knots[-3:]:
        last = np.full(24, i)
        below, above = (core.at(0, x * last, 0.7 * last, theta_e) for x in (1 - 1e-9, 1 + 1e-9))
        tiny = 1e-7 * np.abs(core.at(0, *np.full((2, 24), I_MAX), theta_e)).max(axis=0).max()
        np.testing.assert_allclose(above, below, rtol=1e-6, atol=tiny)


def test_what_a_pair_adds_ends_in_a_constant_past_the_last_current():
    pair = coupling().pairs[0]
    core, theta_e = coupling().core, np.linspace(0, 2 * np.pi, 24)
    far, b = 1.0001 * pair.table.knots[-1], np.full(24, 0.6 * I_MAX)
    one, other = (core.at(0, np.full(24, i), b, theta_e) for i in (far, 50 * far))
    np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-15)
    energy, _, psi_first, _, L_first, _, L_mutual = one[:, :7].T
    assert (psi_first == 0).all() and (L_first == 0).all() and (L_mutual == 0).all()
    assert np.abs(energy).max() > 0.5 * np.abs(core.at(0, I_MAX + 0 * b, b, theta_e)[:, 0]).max()


@pytest.mark.parametrize(
    "machine", [each.machine for each in rl.machines() if getattr(each.machine, "coupling", None)]
)
def test_phases_have_an_inductance_at_any_current(machine):
    """With the parabolas of a spline that goes on, they had none from 1.35 of the last one."""
    pairs, turn = machine.coupling, np.linspace(0, 2 * np.pi, 49)
    i_last = pairs.i_last

    def least(first, second):
        theta_e, a, b = np.meshgrid(turn, first, second, indexing="ij")
        found = []
        for pair in pairs.pairs:
            i = np.zeros((*a.shape, pairs.n_phases))
            i[..., pair.first], i[..., pair.second] = a, b
            L = pairs.inductance(machine.magnetics, i, theta_e)
            found.append(np.linalg.eigvalsh(L)[..., 0].min())
        return min(found)

    within = np.linspace(0, i_last, 25)
    past = i_last * np.concatenate([np.linspace(1, 2.2, 25), [3, 10, 100]])
    everywhere = np.concatenate([within, past])
    assert least(past, everywhere) > 0.9 * least(within, within) > 0


@pytest.mark.parametrize("cut", [2, 3])
@pytest.mark.parametrize(
    "machine", [each.machine for each in rl.machines() if getattr(each.machine, "coupling", None)]
)
def test_a_table_that_is_cut_foresees_flux_linkages_at_its_old_end(machine, cut):
    """At 1.26 and 1.67 of its last current: to half of the greatest, rms."""
    whole = machine.coupling.pairs[0].table
    short = replace(whole, i=whole.i[: 1 - cut], f=whole.f[:, : 1 - cut])
    phi, last = np.linspace(-np.pi, np.pi, 73), np.full(73, whole.i[-1])
    wanted = whole.at(phi, last, last).psi_first
    found = short.at(phi, last, last).psi_first
    assert np.sqrt(np.mean((found - wanted) ** 2)) < 0.5 * np.abs(wanted).max()


def test_the_kinds_of_a_winding():
    """Alternating poles have one kind of pair; poles in groups have another one between groups."""
    groups, alternating = case(8, 6, "NNNNSSSS"), case(6, 4, "NSNSNS")
    assert [all(kind_of(groups, k)) for k in range(4)] == [True, True, True, False]
    assert [any(kind_of(alternating, k)) for k in range(3)] == [False, False, False]
    assert [phase_of(groups, k) for k in range(5)] == [0, 3, 2, 1, 0]


@pytest.mark.long
@pytest.mark.parametrize("poles", [(8, 6, "NNNNSSSS"), (12, 8, "NNNSSSNNNSSS")])
def test_the_pairs_of_a_machine_are_the_phases_of_the_drive(poles):
    """Torque of any two neighbours with their letters, at their electrical angles, by fields."""
    found = case(*poles)
    system, n = system_of(found, COARSE), found.phases
    tables = {
        kind: pair_table(coarse(f"{poles[0]}/{poles[1]} {kind}")[3], poles[1])
        for kind in ("NN", "NS")
    }
    neighbours = []
    for k in range(n):
        kind = "NN" if all(kind_of(found, k)) else "NS"
        neighbours.append(Neighbours(phase_of(found, k), phase_of(found, k + 1), tables[kind]))
    coupling = Coupling(n, tuple(neighbours))
    pole_of = {phase_of(found, k): k for k in range(n)}
    theta_e = 2.2  # of phase a
    alpha = rotor_angle(system, theta_e)
    for pair in neighbours:
        i = np.zeros(n)
        i[pair.first], i[pair.second] = 9.0, 6.0  # nodes of the table

        def tau(i):
            """Of currents in the order of the drive."""
            of_poles = np.zeros(n)
            for phase, pole in pole_of.items():
                of_poles[pole] = i[phase]
            return solve(at_angle(system, alpha), of_poles).tau

        alone = sum(tau(i * (np.arange(n) == k)) for k in range(n))
        scale = np.abs(pair.table.at(np.linspace(0, 6, 61), 9.0, 6.0).tau).max()
        assert coupling.tau(i, theta_e) == pytest.approx(tau(i) - alone, abs=0.05 * scale)


def test_a_rank_that_fails_the_check_is_followed_by_the_next(monkeypatch):
    """Unless the user has chosen it."""
    tried = []

    def check(found, magnetics, i_max):
        tried.append(found.pairs[0].table.rank)
        if len(tried) < 3:
            raise ParameterError("not positive definite")

    samples = Formula().samples()
    monkeypatch.setattr(coupling_of, "check_pairs", check)
    monkeypatch.setattr(
        coupling_of, "pairs_solved", lambda *_, **__: SimpleNamespace(samples=lambda n: samples)
    )
    machine = case(6, 4, "NSNSNS")
    coupling_of.coupling_of(machine, None, 12.0)
    least = pair_table(samples, 4).rank
    assert tried == [least, least + 1, least + 2]
    tried.clear()
    chosen = machine.model_copy(update={"map": machine.map.model_copy(update={"pair_rank": 2})})
    with pytest.raises(ParameterError, match="not positive definite"):
        coupling_of.coupling_of(chosen, None, 12.0)
    assert tried == [2]


@pytest.mark.parametrize(
    ("poles", "polarity", "letters"),
    [
        ((4, 2), "NNSS", ["ab"]),  # of two phases both neighbours are the same one
        ((6, 4), "NSNSNS", ["ac", "cb", "ba"]),
        ((8, 6), "NNNNSSSS", ["ad", "dc", "cb", "ba"]),
    ],
)
def test_each_two_phases_side_by_side_are_one_pair(poles, polarity, letters, monkeypatch):
    monkeypatch.setattr(coupling_of, "check_pairs", lambda *_: None)
    monkeypatch.setattr(
        coupling_of,
        "pairs_solved",
        lambda *_, **__: SimpleNamespace(samples=lambda n: Formula().samples()),
    )
    machine = SimpleNamespace(
        stator_poles=poles[0],
        rotor_poles=poles[1],
        phases=len(polarity) // 2,
        polarity=polarity,
        map=SimpleNamespace(pair_rank=1),
    )
    found = coupling_of.coupling_of(machine, None, 12.0)
    assert found.n_phases == machine.phases
    assert [pair.letters for pair in found.pairs] == letters


@pytest.mark.long
def test_a_table_of_another_machine_is_refused():
    samples = coarse("6/4 NN")[3]
    table = pair_table(samples, 4)
    magnetics = surface(solved(geometry(map__angles=13, map__currents=6)).table(4))
    check_pairs(Coupling(3, (Neighbours(0, 2, table),)), magnetics, 15.0)
    strange = replace(table, C=6 * table.C)
    with pytest.raises(ParameterError, match="take flux map and pair table from the same source"):
        check_pairs(Coupling(3, (Neighbours(0, 2, strange),)), magnetics, 15.0)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A geometry with pairs, the machine file that the command makes, and what it prints. Few nodes
    of the pairs, for the time."""
    folder = tmp_path_factory.mktemp("pairs")
    keys = dict(map__angles=13, map__currents=6, map__coupling="pairs")
    data = changed(**keys, winding__polarity="NSNSNS")
    path, out = write(folder / "g.toml", data), folder / "m.toml"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pairs, "ANGLES", 7)
        patch.setattr(pairs, "CURRENTS", 4)
        done = command("machine", "from-geometry", path, "--out", out)
        assert done.code == 0, done.error
        yield path, out, done.out


@pytest.mark.long
def test_the_command_writes_pairs_that_load(made):
    _, machine_path, printed = made
    assert "pairs ac cb ba: at 15 A in both the torque differs" in printed
    assert "% rms and up to" in printed
    assert 'pairs = "m_pairs.csv"' in machine_path.read_text()
    assert read_toml(machine_path)["machine"]["pairs"] == "m_pairs.csv"


@pytest.mark.long
def test_a_machine_file_and_its_geometry_have_the_same_pairs(made, tmp_path):
    geometry_path, machine_path, _ = made
    of_geometry, of_file = (
        rl.load(drive_file(tmp_path, path)).machine for path in (geometry_path, machine_path)
    )
    assert of_geometry.coupled and of_file.coupled
    random = np.random.default_rng(1)
    i, theta_e = random.uniform(0, 15, (50, 3)), random.uniform(0, 6, 50)
    tau = of_geometry.coupling.tau(i, theta_e)
    assert np.abs(tau).max() > 0.05 * of_geometry.tau(15, 2.0)
    np.testing.assert_allclose(of_file.coupling.tau(i, theta_e), tau, atol=2e-3 * np.abs(tau).max())


@pytest.mark.long
def test_a_run_has_the_pairs_of_its_machine(made, tmp_path):
    """A geometry and its machine file give one run; without the pairs, and where the controller
    does not know them, it is another one."""
    given = rl.load(drive_file(tmp_path, made[1]))
    drives = {
        "geometry": rl.load(drive_file(tmp_path, made[0])),
        "file": given,
        "blind": given.with_values({"control.pair_torque": False}),
        "none": given.with_values({"machine.pair_factor": 0.0}),
    }
    found = {name: rl.simulate(each, record=None).kpis for name, each in drives.items()}
    assert found["geometry"].i_rms == pytest.approx(found["file"].i_rms, rel=2e-3)
    assert abs(found["none"].i_rms - found["file"].i_rms) > 5e-4 * found["file"].i_rms
    assert abs(found["blind"].tau_mean - found["file"].tau_mean) > 1e-3 * found["file"].tau_mean


@pytest.mark.long
def test_a_pair_table_is_written_and_read_back(tmp_path):
    table = pair_table(coarse("6/4 NS")[3], 4)
    coupling = Coupling(3, tuple(Neighbours(k, (k + 2) % 3, table) for k in (0, 2, 1)))
    write_pairs(coupling, tmp_path / "p.csv")
    again = read_pairs(tmp_path / "p.csv", N_r=4, n_phases=3)
    assert [pair.letters for pair in again.pairs] == ["ac", "cb", "ba"]
    i, theta_e = np.array([7.0, 0.0, 4.0]), 1.1
    assert again.tau(i, theta_e) == pytest.approx(coupling.tau(i, theta_e), rel=1e-6)


def test_progress_over_several_pairs_rises_to_one(tmp_path, monkeypatch):
    def sampled(*_, told):
        told(0.5), told(1.0)
        return SimpleNamespace(energy=0.0, tau=0.0, psi_first=0.0, psi_second=0.0)

    monkeypatch.setenv("RELUCTANCE_CACHE", str(tmp_path))
    monkeypatch.setattr(pairs, "sample_pair", sampled)
    parts = []
    pairs.pairs_solved(geometry(), [0, 1], told=parts.append)
    assert parts == [0.25, 0.5, 0.75, 1.0]
