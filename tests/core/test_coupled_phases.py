"""Phases that share iron: the tables of the core, and the plant against its own equations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from coupled import I_MAX, Formula, N_r, coupling, machine_file
from scipy.integrate import solve_ivp

import reluctance as rl
from reluctance import _core
from reluctance.cli.run import crowded
from reluctance.drive.guard.supervised import controller as guarded
from reluctance.drive.run.plant import closed_loop
from reluctance.drive.run.simulate import core_of
from reluctance.machine.coupling import behind

EXAMPLES = Path(__file__).parents[2] / "examples"
COLUMNS = ("energy", "tau", "psi_first", "psi_second", "L_first", "L_second", "L_mutual")
random = np.random.default_rng(7)


def points(n, i_most=I_MAX):
    return *random.uniform(0, i_most, (2, n)), random.uniform(-10, 10, n)


def test_the_core_has_the_numbers_of_the_table():
    pairs = coupling().times(0.7)
    a, b, theta_e = points(400)
    for n, pair in enumerate(pairs.pairs):
        found = pairs.core.at(n, a, b, theta_e)
        table = pair.table.at(theta_e - behind(pair.first, pair.second, pairs.n_phases), a, b)
        for column, name in enumerate(COLUMNS):
            wanted = 0.7 * getattr(table, name)
            np.testing.assert_allclose(found[:, column], wanted, atol=1e-12 * np.abs(wanted).max())


def test_the_table_has_the_numbers_of_the_formula():
    """13 angles of half a period and 7 currents: 0.4 % of the greatest value."""
    pairs = coupling()
    pair = pairs.pairs[1]
    a, b, theta_e = points(400)
    found = pairs.core.at(1, a, b, theta_e)
    wanted = Formula().at(theta_e - behind(pair.first, pair.second, pairs.n_phases), a, b)
    for column, exact in enumerate(wanted):
        np.testing.assert_allclose(found[:, column], exact, atol=4e-3 * np.abs(exact).max())


def test_every_output_is_a_derivative_of_the_coenergy():
    core = coupling().core
    a, b, theta_e = points(200, 0.99 * I_MAX)
    h = 1e-5

    def slope(column, da=0.0, db=0.0, dtheta=0.0):
        ends = [
            core.at(0, a + s * da, b + s * db, theta_e + s * dtheta)[:, column] for s in (1, -1)
        ]
        return (ends[0] - ends[1]) / (2 * h)

    _, tau, first, second, L_first, L_second, L_mutual, *over_angle = core.at(0, a, b, theta_e).T
    for ours, wanted in (
        (tau, N_r * slope(0, dtheta=h)),
        (first, slope(0, da=h)),
        (second, slope(0, db=h)),
        (L_first, slope(2, da=h)),
        (L_second, slope(3, db=h)),
        (L_mutual, slope(2, db=h)),
        (L_mutual, slope(3, da=h)),
        (over_angle[0], N_r * slope(2, dtheta=h)),
        (over_angle[1], N_r * slope(3, dtheta=h)),
    ):
        np.testing.assert_allclose(ours, wanted, atol=2e-6 * np.abs(wanted).max())


def test_the_torque_has_a_continuous_slope_in_the_angle():
    """Also where a cell ends, and where half a period does."""
    core = coupling().core
    pairs = coupling()
    first, second = pairs.pairs[0].first, pairs.pairs[0].second
    edges = behind(first, second, pairs.n_phases) + np.pi / 36 * np.arange(72)
    a, b, h = np.full(72, 7.0), np.full(72, 11.0), 1e-6
    before, at, after = (core.at(0, a, b, edges + s * h)[:, 1] for s in (-1, 0, 1))
    jump = (after - 2 * at + before) / h
    assert np.abs(jump).max() < 1e-4 * np.abs(at).max()


def test_the_torque_of_all_pairs_is_their_sum():
    pairs = coupling()
    i = random.uniform(-1, I_MAX, (100, 3)).clip(0)
    theta_e = random.uniform(0, 6, 100)
    np.testing.assert_allclose(pairs.core.torque(i, theta_e), pairs.tau(i, theta_e), atol=1e-12)


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """Single pulses that overlap, at a held speed, on the machine of `coupled`."""
    machine = machine_file(tmp_path_factory.mktemp("coupled"))
    path = machine.with_name("drive.toml")
    text = (EXAMPLES / "single_pulse.toml").read_text()
    path.write_text(text.replace('"paper_6_4"', f'"{machine}"'))
    return path


PULSES = ["converter.u_dc_V=120", "load.speed_rpm=1500", "control.theta_on_deg=-30"]
PULSES += ["control.theta_off_deg=120", "simulation.dt_max_us=20"]


def steps(drive, until=0.02):
    loop, t = closed_loop(drive, drive.controller(), -1.0), 0.0
    while t < until:
        t = loop.advance(until)
        loop.take_periods()
    return loop.steps


@pytest.mark.parametrize("law", ["edge_mpc_mcu", "paper_rated", "deadbeat"])
def test_phases_that_couple_take_about_as_many_steps(law):
    """Under the same controller. An event of one ends the step of all, and steps of all count once;
    so what coupling costs is the work in a step (bench/instructions.csv)."""
    changes = ["machine=onelab_6_4_pairs", "converter.u_dc_V=285", "reference.tau_Nm=4.44"]
    if law == "edge_mpc_mcu":
        changes.append("sensing.i_range_A=18")
    drive = rl.load(EXAMPLES / f"{law}.toml", [*changes, "control.tau_max_Nm=4.44"])
    alone = steps(drive.with_values({"machine.pair_factor": 0.0}))
    assert steps(drive.with_values({"control.pair_torque": False})) < 1.25 * alone


class Equations:
    """The coupled phases by themselves: what one knows from `magnetics` and `Coupling.at`."""

    def __init__(self, machine):
        self.machine, self.core = machine, machine.coupling.core
        self.ends = [(pair.first, pair.second) for pair in machine.coupling.pairs]
        self.N_r, self.R, self.n = machine.N_r, machine.R, machine.n_phases

    def matrices(self, i, theta_m):
        """L, psi_theta, psi and torque."""
        theta_e = np.mod(self.N_r * theta_m - 2 * np.pi * np.arange(self.n) / self.n, 2 * np.pi)
        alone = _core.magnetics(self.machine.magnetics, np.maximum(i, 0), theta_e)
        psi, _, tau, L, slope = (column.copy() for column in alone.T)
        L, tau = np.diag(L), tau.sum()
        for n, (k, m) in enumerate(self.ends):
            x = self.core.at(n, *(np.maximum(i[[j]], 0) for j in (k, m)), theta_e[[0]])[0]
            tau += x[1]
            psi[[k, m]] += x[2:4]
            L[k, k] += x[4]
            L[m, m] += x[5]
            L[k, m] += x[6]
            L[m, k] += x[6]
            slope[[k, m]] += x[7:9]
        return L, slope, psi, tau

    def rates(self, i, theta_m, omega, u, flows):
        L, slope, *_ = self.matrices(i, theta_m)
        on = np.flatnonzero(flows)
        di = np.zeros(self.n)
        v = np.array(u)[on] - self.R * i[on] - omega * slope[on]
        di[on] = np.linalg.solve(L[np.ix_(on, on)], v)
        return di

    def opening(self, i, theta_m, omega, u, flows, k):
        """What the leg of an open phase has beyond what is induced in it."""
        L, slope, *_ = self.matrices(i, theta_m)
        induced = L[k] @ self.rates(i, theta_m, omega, u, flows) + omega * slope[k]
        return u[k] - induced - 1e-7  # zero, where no phase has current, does not open

    def run(self, t, omega, legs):
        """Currents (n, n_t). legs(theta_m): voltages of the legs, and the angle of a change."""
        i, now, flows = np.zeros(self.n), 0.0, [False] * self.n
        out = np.zeros((self.n, len(t)))
        while now < t[-1] - 1e-12:
            u, until = legs(omega * now)
            for k in range(self.n):
                if not flows[k]:
                    flows[k] = self.opening(i, omega * now, omega, u, flows, k) > 0
            part = self.smooth((now, min(t[-1], until / omega)), i, omega, u, list(flows))
            here = (t >= now) & (t <= part.t[-1] + 1e-12)
            if here.any():
                out[:, here] = part.sol(t[here])
            now, i = part.t[-1], part.y[:, -1].copy()
            for k in range(self.n):
                if part.t_events[k].size:
                    flows[k], i[k] = False, 0.0
                if part.t_events[self.n + k].size:
                    flows[k] = True
        return out

    def smooth(self, span, i, omega, u, flows):
        """To the first event: a current ends, or an open phase begins to conduct."""

        def ends(k):
            return lambda t, y: y[k] if flows[k] else 1.0

        def begins(k):
            return lambda t, y: -1.0 if flows[k] else self.opening(y, omega * t, omega, u, flows, k)

        events = [each(k) for each in (ends, begins) for k in range(self.n)]
        for n, event in enumerate(events):
            event.terminal, event.direction = True, -1 if n < self.n else 1
        return solve_ivp(
            lambda t, y: self.rates(y, omega * t, omega, u, flows),
            span,
            i,
            "DOP853",
            dense_output=True,
            events=events,
            rtol=1e-10,
            atol=1e-10,
            max_step=1e-4,
        )

    def torque(self, i, theta_m):
        return np.array([self.matrices(c, th)[3] for c, th in zip(i.T, theta_m, strict=True)])

    def flux(self, i, theta_m):
        return np.array([self.matrices(c, th)[2] for c, th in zip(i.T, theta_m, strict=True)]).T


def pulses(n, N_r, between, voltages):
    """Legs of single pulses between two electrical angles [deg]."""
    edges, (u_on, u_off) = np.radians(between), voltages

    def legs(theta_m):
        theta = N_r * theta_m + 1e-9
        behind = [np.mod(theta - 2 * np.pi * k / n - edges[0], 2 * np.pi) for k in range(n)]
        inside = [angle < np.ptp(edges) for angle in behind]
        gaps = [np.mod(e + 2 * np.pi * k / n - theta, 2 * np.pi) for k in range(n) for e in edges]
        u = [u_on if is_in else u_off for is_in in inside]
        return u, theta_m + (min(gaps) + 1e-9) / N_r

    return legs


def compared(result, equations, i, omega):
    theta_m = omega * result.t
    for ours, theirs in (
        (result.i, i),
        (result.tau, equations.torque(i, theta_m)),
        (result.psi, equations.flux(i, theta_m)),
    ):
        assert np.abs(ours - theirs).max() < 1e-6 * np.abs(theirs).max()


def test_the_plant_is_that_of_dop853(file):
    """Two phases at once, for a while three."""
    given = rl.load(file, PULSES)
    result = rl.simulate(given, until=0.0125)
    equations, omega = Equations(given.machine), 1500 * np.pi / 30
    i = equations.run(result.t, omega, pulses(3, N_r, (-30, 120), (120.0, -120.0)))
    assert ((i > 0).sum(axis=0) >= 2).mean() > 0.3
    blind = rl.simulate(given.with_values({"machine.pair_factor": 0.0}), until=0.0125)
    assert abs(blind.kpis.i_rms - result.kpis.i_rms) > 0.01 * result.kpis.i_rms
    compared(result, equations, i, omega)
    assert abs(result.kpis.energy_residual) < 1e-6


class OthersFreewheel(rl.Law):
    """Phase a magnetizes for 1.5 ms. All legs freewheel besides."""

    def reset(self, known):
        self.sample = 0

    def step(self, y, tau_ref):
        a = rl.Leg.magnetize if self.sample < 15 else rl.Leg.freewheel
        self.sample += 1
        return [rl.Order.hold(leg) for leg in (a, rl.Leg.freewheel, rl.Leg.freewheel)]


def test_a_phase_that_freewheels_conducts_where_the_flux_of_the_others_drives_it(file):
    """The rotor turns while phase a holds its current: what that induces in the others changes its
    sign, and their diodes conduct from the right instant on, and block again."""
    given = rl.load(file, PULSES)
    result = rl.simulate(given, until=9e-3, law=OthersFreewheel())
    omega = 1500 * np.pi / 30

    def legs(theta_m):
        rises = theta_m < 1.5e-3 * omega - 1e-12
        return [120.0 if rises else 0.0, 0.0, 0.0], (1.5e-3 if rises else 1.0) * omega

    equations = Equations(given.machine)
    i = equations.run(result.t, omega, legs)
    starts = np.flatnonzero(np.diff((result.i > 0).astype(int)) > 0)
    assert len(starts) >= 3  # some at no sample
    assert i[1:].max() > 0.004 * i[0].max()
    compared(result, equations, i, omega)


class Chops(OthersFreewheel):
    """Phase a magnetizes every other sample. All legs freewheel besides."""

    def step(self, y, tau_ref):
        a = rl.Leg.freewheel if self.sample % 2 else rl.Leg.magnetize
        self.sample += 1
        return [rl.Order.hold(leg) for leg in (a, rl.Leg.freewheel, rl.Leg.freewheel)]


def test_a_phase_that_opens_just_before_a_row_is_recorded_does_not_stop_the_run(tmp_path):
    """20 us and four times 5 us are apart by the last bit of a number: in a step of that length a
    current from zero is nothing but rounding."""
    machine = machine_file(tmp_path, coupling(-0.2))
    text = (EXAMPLES / "single_pulse.toml").read_text()
    path = tmp_path / "drive.toml"
    path.write_text(text.replace('"paper_6_4"', f'"{machine}"'))
    given = rl.load(path, [*PULSES, "control.T_s_us=20"])
    law = core_of(Chops(), given.known())
    loop = closed_loop(given, guarded(given, law), record_every=5e-6)
    t = loop.advance(4e-3)  # in as many steps as it takes, at most 20 000
    assert (t, loop.steps < 2000) == (4e-3, True)
    rows = loop.take_waveforms()
    currents = rows[:, [_core.waveform_columns(3).index(f"i_{k}") for k in range(3)]]
    assert currents.min() == 0 and (currents[:, 1:].max(axis=0) > 0).all()


@pytest.mark.parametrize(
    "changed",
    [
        ["load.kind='fan'", "load.k_fan_Nms2=1e-4"],
        ["source.kind='battery'", "source.C_uF=2000", "source.R_ohm=0.05"],
        ["converter.bridge='shared_switch'", "converter.v_switch_V=1", "converter.v_diode_V=0.7"],
    ],
    ids=["fan", "battery", "shared switch"],
)
def test_the_energy_closes(file, changed):
    """With everything else that lets phases depend on each other."""
    result = rl.simulate(rl.load(file, [*PULSES, *changed]), until=0.05, record=None)
    assert abs(result.kpis.energy_residual) < 1e-6


def test_without_the_pairs_a_run_has_the_bits_of_the_machine_without_them(file, tmp_path):
    text = file.with_name("coupled.toml").read_text()
    alone = file.with_name("alone.toml")
    alone.write_text(text.replace('pairs = "pairs.csv"', ""))
    path = file.with_name("drive_alone.toml")
    path.write_text(file.read_text().replace("coupled.toml", "alone.toml"))
    none = rl.simulate(rl.load(file, [*PULSES, "machine.pair_factor=0.0"]), until=0.01)
    without = rl.simulate(rl.load(path, PULSES), until=0.01)
    assert none.t.tobytes() == without.t.tobytes()
    assert none.i.tobytes() == without.i.tobytes()
    assert none.tau.tobytes() == without.tau.tobytes()


def test_three_phases_on_at_once_are_told(file):
    """For as long as three currents flow; pairs leave out what the third adds."""
    result = rl.simulate(rl.load(file, PULSES), until=0.0125)
    three = (result.i > 0).sum(axis=0) > 2
    wanted = np.diff(result.t)[three[:-1] | three[1:]].sum()
    assert result.periods.rise("three_on") == pytest.approx(wanted, rel=0.02)
    assert wanted > 0.05 * result.t[-1]
    (note,) = crowded(result.periods)
    assert "three phases or more conduct at once for" in note
    alone = rl.simulate(rl.load(file, [*PULSES, "machine.pair_factor=0.0"]), until=0.0125)
    assert crowded(alone.periods) == []
