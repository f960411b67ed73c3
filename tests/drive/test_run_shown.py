"""Figures of a run against its waveforms, and what its plots show against what it holds."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cycler import cycler
from matplotlib import rc_context
from matplotlib.figure import Figure

import reluctance as rl
from reluctance import _core
from reluctance.drive.run import events, plots
from reluctance.drive.run import kpis as figures
from reluctance.drive.run.energy_loop import EnergyLoop, energy_loops, plot_energy_loop, text
from reluctance.drive.run.events import Event, evidence, trip, tripped, unready
from reluctance.drive.run.kpis import evaluated
from reluctance.drive.run.radial_force import ForceOrder, force_orders, pole_forces
from reluctance.drive.tables.faults import Fault
from reluctance.machine.maps.pole_force import PoleForce

EXAMPLES = Path(__file__).parents[2] / "examples"
DROPS = ["converter.v_switch_V=1.5", "converter.R_switch_ohm=0.01", "converter.v_diode_V=1"]


def axes():
    return Figure().add_subplot()


@pytest.fixture(scope="module")
def run():
    """Torque sharing with a battery, drops and every event; the second half has whole periods."""
    given = [*DROPS, "source.kind=battery", "source.R_ohm=0.1", "source.C_uF=2000"]
    return rl.simulate(rl.load(EXAMPLES / "sharing_cubic.toml", given), until=0.05, record=0)


def test_key_figures_are_those_of_the_waveforms_of_whole_periods(run):
    """Straight between the events of the run, and the count of turn-ons."""
    k, drive = run.kpis, run.drive
    window, periods = evaluated(run.periods, 4)
    first, last = window["t"][[0, -1]]
    inside = (run.t >= first - 1e-12) & (run.t <= last + 1e-12)
    t, length = run.t[inside], last - first

    def mean(a, b=None):
        """Of a waveform, or of a product of two, straight between the instants."""
        a, b = a[inside], np.ones(len(t)) if b is None else b[inside]
        ends, middle = a * b, (a[1:] + a[:-1]) * (b[1:] + b[:-1]) / 4
        return float(np.diff(t) @ (ends[1:] + ends[:-1] + 4 * middle)) / 6 / length

    assert periods == k.periods >= 2 and length == pytest.approx(periods * 0.01, rel=1e-6)
    tau, tau_ref = run.tau[inside], float(run.tau_ref[-1])
    assert k.tau_mean == pytest.approx(mean(run.tau), rel=1e-4)
    assert k.tau_ref_mean == pytest.approx(tau_ref)
    assert k.torque_ripple_pp == pytest.approx(np.ptp(tau) / k.tau_mean, rel=1e-3)
    deviation = np.sqrt(mean(run.tau - k.tau_mean, run.tau - k.tau_mean))
    assert k.torque_ripple_rms == pytest.approx(deviation / k.tau_mean, rel=1e-3)
    error = np.sqrt(mean(run.tau - tau_ref, run.tau - tau_ref))
    assert k.torque_error_rms == pytest.approx(error / tau_ref, rel=1e-3)
    squares = [mean(i, i) for i in run.i]
    assert k.i_rms == pytest.approx(np.sqrt(max(squares)), rel=1e-4)
    assert k.i_peak == pytest.approx(run.i[:, inside].max(), rel=1e-6)
    assert k.p_cu == pytest.approx(drive.machine.R * sum(squares), rel=1e-4)
    assert k.p_mech == pytest.approx(mean(run.tau, run.omega_m), rel=1e-4)
    assert k.speed_mean == pytest.approx(50 * np.pi, rel=1e-6)
    steps = np.diff(t) / length  # a voltage holds from an event on
    halves = [(i[inside][1:] + i[inside][:-1]) / 2 for i in run.i]
    drawn = sum(float(steps @ (u[inside][:-1] * i)) for u, i in zip(run.u, halves, strict=True))
    assert k.p_in - k.p_dev == pytest.approx(drawn, rel=2e-3)
    assert k.p_dev > 0 and k.p_fe is None and k.p_sw is None
    assert k.efficiency == pytest.approx(k.p_mech / k.p_in)
    assert (k.u_dc_min, k.u_dc_max) == pytest.approx(
        (run.u_dc[inside].min(), run.u_dc[inside].max()), rel=1e-4
    )
    assert k.i_peak_run == pytest.approx(run.i.max(), rel=1e-6)
    assert k.u_dc_peak_run == pytest.approx(run.u_dc.max(), rel=1e-6)
    # A switch of a leg turns on in each step of its state upwards.
    ons = sum(np.maximum(np.diff(leg[inside]), 0).sum() for leg in run.leg)
    assert k.f_switch == pytest.approx(ons / 6 / length, rel=0.02)
    assert k.p_source == pytest.approx(k.p_in, rel=0.1) and k.p_source > k.p_in  # 0.1 ohm
    assert k.control_period == drive.control.T_s and k.energy_residual < 1e-6
    assert k.tracking is None and k.Q_mean is None


@pytest.mark.parametrize(
    ("p_mech", "p_in", "efficiency"),
    [
        *((8, 10, 0.8), (-10, -8, 0.8), (-1, 2, None), (1, -2, None), (0, 5, None), (-5, 0, None)),
        *((10, 8, None), (-8, -10, None), (8, 8, 1.0)),  # what was stored feeds them
    ],
)
def test_efficiency_is_of_the_way_that_the_power_takes(p_mech, p_in, efficiency):
    assert figures._efficiency(p_mech, p_in) == efficiency


@pytest.mark.parametrize(
    ("part", "whole", "ratio"),
    [(1, 4, 0.25), (1, -4, 0.25), (1, 0, None), (1, None, None), (99, 1, 99), (101, 1, None)],
)
def test_a_ratio_to_nearly_nothing_means_nothing(part, whole, ratio):
    assert figures._ratio(part, whole) == ratio


def curve(ax, label):
    (line,) = [line for line in ax.lines if line.get_label() == label]
    return line.get_data()


def test_curves_are_the_waveforms_over_milliseconds(run):
    ms = 1e3 * run.t
    torque = plots.plot_torque(axes(), run)
    for label, values in (("torque", run.tau), ("reference", run.tau_ref)):
        x, y = curve(torque, label)
        assert np.array_equal(x, ms) and np.array_equal(y, values)
    assert torque.get_xlabel() == "time (ms)" and torque.get_ylabel() == "torque (N m)"
    assert len(plots.plot_torque(axes(), replace(run, tau_ref=0 * run.tau)).lines) == 1
    currents = plots.plot_currents(axes(), run)
    parts = plots.plot_phase_torques(axes(), run)
    for k, name in enumerate(("phase a", "phase b", "phase c")):
        assert np.array_equal(curve(currents, name)[1], run.i[k])
        assert np.array_equal(curve(parts, name)[1], run.tau_ph[k])
        dashed = currents.lines[2 * k + 1]
        assert np.array_equal(dashed.get_ydata(), run.i_ref[k])
        assert dashed.get_color() == currents.lines[2 * k].get_color()
    legs = plots.plot_legs(axes(), run)
    ticks = dict(
        zip([t.get_text() for t in legs.get_yticklabels()], legs.get_yticks(), strict=True)
    )
    assert ticks == {"phase a": 6, "phase b": 3, "phase c": 0}
    assert [*legs.get_yticks(minor=True)] == [5, 7, 2, 4, -1, 1]
    for k, phase in enumerate("abc"):
        assert np.array_equal(legs.lines[k].get_ydata(), ticks[f"phase {phase}"] + run.leg[k])
    states = "magnetize / freewheel / demagnetize"
    assert legs.get_legend().get_title().get_text() == states
    speed = plots.plot_speed(axes(), run)
    assert speed.lines[0].get_ydata() == pytest.approx(1500 + 0 * run.t)


def test_a_run_of_five_seconds_is_drawn_in_seconds(run):
    for end, label, scale in ((4.99, "time (ms)", 1e3), (5.0, "time (s)", 1.0)):
        long = replace(run, t=run.t * end / run.t[-1])
        ax = plots.plot_torque(axes(), long)
        assert ax.get_xlabel() == label
        assert ax.lines[0].get_xdata()[-1] == pytest.approx(scale * end)


def test_states_and_faults_are_marked_where_they_begin(run):
    """A state of less than a fiftieth of the run has a line, but no room for its name."""
    end = run.t[-1]
    entered = [Event(0.0, "off"), Event(0.3 * end, "ready"), Event(0.31 * end, "run")]
    fault = Fault(kind="open_wire", phase="b", t_s=0.04)
    ax = plots.mark_events(axes(), replace(run, events=entered, faults=[(0.04, fault)]))
    places = [line.get_xdata()[0] for line in ax.lines]
    assert places == pytest.approx([0, 300 * end, 310 * end, 40])
    names = {text.get_text(): text.xy[0] for text in ax.texts}
    assert {*names} == {"off", "run", str(fault)} and names[str(fault)] == pytest.approx(40)
    assert names["run"] == pytest.approx(310 * end)
    assert not plots.mark_events(axes(), run).lines


def test_an_overview_has_the_whole_run_and_its_last_two_periods(run):
    drawn = plots.overview(run)
    torque, parts, currents, legs = drawn.axes
    assert torque.get_title(loc="left") == "whole run"
    assert torque.lines[0].get_xdata()[-1] == pytest.approx(50)
    for ax in (parts, currents, legs):  # a held speed would fill a panel with a constant
        assert ax.get_title(loc="left") == "last 2 periods"
        assert ax.get_xlim() == pytest.approx((30, 50), abs=0.01)  # of 10 ms each
        assert ax.lines[0].get_xdata()[0] >= 29.99
    assert parts.get_ylabel() == "torque of the phases (N m)"
    whole = plots.overview(run, last_periods=np.inf)
    assert {ax.get_title(loc="left") for ax in whole.axes} == {"whole run"}
    for t_trip, about in ((0.02, (5, 25)), (0.004, (0, 50)), (0.049, (30, 50))):
        tripped = replace(run, kpis=replace(run.kpis, t_trip=t_trip))
        title = {5: "about the trip: 2 periods", 0: "whole run", 30: "last 2 periods"}[about[0]]
        for ax in plots.overview(tripped).axes[1:]:
            assert ax.get_xlim() == pytest.approx(about, abs=0.01)
            assert ax.get_title(loc="left") == title
    rising = replace(run, omega_m=run.omega_m * np.linspace(0.9, 1, len(run.t)))
    speed = plots.overview(rising).axes[1]
    assert speed.get_ylabel() == "speed (rpm)"
    assert speed.lines[0].get_ydata()[0] == pytest.approx(1350)


def test_a_run_on_an_array_shows_its_power_under_what_is_available():
    """The array's curve at the voltage gives the current; its maximum is the dashed line."""
    drive = rl.load(EXAMPLES / "sun_cloud.toml")
    found = rl.simulate(drive, until=0.005, record=1e-4)
    found = replace(
        found, u_dc=np.linspace(150, 300, len(found.t)), omega_m=found.t
    )  # over the whole curve
    link, power = plots.plot_link(axes(), found), plots.plot_power(axes(), found)
    best = drive.source.available(found.t)
    assert curve(power, "available")[1] == pytest.approx(best, rel=1e-6)
    taken = curve(power, "from the array")[1]
    assert np.all(taken <= best) and taken.max() == pytest.approx(best.max(), rel=1e-3)
    assert taken[-1] < 0.1 * best.max()  # near the open circuit
    at_best = curve(link, "maximum power point")[1]
    assert np.array_equal(curve(link, "dc link")[1], found.u_dc)
    assert 200 < at_best.min() <= at_best.max() < 240  # seven modules of 31 V
    flow = plots.plot_flow(axes(), found)
    assert flow.lines[0].get_ydata() == pytest.approx(3600 * found.Q)
    with rc_context({"axes.prop_cycle": cycler(color=["0.1", "0.3", "0.5", "0.7"])}):
        grey = plots.plot_flow(axes(), found)  # its axis has the colour of its line in any style
    assert grey.lines[0].get_color() == grey.yaxis.label.get_color() == "0.5"
    panels = plots.overview(found).axes
    assert [ax.get_ylabel() for ax in panels[:4]] == [
        "torque (N m)", "speed (rpm)", "voltage (V)", "power (W)",
    ]  # fmt: skip
    asked = plots.plot_speed(axes(), found)
    assert asked.get_ylabel() == "speed (rpm)" and len(asked.figure.axes) == 2


def test_a_blocking_diode_drops_its_voltage_between_the_array_and_the_link():
    """The array is at its maximum power point where the link is 5 V below the voltage of it."""
    drive = rl.load(EXAMPLES / "sun_cloud.toml", ["source.blocking_diode_V=5"])
    run = rl.simulate(drive, until=0.002, record=1e-4)
    run = replace(run, u_dc=np.linspace(150, 300, len(run.t)), t=0 * run.t)
    link, power = plots.plot_link(axes(), run), plots.plot_power(axes(), run)
    u, p = curve(link, "maximum power point")[1][0], curve(power, "available")[1][0]
    at = replace(run, u_dc=np.full(len(run.t), u - 5))
    taken = curve(plots.plot_power(axes(), at), "from the array")[1]
    assert taken == pytest.approx(np.full(len(run.t), p * (u - 5) / u))


def test_an_energy_loop_is_drawn_over_the_curves_of_the_machine(run):
    loop = energy_loops(run)[0]
    ax = plot_energy_loop(axes(), run, loop)
    most = 1.05 * loop.i.max()
    for angle, line in zip((0, 45, 90, 135, 180), ax.lines, strict=False):
        i, psi = line.get_data()
        assert i[-1] == pytest.approx(most)
        assert psi == pytest.approx(run.drive.machine.psi(i, np.radians(angle)))
    assert np.array_equal(ax.lines[5].get_ydata(), loop.psi)
    assert ax.get_xlim()[1] == pytest.approx(1.2 * loop.i.max())
    assert ax.get_title().startswith("phase a: area ")
    made = EnergyLoop(1, loop.i, loop.psi, area=10.5, work=-10.0)
    assert made.difference == pytest.approx(2.05)
    assert text(made) == "area 10.5 J, torque x angle -10 J, apart 2.0e+00"
    assert replace(made, work=0.0).difference == 0


def test_a_run_that_ends_before_the_drive_runs_or_after_it_has_tripped_is_told():
    early = [Event(0.0, "off"), Event(0.1, "precharge")]
    (told,) = unready(early, 0.15)
    assert "ends in `precharge`, which began at 0.1 s" in told
    ran = [*early, Event(0.2, "run")]
    fault = [*ran, Event(0.3, "fault", 8, "dead (status 8)")]
    again = [*fault, Event(0.35, "run")]
    for entered in (ran, fault, None, [], [*ran, Event(0.39, "off")]):
        assert unready(entered, 0.4) == []
    for entered in (ran, fault, [*ran, Event(0.3, "off")]):
        (told,) = unready(entered, 0.39)
        assert told.startswith("the drive reaches `run` at 0.2 s, within the half")
    (told,) = unready([*early, Event(0.15, "off")], 0.2)
    assert told.endswith("it was disabled before; set clear_s later, or restart_s")
    assert trip(ran, 1.0) is None and trip(None, 1.0) is None and tripped(None) == []
    assert trip(fault, 1.0) == 0.3 and "trips at 0.3 s" in tripped(0.3)[0]
    assert trip(again, 0.7) is None and trip(again, 0.69) == 0.3  # runs from its middle on
    assert str(fault[-1]) == "fault: dead (status 8)" and str(ran[-1]) == "run"
    assert fault[-1].with_units() == {
        "t_s": 0.3, "mode": "fault", "status": 8, "text": "dead (status 8)",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("phase", "value", "limit", "told"),
    [
        (1, 12.34567, 10.0, "hot (status 3, phase 1 (b): 12.35 V, above the limit of 10 V)"),
        (0, 1.0, -2.0, "hot (status 3, phase 0 (a): 1 V, above the limit of -2 V)"),
        (-1, 12.0, 0.0, "hot (status 3)"),
    ],
)
def test_a_fault_is_told_with_its_evidence(phase, value, limit, told):
    assert evidence("hot", 3, phase, value, limit) == told


def test_orders_of_a_force_have_the_mean_and_the_oscillation_of_the_poles(run):
    """A force of 3 N/A at any angle: a current that all phases have makes order 0 alone; one phase
    on opposite poles of six makes orders 0 and 2."""
    theta, i = np.linspace(0, np.pi, 5), np.linspace(0, 100, 5)
    table = PoleForce(i=i, theta_e=theta, force=3.0 * np.outer(i, np.ones(5)))

    class Machine:
        N_s, N_r, n_phases, pole_force = 6, 4, 3, table

    first, last = evaluated(run.periods, 4)[0]["t"][[0, -1]]
    t = np.linspace(first, last, 4096)
    turns = 2 * np.pi * (t - first) / (last - first)
    wave = 10 + 4 * np.cos(5 * turns)
    drive = type("Drive", (), {"machine": Machine})
    made = replace(run, t=t, theta_m=0 * t, i=np.tile(wave, (3, 1)), drive=drive)
    (all_poles,) = force_orders(made)
    f = 5 / (last - first)
    assert all_poles.order == 0 and all_poles.mean == pytest.approx(30, rel=1e-3)
    assert all_poles.max == pytest.approx(42, rel=1e-3)
    assert all_poles.amplitude == pytest.approx(12, rel=1e-3)
    assert abs(all_poles.f) == pytest.approx(f, rel=1e-6)
    one = replace(made, i=np.stack([wave, 0 * wave, 0 * wave]))
    mean, ovals = force_orders(one)
    assert (mean.order, ovals.order) == (0, 2)
    assert mean.mean == pytest.approx(10, rel=1e-3)  # two of six poles
    assert ovals.mean == pytest.approx(20, rel=1e-3)  # f_0 + f_3 of the series: 2/6, both signs
    lags = [wave * 0 + 10 + 4 * np.cos(5 * turns - 2 * np.pi * k / 3) for k in range(3)]
    found = {x.order: x for x in force_orders(replace(made, i=np.stack(lags)))}
    assert found[0].amplitude == pytest.approx(0, abs=1e-2) and found[2].amplitude > 5
    assert abs(found[2].f) == pytest.approx(f, rel=1e-6)
    backwards = [wave * 0 + 10 + 4 * np.cos(5 * turns + 2 * np.pi * k / 3) for k in range(3)]
    other = {x.order: x for x in force_orders(replace(made, i=np.stack(backwards)))}
    assert other[2].f == pytest.approx(-found[2].f)
    shown = ForceOrder(2, 1.0, 2.0, -50.0, 0.5)
    assert str(shown) == ("order 2: 1 N mean, 2 N greatest; largest oscillation 0.5 N at 50 Hz")
    assert shown.with_units() == {
        "order": 2, "mean_N": 1.0, "max_N": 2.0, "f_Hz": -50.0, "amplitude_N": 0.5,
    }  # fmt: skip


@pytest.mark.parametrize(("N_s", "N_r", "n_phases"), [(6, 4, 3), (12, 8, 3), (8, 6, 4), (6, 10, 3)])
def test_a_pole_has_the_current_of_its_phase_and_the_angle_of_the_rotor_to_itself(
    N_s, N_r, n_phases
):
    """Poles stand 360/N_s deg apart; phases follow each other by 360/n_phases electrical."""

    class Machine:
        class pole_force:
            @staticmethod
            def at(i, theta_e):
                return np.stack([i, theta_e])

    Machine.N_s, Machine.N_r, Machine.n_phases = N_s, N_r, n_phases
    theta_m = np.array([0.0, 0.3, 1.1])
    phases = np.arange(n_phases)
    i = np.tile(phases[:, None] + 1.0, 3)  # phase k has k + 1 A
    of_pole, theta_e = pole_forces(Machine, i, theta_m)
    for pole in range(N_s):
        own = N_r * (theta_m - 2 * np.pi * pole / N_s)
        assert np.exp(1j * theta_e[pole]) == pytest.approx(np.exp(1j * own))
        of_phases = N_r * theta_m[0] - 2 * np.pi * phases / n_phases
        (k,) = np.flatnonzero(np.abs(np.exp(1j * of_phases) - np.exp(1j * own[0])) < 1e-9)
        assert (of_pole[pole] == k + 1).all()


def test_every_status_has_a_unit_or_none_to_have():
    """A new status needs its line. 1, 15 and 20 have no limit, and 18 one of two quantities."""
    known = {n for n in range(1, 100) if _core.describe_status(n) != "unknown"}
    without = {1, 15, 18, 20}
    assert known == {*events.UNITS, events.OUT_OF_RANGE, events.FROZEN} | without
