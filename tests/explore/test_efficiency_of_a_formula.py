"""Efficiency maps whose loss is a formula: between the nodes, what is held, driven and shown."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import reluctance as rl
from reluctance.explore.efficiency_map import map as maps
from reluctance.explore.efficiency_map import plots
from reluctance.explore.efficiency_map.cycle import Cycle, driven, pieces, read_cycle
from reluctance.explore.efficiency_map.locked import at, length, rising
from reluctance.explore.efficiency_map.map import EfficiencyMap
from reluctance.explore.efficiency_map.text import as_object, rows
from reluctance.machine.optimum import Envelope

CUBIC = Path(__file__).parents[2] / "examples" / "sharing_cubic.toml"
OMEGA, TAU = np.array([50.0, 100.0, 200.0]), np.array([10.0, 20.0, 40.0])
PER_SPEED, PER_TORQUE, IRON = 0.1, 0.5, 0.03  # loss/|tau| = 0.1 omega + 0.5 |tau| + 0.03 omega


@pytest.fixture(scope="module")
def drive():
    return rl.load(CUBIC)


def made(drive, sign=1.0, tau_max=(40.0, 40.0, 30.0)):
    """Linear in speed and torque, as the interpolation is: right between the nodes too."""
    w, x = np.meshgrid(OMEGA, TAU, indexing="ij")
    copper, iron = PER_SPEED * w + PER_TORQUE * x, IRON * w
    figures = {name: n + 0.001 * w + 0.01 * x for n, name in enumerate(maps.FIGURES, 1)}
    kinds = {"p_cu_W": copper, "p_fe_W": iron}
    most = sign * np.array(tau_max)
    return EfficiencyMap(drive, 240.0, OMEGA, sign * TAU, most, copper + iron, kinds, figures, 9)


def loss(omega, tau):
    return abs(tau) * ((PER_SPEED + IRON) * omega + PER_TORQUE * abs(tau))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_losses_between_the_nodes_are_those_of_the_formula(drive, sign):
    found = made(drive, sign)
    for omega, size in ((50.0, 10.0), (73.0, 31.0), (180.0, 12.5), (200.0, 30.0)):
        tau = sign * size
        assert found.loss(omega, tau) == pytest.approx(loss(omega, tau))
        assert found.loss(omega, tau, "p_fe_W") == pytest.approx(IRON * omega * size)
        p_in = tau * omega + loss(omega, tau)
        assert found.p_in(omega, tau) == pytest.approx(p_in)
        eta = tau * omega / p_in if sign > 0 else p_in / (tau * omega)
        assert found.efficiency(omega, tau) == pytest.approx(eta)
        assert found.figure("i_rms_A", omega, tau) == pytest.approx(3 + omega / 1e3 + size / 100)
    grid = found.loss(*np.meshgrid([60.0, 70.0], sign * np.array([11.0, 12.0, 13.0])))
    assert grid.shape == (3, 2) and grid[2, 1] == pytest.approx(loss(70.0, 13.0))


def test_outside_the_grid_the_loss_over_torque_is_that_of_its_edge(drive):
    found = made(drive)
    assert found.loss(20.0, 5.0) == pytest.approx(5 * loss(50.0, 10.0) / 10)
    assert found.loss(300.0, 50.0) == pytest.approx(50 * loss(200.0, 40.0) / 40)


def test_no_efficiency_where_both_sides_feed_the_losses(drive):
    slow = replace(made(drive, -1.0), omega=np.array([1.0, 2.0, 3.0]))
    assert slow.p_in(2.0, -20.0) > 0 and np.isnan(slow.efficiency(2.0, -20.0))
    assert np.isnan(made(drive).efficiency(100.0, 0.0))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_efficiency_of_milliwatts_is_that_of_kilowatts(drive, sign):
    """A thousandth of the torque, at the same speed and loss over torque."""
    large = made(drive, sign)
    small = replace(large, tau=large.tau / 1e3)
    assert abs(small.p_in(60.0, sign * 0.012)) < 1
    eta = large.efficiency(60.0, sign * 12.0)
    assert small.efficiency(60.0, sign * 0.012) == pytest.approx(eta)


def test_a_map_that_has_no_efficiency_is_told_and_drawn(drive, tmp_path):
    """Braking at 1 to 3 rad/s: the copper takes more than the shaft gives."""
    slow = replace(made(drive, -1.0), omega=np.array([1.0, 2.0, 3.0]))
    assert slow.best() is None
    assert "both feed the losses" in dict(rows(slow, None))["best efficiency of the grid"]
    told = as_object(slow, None)
    assert [told[f"best_{name}"] for name in ("efficiency", "speed_rpm", "tau_Nm")] == [None] * 3
    plots.save(slow, tmp_path / "slow.png")
    assert (tmp_path / "slow.png").stat().st_size > 10_000


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_torque_is_held_up_to_the_greatest_between_the_speeds(drive, sign):
    """30 N m at 200 rad/s, 40 at 100: 35 half way."""
    found = made(drive, sign)
    for omega, size, held in (
        *((150.0, 35.0, True), (150.0, 35.1, False), (200.0, 30.0, True), (200.1, 1.0, False)),
        *((0.0, 40.0, True), (-0.1, 1.0, False), (100.0, 40.0, True), (100.0, 40.1, False)),
    ):
        assert found.holds(omega, sign * size) == held, (omega, size)
        assert not found.holds(omega, -sign * size)
    assert found.holds(100.0, 0.0) and not found.holds(201.0, 0.0)


def test_the_table_has_every_figure_and_none_where_the_torque_is_not_held(drive):
    table = made(drive).columns()
    assert [*table["speed_rpm"]] == pytest.approx(np.repeat(OMEGA, 3) * 30 / np.pi)
    assert [*table["tau_Nm"]] == [10, 20, 40] * 3
    held = [True] * 8 + [False]  # 40 N m at 200 rad/s
    for name in ("efficiency", "p_in_W", "loss_W", "p_cu_W", "p_fe_W", *maps.FIGURES):
        assert [*np.isfinite(table[name])] == held, name
    expected = [loss(w, x) for w in OMEGA for x in TAU][:8]
    assert [*table["loss_W"][:8]] == pytest.approx(expected)
    assert table["loss_W"][:8] == pytest.approx((table["p_cu_W"] + table["p_fe_W"])[:8])
    eta = [w * x / (w * x + loss(w, x)) for w in OMEGA for x in TAU][:8]
    best = int(np.argmax(eta))
    assert made(drive).best() == pytest.approx((eta[best], OMEGA[best // 3], TAU[best % 3]))


def by_hand(t, omega, tau, most):
    """Energies of straight lines of speed and torque: a million instants, the trapezoidal rule. The
    loss over torque below the least torque of the map is that of the least."""
    x = np.linspace(t[0], t[-1], 1_000_001)
    omega, tau = np.interp(x, t, omega), np.interp(x, t, tau)
    held = 1.0 * (np.abs(tau) <= most(omega))
    below = (omega < OMEGA[0]) | (np.abs(tau) < TAU[0])
    rate = (PER_SPEED + IRON) * omega + PER_TORQUE * np.maximum(np.abs(tau), TAU[0])
    p_mech, lost = held * tau * omega, held * np.abs(tau) * rate

    def sum_of(y):
        return np.trapezoid(y, x)

    return {
        "E_mech_J": sum_of(np.maximum(p_mech, 0)),
        "E_braked_J": sum_of(np.maximum(-p_mech, 0)),
        "E_in_J": sum_of(np.maximum(p_mech + lost, 0)),
        "E_returned_J": sum_of(np.maximum(-p_mech - lost, 0)),
        "E_loss_J": sum_of(lost),
        "E_fe_J": sum_of(held * IRON * omega * np.abs(tau)),
        "held_part_of_time": sum_of(held) / (t[-1] - t[0]),
        "below_map_part_of_time": sum_of(held * below) / (t[-1] - t[0]),
    }


def test_a_cycle_takes_the_integral_along_straight_lines_of_speed_and_torque(drive):
    """Uneven steps, motoring and braking, a torque beyond what is held."""
    t = np.array([0.0, 1.0, 4.0, 6.0, 7.0, 7.5])
    omega, tau = np.array([60.0, 150, 150, 100, 200, 60]), np.array([20.0, 30, -30, -20, 39, 10])
    both = driven(Cycle(t, omega, tau), made(drive), made(drive, -1.0)).with_units()
    held = made(drive)
    expected = by_hand(t, omega, tau, lambda w: np.interp(w, held.omega, held.tau_max))
    assert expected["E_braked_J"] > 1000 and 0.9 < expected["held_part_of_time"] < 1
    for name, value in expected.items():
        assert both[name] == pytest.approx(value, rel=2e-3), name
    assert both["E_loss_J"] == pytest.approx(both["E_cu_J"] + both["E_fe_J"])
    alone = driven(Cycle(t, omega, tau), made(drive))
    assert alone.E_braked == 0 and alone.held < both["held_part_of_time"]


@pytest.mark.parametrize(("tau", "braking"), [(0.0, 0), (0.5, 0), (20.0, 0), (-0.5, 1), (-20.0, 1)])
def test_each_torque_is_of_the_map_of_its_direction(drive, tau, braking):
    """No torque is of the one that motors."""
    cycle = Cycle(np.array([0.0, 10.0]), np.full(2, 100.0), np.full(2, tau))
    assert driven(cycle, made(drive)).held == 1 - braking
    assert driven(cycle, made(drive), made(drive, -1.0)).held == 1


def test_a_ramp_through_zero_torque_shares_its_energy_by_the_straight_line(drive):
    """From 30 to -30 N m at 100 rad/s in 10 s: 30*100/2*5 = 7500 J to the shaft and from it."""
    ramp = Cycle(np.array([0.0, 10.0]), np.full(2, 100.0), np.array([30.0, -30.0]))
    found = driven(ramp, made(drive), made(drive, -1.0))
    assert found.E_mech == pytest.approx(7500) and found.E_braked == pytest.approx(7500)
    assert found.E_in - found.E_returned == pytest.approx(found.loss["loss"])
    assert found.efficiency is None


def test_rows_put_in_along_a_straight_line_do_not_change_a_cycle(drive):
    t, omega, tau = np.array([[0.0, 5, 10, 12], [50, 150, 150, 50], [30, 33, -20, 0]])
    maps_of_both = made(drive), made(drive, -1.0)
    coarse = driven(Cycle(t, omega, tau), *maps_of_both).with_units()
    x = np.unique(np.append(np.linspace(0, 12, 77), t))
    fine = Cycle(x, np.interp(x, t, omega), np.interp(x, t, tau))
    other = driven(fine, *maps_of_both).with_units()
    below = "below_map_part_of_time"  # whole pieces are counted
    assert coarse.pop(below) == pytest.approx(other.pop(below), abs=2e-3)
    assert coarse == pytest.approx(other, rel=1e-4)


def test_a_long_cycle_takes_no_more_memory_for_its_many_steps(drive):
    t = np.arange(4e5)
    tau = np.where(t % 2, 30.0, 10.0)  # across the map and back with every row
    many = Cycle(t, np.full(len(t), 100.0), tau)
    assert len(pieces(many, 200.0, 40.0)[0].t) <= 2 * len(t)
    assert driven(many, made(drive)).E_mech == pytest.approx(20 * 100 * t[-1])


def test_pieces_of_a_line_change_by_a_two_hundredth_of_the_map(drive):
    """Half of the greatest torque takes 100 pieces and half of the greatest speed as many; what
    holds still takes one. The middles of equal pieces lie on the line."""
    t, omega, tau = np.array([[0.0, 1, 3, 4], [100, 100, 200, 200], [30, 10, 10, 10]])
    found, dt = pieces(Cycle(t, omega, tau), 200.0, 40.0)
    assert [*dt] == pytest.approx([0.01] * 100 + [0.02] * 100 + [1.0])
    assert found.t == pytest.approx(np.cumsum(dt) - dt / 2)
    assert found.omega == pytest.approx(np.interp(found.t, t, omega))
    assert found.tau == pytest.approx(np.interp(found.t, t, tau))


def test_a_cycle_is_read_in_any_order_of_columns_in_its_units(tmp_path):
    (tmp_path / "c.csv").write_text("tau_Nm,t_s,speed_rpm,note\n-5,0,0,a\n7,2.5,3000,b\n")
    cycle = read_cycle(tmp_path / "c.csv")
    assert [*cycle.t] == [0, 2.5] and [*cycle.tau] == [-5, 7]
    assert [*cycle.omega] == pytest.approx([0, 100 * np.pi])
    (tmp_path / "c.csv").write_text("t_s,speed_rpm,tau_Nm\n0,1,1\n")
    with pytest.raises(rl.ParameterError, match="at least two rows"):
        read_cycle(tmp_path / "c.csv")


def test_lines_for_people_have_their_units(drive):
    found = made(drive)
    taken = driven(Cycle(np.array([0.0, 3600.0]), np.full(2, 100.0), np.full(2, 20.0)), found)
    eta, omega, tau = found.best()
    lost = loss(100.0, 20.0)
    assert dict(rows(found, taken)) == {
        "speeds": "477.46 to 1909.9 rpm",
        "greatest torque held, of those asked for": "40 N m",
        "best efficiency of the grid": f"{100 * eta:.2f}%",
        "at": f"{omega * 30 / np.pi:.5g} rpm, {tau:.4g} N m",
        "losses counted": "copper, iron",
        "switched runs made now": "9",
        "cycle: energy to the shaft": "2000 Wh",
        "cycle: energy from the shaft": "0 Wh",
        "cycle: energy from the dc link": f"{2000 + lost:.4g} Wh",
        "cycle: energy back to the dc link": "0 Wh",
        "cycle: all losses": f"{lost:.4g} Wh",
        "cycle: efficiency": f"{100 * 2000 / (2000 + lost):.2f}%",
        "cycle: time within what the drive holds": "100.0%",
        "cycle: time below the map's first speed or torque": "0.0%",
    }
    told = as_object(found, None)
    assert told["cycle"] is None and told["ran"] == 9 and told["u_dc_V"] == 240
    assert told["tau_max_Nm"] == [40, 40, 30] and told["map"]["loss_W"][-1] is None
    assert told["speed_rpm"] == pytest.approx(OMEGA * 30 / np.pi)
    assert told["best_speed_rpm"] == pytest.approx(omega * 30 / np.pi)


def test_figures_stand_over_the_torque_that_was_achieved(drive):
    """Half of what is asked up to 20 N m, then nothing more: past the limit a run only wastes."""
    asked = np.array([4.0, 8.0, 16.0, 32.0])
    mean = np.array([[4.0, 8.0, 16.0, 32.0], [2.0, 4.0, 8.0, 8.4], [np.nan] * 4])
    wasted = np.array([[1.0] * 4, [1.0, 1.0, 1.0, 50.0], [1.0] * 4])
    figures = {
        "tau_mean_Nm": mean,
        "p_cu_W": mean * (1 + mean) * wasted,
        "p_dev_W": 0.1 * mean,
        "p_sw_W": np.full_like(mean, np.nan),
        "p_fe_W": 2.0 * mean,
        **{name: 10.0 + mean for name in maps.FIGURES},
    }
    found = maps._over_achieved(drive, 240.0, OMEGA, asked, figures, ran=12)
    assert set(found.kinds_per_torque) == {"p_cu_W", "p_dev_W", "p_fe_W"}
    assert [*found.tau_max] == [32, 8.4, 0]
    assert found.kinds_per_torque["p_cu_W"][0] == pytest.approx(1 + asked)
    assert found.loss_per_torque[0] == pytest.approx(1 + asked + 0.1 + 2)
    assert found.kinds_per_torque["p_cu_W"][1] == pytest.approx([5, 9, 9, 9])  # its edge is kept
    assert found.figures["i_rms_A"][1] == pytest.approx([14, 18, 18, 18])
    assert np.isnan(found.loss_per_torque[2]).all()
    mirrored = {name: -v if name == "tau_mean_Nm" else v for name, v in figures.items()}
    braking = maps._over_achieved(drive, 240.0, OMEGA, -asked, mirrored, ran=12)
    assert [*braking.tau_max] == [-32, -8.4, 0]
    assert braking.loss_per_torque[:2] == pytest.approx(found.loss_per_torque[:2])


def test_a_torque_is_held_from_97_percent_on(drive):
    """What a run misses by is then its own ripple, not its limit."""
    for share, most in ((0.98, 20.0), (0.96, 19.2)):
        mean = share * np.array([[10.0, 20.0]])
        figures = {name: mean.copy() for name in (*maps.LOSSES, *maps.FIGURES, "tau_mean_Nm")}
        found = maps._over_achieved(drive, 240.0, OMEGA[:1], np.array([10.0, 20.0]), figures, 2)
        assert [*found.tau_max] == pytest.approx([most])


@pytest.mark.parametrize(
    ("achieved", "rises"),
    [([1, 2, 3], [1, 1, 1]), ([1, 1.05, 3], [1, 0, 1]), ([3, 2, 2.5], [1, 0, 0]), ([1, 1.2, 1.25],
     [1, 1, 0])],
)  # fmt: skip
def test_a_step_of_the_reference_that_gives_less_than_a_tenth_of_it_is_the_limit(achieved, rises):
    assert [*rising(np.array([1.0, 2.0, 3.0]), np.array(achieved, float))] == rises


def test_a_point_is_a_locked_shaft_on_a_stiff_link_for_six_periods(drive):
    point = at(drive, u_dc=200.0, omega=100.0, tau=12.0, tau_max=30.0)
    assert point.converter.u_dc_V == 200 and point.source.kind == "stiff"
    assert point.load.kind == "locked" and point.omega_nominal == pytest.approx(100)
    assert point.reference.course[1] == [12] and point.tau_max == 30
    assert length(drive, 10.0) == pytest.approx(6 * 2 * np.pi / (4 * 10))  # four rotor poles
    assert length(drive, 5000.0) == 0.02


def test_axes_by_default_reach_twice_the_speed_and_the_greatest_torque(drive, monkeypatch):
    """What would be run: ten speeds from a tenth on, eight torques from a twentieth on; the tables
    of the law reach to the greatest torque of the drive, or of the point."""
    asked = {}

    def noted(base, columns, shape, **given):
        asked.update(columns=columns, shape=shape, base=base)
        raise KeyboardInterrupt

    monkeypatch.setattr(maps, "swept", noted)
    with pytest.raises(KeyboardInterrupt):
        maps.efficiency(drive)
    assert asked["shape"] == (10, 8, 1)
    rpm, tau = (np.array(asked["columns"][k]) for k in ("load.speed_rpm", "reference.tau_Nm"))
    top = 2 * drive.omega_nominal * 30 / np.pi
    assert rpm.reshape(10, 8)[:, 3] == pytest.approx(np.linspace(0.1 * top, top, 10))
    most = drive.tau_max
    assert tau.reshape(10, 8)[4] == pytest.approx(np.linspace(0.05 * most, most, 8))
    ends = np.array(asked["columns"]["simulation.until_s"])
    assert ends[0] == pytest.approx(length(drive, rpm[0] * np.pi / 30))
    assert {*asked["columns"]["control.tau_max_Nm"]} == {most}
    assert asked["base"].converter.u_dc_V == drive.converter.u_dc_V
    with pytest.raises(KeyboardInterrupt):
        maps.efficiency(drive, omega=[200.0, 100.0], tau=[2 * most, most / 2], u_dc=150)
    assert asked["columns"]["reference.tau_Nm"] == [most / 2, 2 * most] * 2
    assert asked["columns"]["control.tau_max_Nm"] == [most, 2 * most] * 2
    assert asked["columns"]["load.speed_rpm"][::2] == pytest.approx([954.93, 1909.86], rel=1e-5)
    assert asked["base"].converter.u_dc_V == 150


def test_a_figure_has_a_panel_for_each_quantity_and_the_edge_of_what_is_held(drive):
    found, braking = made(drive), made(drive, -1.0)
    envelope = Envelope(OMEGA, np.array([50.0, 45.0, 35.0]), *np.ones((3, 3)))
    cycle = Cycle(np.array([0.0, 1.0]), np.array([60.0, 150.0]), np.array([20.0, -30.0]))
    panels = [
        ax
        for ax in plots.figure(found, envelope=envelope, cycle=cycle, braking=braking).axes
        if ax.get_title()
    ]
    assert [ax.get_title() for ax in panels] == [
        "efficiency (%)",
        "all losses (W)",
        "loss: copper (W)",
        "loss: iron (W)",
        "torque ripple, rms over mean (%)",
        "rms phase current (A)",
    ]
    rpm = OMEGA * 30 / np.pi
    for ax in panels:
        held, braked, most = ax.lines[:3]
        assert held.get_xdata() == pytest.approx(rpm) and [*held.get_ydata()] == [40, 40, 30]
        assert [*braked.get_ydata()] == [-40, -40, -30]
        assert most.get_xdata() == pytest.approx(rpm) and [*most.get_ydata()] == [50, 45, 35]
        assert ax.get_xlim() == (0, pytest.approx(rpm[-1]))
        assert ax.get_ylim() == pytest.approx((-42, 42))
    points = panels[0].lines[3]
    assert [*points.get_ydata()] == [20, -30] and points.get_xdata()[0] == pytest.approx(
        60 * 30 / np.pi
    )
    assert len(panels[1].lines) == 3  # the cycle stands on the efficiency alone
    one = plots.figure(replace(found, kinds_per_torque={"p_cu_W": found.loss_per_torque}))
    titles = [ax.get_title() for ax in one.axes if ax.get_title()]
    assert len(titles) == 4 and "copper" not in "".join(titles)  # they are all losses
    assert [*one.get_size_inches()] == pytest.approx([10, 7.8])  # two columns of two panels
    assert [*panels[0].figure.get_size_inches()] == pytest.approx([15, 7.8])
    none = replace(found, kinds_per_torque={**found.kinds_per_torque, "p_sw_W": np.zeros((3, 3))})
    assert not any("switching" in ax.get_title() for ax in plots.figure(none).axes)
    back = [ax for ax in plots.figure(braking).axes if ax.get_title()]
    assert back[0].get_ylim() == pytest.approx((-42, 0))


@pytest.mark.parametrize(("part", "drawn"), [(0.9e-6, False), (1.1e-6, True)])
def test_a_kind_of_loss_below_a_millionth_of_all_has_no_panel(drive, part, drawn):
    found = made(drive)
    least = part * found.loss_per_torque  # all are about 5 W/(N m)
    found = replace(found, kinds_per_torque={**found.kinds_per_torque, "p_sw_W": least})
    assert any("switching" in ax.get_title() for ax in plots.figure(found).axes) == drawn


def test_levels_are_round_numbers_within_the_values_and_nine_at_most(drive, monkeypatch):
    """Between 68 and 86 % of an efficiency, and 2 and 140 % of a ripple."""
    chosen = []
    monkeypatch.setattr(plots, "BoundaryNorm", lambda levels, *_, **__: chosen.append(levels))
    found = made(drive)
    ripple = np.broadcast_to(0.015 + (TAU - 10) / 20, found.loss_per_torque.shape)
    found = replace(found, figures={**found.figures, "torque_ripple_rms": ripple})
    for panel in ("efficiency", "torque_ripple_rms"):
        plots._panel(plots.Figure().add_subplot(), [found], panel)
    assert chosen == [
        [0.7, 0.75, 0.8, 0.82, 0.84, 0.86],
        [0.03, 0.05, 0.07, 0.1, 0.15, 0.3, 0.5, 0.7, 1],  # of ten, without 0.2
    ]


def test_what_is_drawn_is_the_map_where_the_torque_is_held(drive):
    found = made(drive)
    for panel, expected in (
        ("loss", loss),
        ("efficiency", lambda w, x: w * x / (w * x + loss(w, x))),
        ("p_fe_W", lambda w, x: IRON * w * x),
        ("torque_ripple_rms", lambda w, x: 2 + w / 1e3 + x / 100),
    ):
        omega, tau, z = plots._fine(found, panel)
        assert z.shape == (160, 160)
        assert (omega.min(), omega.max(), tau.min(), tau.max()) == (50, 200, 10, 40)
        assert [*np.ravel(z.mask)] == [*~found.holds(omega, tau).ravel()]
        assert z.compressed() == pytest.approx(expected(omega, tau)[~z.mask])


def test_levels_of_a_flat_panel_are_still_levels(drive):
    flat = replace(made(drive), loss_per_torque=np.full((3, 3), 5.0), kinds_per_torque={})
    assert len(plots.figure(flat).axes) >= 4


def test_an_envelope_far_above_the_torques_is_said_to_be(drive):
    high = Envelope(OMEGA, np.array([60.0, 55.0, 43.0]), *np.ones((3, 3)))
    for envelope, said in ((high, True), (replace(high, tau_max=high.tau_max - 2), False)):
        (ax, *_) = plots.figure(made(drive), envelope=envelope).axes
        names = [line.get_label() for line in ax.lines]
        assert any("above the torques shown" in name for name in names) == said


def test_a_shared_switch_has_no_limit(drive):
    from reluctance.explore.efficiency_map.envelope import envelope_over

    shared = SimpleNamespace(converter=SimpleNamespace(bridge="shared_switch"))
    with pytest.raises(rl.ParameterError, match="share no switch; add --no-envelope"):
        envelope_over(SimpleNamespace(drive=shared))


@pytest.mark.parametrize("side", [1, -1])
def test_an_envelope_is_of_the_speeds_the_voltage_and_the_side_of_the_map(monkeypatch, drive, side):
    from reluctance.explore.efficiency_map import envelope

    asked = {}

    def noted(point, omega, **how):
        asked.update(point=point, omega=omega, **how)

    monkeypatch.setattr(envelope, "torque_speed_envelope", noted)
    found = SimpleNamespace(drive=drive, u_dc=123.0, omega=OMEGA, tau=side * np.array([5.0, 20.0]))
    envelope.envelope_over(found)
    assert asked["point"].u_dc == 123.0 and asked["direction"] == side
    assert asked["omega"][0] == OMEGA[0] and asked["omega"][-1] == OMEGA[-1]
    assert np.allclose(np.diff(asked["omega"], 2), 0) and len(asked["omega"]) > len(OMEGA)
    assert asked["n_points"] % drive.machine.n_phases == 0
