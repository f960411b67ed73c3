"""The guide over speed: its interpolation, its weights, and the laws that follow it."""

import sys
from dataclasses import replace

import numpy as np
import pytest
from firmware_tools import ROOT
from mpc_loop import PAPER, RATED, RPM, STUDY, U_DC, Point, controller, figures

import reluctance as rl
from reluctance import _core
from reluctance.drive.laws.flux_guide import FluxGuide, nearest_level, voltage
from reluctance.machine.operating_point import OperatingPoint
from reluctance.machine.optimum.table import Table

sys.path.insert(0, str(ROOT / "bench"))
import guides

N_ANGLES = 90
OMEGA = [100.0, 160.0, 250.0]


def tent(omega):
    """Flux linkage that rises with all of the voltage for a third of a turn, then falls so."""
    theta = 2 * np.pi * np.arange(N_ANGLES) / N_ANGLES
    width = 2 * np.pi / 3
    return U_DC / omega * np.maximum(width - np.abs(theta - width), 0)


def guide(drop=0.0):
    """Three tents, the same for every torque but zero."""
    values = np.array([[np.zeros(N_ANGLES), tent(omega)] for omega in OMEGA])
    return _core.ReferenceProfile(values[None], tau_max=1.0, omega_m=OMEGA, u_dc=U_DC, drop=drop)


def along(g, omega_m, u_dc=U_DC, torque=1.0):
    angles = 2 * np.pi * np.arange(N_ANGLES) / N_ANGLES
    return np.array([g.at(torque, theta, omega_m=omega_m, u_dc=u_dc) for theta in angles])


@pytest.mark.parametrize(
    ("omega", "profile"), [(0, 0), (60, 0), (100, 0), (160, 1), (250, 2), (999, 2)]
)
def test_guide_is_the_profile_of_its_speeds_and_the_nearest_beyond_them(omega, profile):
    for sense in (1, -1):
        values = along(guide(), sense * omega)
        np.testing.assert_allclose(values, tent(OMEGA[profile]), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("omega", [101.0, 130.0, 159.0, 170.0, 249.0])
def test_between_its_speeds_the_guide_uses_the_voltage_and_no_more(omega):
    slope = np.abs(np.diff(along(guide(), omega))).max() * N_ANGLES / (2 * np.pi)
    assert slope * omega == pytest.approx(U_DC, rel=1e-9)


@pytest.mark.parametrize("drop", [0.0, 60.0])
@pytest.mark.parametrize("u_dc", [170.0, 200.0, 300.0])
@pytest.mark.parametrize("torque", [1.0, 0.25])
def test_another_voltage_is_another_speed(drop, u_dc, torque):
    """The drop of the resistance goes as the current, about the square root of the torque."""
    lost = drop * np.sqrt(torque)
    same = 140.0 * (U_DC - lost) / (u_dc - lost)
    np.testing.assert_allclose(
        along(guide(drop), 140.0, u_dc, torque),
        along(guide(drop), same, torque=torque),
        rtol=1e-12,
    )


@pytest.mark.parametrize(
    ("omega", "drop"), [([], 0.0), ([100.0, 100.0], 0.0), ([-1.0, 100.0], 0.0), ([1.0, 2.0], U_DC)]
)
def test_a_guide_that_makes_no_sense_is_refused(omega, drop):
    values = np.zeros((len(omega), 2, N_ANGLES))
    with pytest.raises(ValueError, match="need"):
        _core.ReferenceProfile(values[None], tau_max=1.0, omega_m=omega, u_dc=U_DC, drop=drop)


@pytest.mark.parametrize("u_dc", [0.0, 60.0, -1.0])
def test_without_voltage_the_profile_of_the_highest_speed_is_left(u_dc):
    np.testing.assert_allclose(
        along(guide(60.0), 140.0, u_dc), tent(OMEGA[-1]), rtol=1e-12, atol=1e-12
    )


def test_less_voltage_reserve_means_a_closer_guide():
    weights = replace(RATED, guide_rpm=(1500, 2250, 3000)).guide(10e3)
    assert np.all(np.diff(weights.reserve) < 0)
    assert np.all(np.diff(weights.psi_slack) < 0)
    assert np.all(np.diff(weights.w_psi) > 0)
    # The voltage of the least-copper profile at 1500 rpm, from its flux linkage by itself.
    table = weights.tables[0]
    level = np.argmin(np.abs(table.tau_ref - RATED.tau))
    psi, i = table.psi[level], table.i[level]
    between = (psi + np.roll(psi, -1)) / 2
    rise = np.gradient(np.tile(between, 3), table.theta_e[1])[psi.size : 2 * psi.size]
    u = 4 * table.omega_m * rise + RATED.R * (i + np.roll(i, -1)) / 2
    conducts = i > 1
    assert weights.reserve[0] == pytest.approx(np.mean(np.abs(u[conducts]) < 235), abs=0.03)


@pytest.mark.parametrize("law", ["edge_mpc", "finite_set_mpc"])
def test_at_twice_the_nominal_speed_only_a_guide_over_speed_comes_near_the_limit(law):
    """The limit there: 3.0 % rms error, with conduction all around and 79 A rms."""
    fast = replace(RATED, rpm=3000, guide_rpm=(1500, 2250, 3000))
    y = figures(controller(law, fast, STUDY, 10e3), fast, STUDY)
    assert y.error_rms < 0.05
    one_speed = replace(fast, guide_rpm=(1500,))
    assert figures(controller(law, one_speed, STUDY, 10e3), fast, STUDY).error_rms > 0.15


@pytest.mark.parametrize("law", ["edge_mpc", "finite_set_mpc"])
@pytest.mark.parametrize("guide_rpm", [(), (1500, 2250, 2625, 3000)])
def test_near_the_end_of_ripple_free_torque_the_laws_stay_on_the_guide(law, guide_rpm):
    """At 2625 rpm the least rms current without ripple is 49.85 A."""
    point = Point(41.339, 2625, PAPER, guide_rpm=guide_rpm)
    y = figures(controller(law, point, STUDY, 10e3), point, STUDY)
    assert y.error_rms < 0.012
    assert y.i_rms < 1.01 * 49.85


@pytest.mark.parametrize("law", ["edge_mpc", "finite_set_mpc"])
@pytest.mark.parametrize("single", [False, True])
def test_braking_follows_the_same_guide(law, single):
    braking = Point(41.339, -2250, PAPER, guide_rpm=(1500, 2250, 3000))
    y = figures(controller(law, braking, STUDY, 10e3, single=single), braking, STUDY)
    assert y.error_rms < 0.012
    assert y.i_rms < 1.05 * 49.1


@pytest.mark.long
@pytest.mark.parametrize("law", ["edge_mpc", "finite_set_mpc"])
def test_a_sagging_dc_link_is_a_higher_speed(law):
    """240 V -> 200 V at 2250 rpm: as fast as 2893 rpm. The limit: 2.0 % error, 69.6 A."""
    sagging = Point(
        41.339, 2250, PAPER, u_dc=200.0, guide_rpm=(1500, 1800, 2100, 2400, 2550, 2700, 2850, 3000)
    )
    y = figures(controller(law, sagging, STUDY, 10e3), sagging, STUDY)
    assert y.error_rms < 0.06
    its_own = replace(sagging, guide_rpm=(2250,))
    assert figures(controller(law, its_own, STUDY, 10e3), sagging, STUDY).error_rms > 0.09


@pytest.mark.parametrize(
    ("speeds", "fault"),
    [
        ("[1500, 1500]", "need rising speeds"),
        ("[3000.0, 1500.0]", "need rising speeds"),
        ("[-1.0, 1500.0]", r"guide_speed_rpm\.0 = -1\.0, need >= 0"),
        ("[]", "guide_speed_rpm"),
        ("'fast'", "guide_speed_rpm"),
    ],
)
def test_speeds_that_do_not_rise_are_refused(speeds, fault):
    with pytest.raises(rl.ParameterError, match=fault):
        rl.load(ROOT / "examples" / "edge_mpc_fpga.toml", [f"control.guide_speed_rpm={speeds}"])


def test_one_speed_and_a_list_of_it_are_the_same_guide():
    one, many = (
        rl.load(ROOT / "examples" / "edge_mpc_fpga.toml", [f"control.guide_speed_rpm={speeds}"])
        for speeds in ("1500", "[1500]")
    )
    assert one.control == many.control
    assert one.control.tables(one.known())[0].omega_m == pytest.approx(1500 * RPM)


@pytest.mark.long
@pytest.mark.parametrize(
    ("case", "searches", "iterations"),
    [
        # 92 and 2275; in absolute units, with every start tried, 122 and 7919
        (("paper_6_4", "control.guide=least_copper"), 100, 3000),
        (("own_10_8 finite_set_mpc",), 20, 600),  # 18 and 430; 91 and 4542
    ],
)
def test_profiles_take_few_searches(case, searches, iterations, tmp_path, monkeypatch):
    """Two thirds of a set-up are IPOPT's. A level takes one search without ripple, or three with;
    the rest is where the one changes to the other, and the greatest mean."""
    monkeypatch.setenv("RELUCTANCE_CACHE", str(tmp_path))
    count = guides.set_up(*case)
    assert 0 < count.searches <= searches
    assert count.iterations <= iterations


FOUR_POLES = _core.LeHuy(N_r=4, L_u=0.67e-3, L_a=23.62e-3, L_sat=0.15e-3, i_m=450.0, psi_m=0.468)


def made_table(omega=100.0, error=0.0, width=0.5, i_max=100.0):
    """A current of 100 A over `width` of the period at every torque but none; the flux linkage
    rises and falls evenly within it."""
    n = 100
    theta_e = 2 * np.pi * np.arange(n) / n
    on = theta_e < 2 * np.pi * width - 1e-9
    top = np.minimum(np.arange(n), width * n - np.arange(n)).clip(0) / (width * n / 2)
    levels = np.array([0.0, 5.0, 10.0])
    scale = levels[:, None] / 10
    return Table(
        tau_ref=levels,
        theta_e=theta_e,
        i=scale * np.where(on, i_max, 0.0),
        psi=scale * 0.2 * top,
        tau_error_max=np.full(3, error),
        tau_error_rms=np.full(3, error),
        i_rms=np.zeros(3),
        omega_m=omega,
        u_dc=240.0,
    )


def flux_guide(*tables, **given):
    point = OperatingPoint(FOUR_POLES, n_phases=3, R=0.0, i_max=200.0, u_dc=240.0, omega_m=100.0)
    return FluxGuide(tables, point, **{"tau_ref": 10.0, "f_switch": 1e4} | given)


def test_a_guide_knows_its_share_of_conduction_and_its_ripple():
    """More than a thousandth rms is ripple; beyond nine tenths of a period there is no end."""
    of = flux_guide(
        *(made_table(width=w, error=e) for w, e in ((0.5, 0), (0.9, 0.0099), (0.92, 0.011)))
    )
    assert of.conducts == pytest.approx([0.5, 0.9, 0.92], abs=0.011)
    assert of.ripples == [False, False, True]
    assert of.feedback[0] == 0 and of.feedback[2] == 1
    assert flux_guide(made_table(width=0.95)).feedback == [1]
    assert flux_guide(made_table(width=0.86)).feedback == [0]


def test_voltage_along_a_guide_is_the_slope_of_its_flux_linkage_and_the_resistance():
    """0.2 Wb up within a quarter of a period of four poles at 100 rad/s: 51 V; 0.72 ohm: 72 V."""
    table = made_table()
    slope = 0.2 / (np.pi / 2) * 4 * 100
    of = OperatingPoint(FOUR_POLES, n_phases=3, R=0.72, i_max=200.0, u_dc=240.0, omega_m=100.0)
    u = voltage(of, table, 2)
    assert u[5:20] == pytest.approx(72 + slope) and u[30:45] == pytest.approx(72 - slope)
    assert u[60:95] == pytest.approx(0, abs=1e-9)
    assert voltage(of, table, 1) == pytest.approx(u / 2)


def test_the_less_voltage_a_guide_leaves_the_closer_it_is_kept():
    """At 460 rad/s its flanks take 234 V of 240 V, below 98 %; at 465 rad/s 237 V, above."""
    flank = 0.2 / (np.pi / 2) * 4
    below, above = 0.975 * 240 / flank, 0.985 * 240 / flank
    free, held = flux_guide(made_table(below)), flux_guide(made_table(above))
    assert free.reserve == [1] and held.reserve == [0.2]  # the least that weights are made for
    assert free.psi_slack == pytest.approx([240 / 1e4])
    assert held.psi_slack == pytest.approx([0.04 * 240 / 1e4])
    assert flux_guide(made_table(below), slack=3.0).psi_slack == pytest.approx([0.072])
    assert free.w_psi == pytest.approx([(10 / 0.2) ** 2])
    assert held.w_psi == pytest.approx([(50 / 0.2) ** 2])
    half = flux_guide(made_table(below), tau_ref=6.0)  # the nearest level is that of 5 N m
    assert half.w_psi == pytest.approx([(5 / 0.1) ** 2])
    assert nearest_level(made_table(), 0.1) == 1 and nearest_level(made_table(), 7.6) == 2


def test_a_guide_without_current_leaves_all_of_the_voltage():
    table = made_table()
    nothing = replace(table, i=0 * table.i)
    assert flux_guide(nothing).reserve == [1] and flux_guide(nothing).conducts == [0]
