"""The balance of array and shaft on tables whose answer is a formula, and what the drive may do."""

from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from reluctance.plant.hydraulics.pipe import Hydraulics, hydraulics
from reluctance.plant.solar.single_diode import power_point
from reluctance.pumping import drive_of, load_system
from reluctance.pumping.loss_map import LossMap
from reluctance.pumping.matching import Limit, PowerTable, limit_of, power_table, speed
from reluctance.pumping.operate import box_of
from reluctance.pumping.tank import Demand

EXAMPLES = Path(__file__).parents[2] / "examples"
OMEGA = np.linspace(10.0, 30.0, 201)


def cubic(*lasts: int) -> PowerTable:
    """p = u/100 omega^3 at 100 V, 200 V, ...: the speed is a cube root."""
    u = 100.0 * np.arange(1, len(lasts) + 1)
    limits = np.full(len(lasts), Limit.speed)
    return PowerTable(u, OMEGA, u[:, None] / 100 * OMEGA**3, np.array(lasts), limits)


def at(table, u, p):
    omega, drawn = speed(table, np.array([u]), np.array([p]))
    return omega[0], drawn[0]


def test_the_speed_is_that_at_which_the_drive_draws_the_power():
    for p in (1001.0, 8000.0, 26999.0):
        assert at(cubic(200, 200), 100.0, p) == pytest.approx((p ** (1 / 3), p), rel=1e-5)
        assert at(cubic(200, 200), 200.0, 2 * p) == pytest.approx((p ** (1 / 3), 2 * p), rel=1e-5)


def test_less_than_the_least_speed_takes_is_not_drawn_and_more_than_the_largest_is_left():
    table = cubic(200, 200)
    assert at(table, 100.0, 999.0) == (0, 0)
    assert at(table, 100.0, 1000.0) == pytest.approx((10, 1000))
    assert at(table, 100.0, 27000.0) == pytest.approx((30, 27000))
    assert at(table, 100.0, 60000.0) == pytest.approx((30, 27000))
    assert at(cubic(100, 100), 100.0, 60000.0) == pytest.approx((20, 8000))


def test_between_two_voltages_both_are_interpolated_and_outside_the_edge_holds():
    table = cubic(200, 200, 200)
    low, high = 8000 ** (1 / 3), 4000 ** (1 / 3)
    assert at(table, 125.0, 8000.0)[0] == pytest.approx(0.75 * low + 0.25 * high, rel=1e-4)
    assert at(table, 125.0, 1e6) == pytest.approx((30, 27000 * 1.25))
    assert at(table, 50.0, 8000.0) == pytest.approx(at(table, 100.0, 8000.0))
    assert at(table, 350.0, 8000.0) == pytest.approx(at(table, 300.0, 8000.0))


def test_next_to_a_voltage_without_reach_the_nearer_one_decides():
    table = cubic(-1, 200)
    assert at(table, 149.0, 16000.0) == (0, 0)
    assert at(table, 151.0, 16000.0) == pytest.approx((20, 16000), rel=1e-4)
    assert at(table, 151.0, 1e6) == pytest.approx((30, 54000))
    assert [*table.p_max()] == [0, pytest.approx(54000)]


def test_a_limit_is_told_where_power_is_left_and_at_rest_where_the_power_would_do():
    table = cubic(200, -1)
    table.limit[1] = Limit.voltage
    u = np.array([100.0, 100.0, 100.0, 200.0, 200.0, 200.0])
    p = np.array([8000.0, 30000.0, 900.0, 1999.0, 2000.0, 9000.0])
    omega, drawn = speed(table, u, p)
    found = limit_of(table, u, p, omega, drawn)
    none, largest, low = Limit.none, Limit.speed, Limit.voltage
    assert [*found] == [none, largest, none, none, low, low]


def test_the_table_stops_at_the_torque_the_well_or_the_speed_whichever_is_first():
    """A drive without loss that gives 2 to 6 N m over its voltages; a pump whose torque is omega/10
    and whose flow is omega/1000, behind a friction of 0.1 N m s."""
    axes = np.array([100.0, 500.0]), np.array([10.0, 30.0]), np.array([1.0, 10.0])
    reach = np.array([[2.0, 2.0], [6.0, 6.0]]) + 1e-6
    losses = LossMap(*axes, np.zeros((2, 2, 2)), reach, tau_set_up=6.5, given=np.ones((2, 2)))
    load = Hydraulics(OMEGA, OMEGA / 1000, 1.0 + 0 * OMEGA, OMEGA**2 / 10)

    def found(B=0.1, Q_max=np.inf, tau_set_up=6.5):
        table = power_table(replace(losses, tau_set_up=tau_set_up), load, B=B, Q_max=Q_max)
        last = np.where(table.last < 0, np.nan, OMEGA[table.last])
        return last.tolist(), [Limit(x).name[0] for x in table.limit], table

    whole = [10, 12.5, 15, 17.5, 20, 22.5, 25, 27.5, 30]  # 0.2 omega = u/100 + 1
    last, limits, table = found()
    assert [*table.u_dc] == pytest.approx(np.linspace(100, 500, 9))
    assert table.p_in == pytest.approx(np.tile(0.2 * OMEGA**2, (9, 1)))  # both torques
    assert last == pytest.approx(whole) and "".join(limits) == "vvvvvvvvs"
    last, limits, _ = found(Q_max=0.022 + 1e-9)
    assert last == pytest.approx([*whole[:5], *[22] * 4]) and "".join(limits) == "vvvvvwwww"
    last, limits, _ = found(tau_set_up=5.0)
    assert last == pytest.approx(whole) and "".join(limits) == "vvvvvvtts"
    last, limits, table = found(B=0.3)  # 4 N m at the least speed
    assert np.isnan(last[:4]).all() and last[4] == 10 and "".join(limits) == "vvvvvvvvv"
    assert [*table.p_max()[:5]] == pytest.approx([0, 0, 0, 0, 40])


@pytest.mark.parametrize("operation", ["mppt", "constant", "dcdc"])
def test_the_box_of_the_loss_map_holds_every_voltage_and_speed_that_is_met(operation, monkeypatch):
    system = load_system(EXAMPLES / "sun_day.toml")
    values = {"constant": {"u_V": 100.0}, "dcdc": {"u_V": 300.0, "efficiency": 0.9}}
    system = system.with_table("operation", {"kind": operation} | values.get(operation, {}))
    box = box_of(system)
    low, high = box.u_dc
    if operation == "dcdc":
        assert (low, high) == (270, 330)  # the tenth around the fixed link
    else:
        grid = np.meshgrid([200.0, 600.0, 1000.0], [-10.0, 25.0, 75.0])
        u = power_point(system.array.diode(*map(np.ravel, grid))).u
        assert low <= u.min() + 8 and u.max() <= high  # dim and hot is less by a few volts
        assert low % 10 == high % 10 == 0 and high < 1.1 * u.max()
        assert low == 100 if operation == "constant" else low > 0.8 * u.min()
    curve, pipe = system.pump.curve(), system.pipe
    lifts = np.sqrt(pipe.H_static_m / curve.H_0) * curve.omega_ref
    least, most = box.omega
    assert most == system.pump.omega_max and box.tau_max == 45
    assert lifts - 0.2 * most < least <= lifts and 5 * least / most == pytest.approx(
        round(5 * least / most)
    )
    if operation == "mppt":  # full sun, but for the steps
        monkeypatch.setattr("reluctance.pumping.operate.STEP_U", 0.01)
        ends = power_point(system.array.diode(np.full(2, 1000.0), np.array([75.0, -10.0]))).u
        assert box_of(system).u_dc == pytest.approx(tuple(ends), abs=0.011)


def test_the_drive_of_a_system_follows_its_array_and_its_pump():
    """10 ms of nominal power on the link, sleep below a hundredth of it, dry at two fifths of the
    torque with water, and the cloud of examples/sun_cloud.toml."""
    system = load_system(EXAMPLES / "sun_day.toml")
    drive = drive_of(system)
    u, p = system.u_dc, float(system.nominal.p[0])
    assert drive.converter.u_dc_V == u == pytest.approx(float(system.nominal.u[0]), abs=0.05)
    assert drive.source.C_uF == pytest.approx(1e6 * 10e-3 * p / u**2, abs=5)
    assert drive.source.C_uF % 10 == 0
    assert drive.pv_control.p_sleep_W == pytest.approx(p / 100, abs=0.05)
    assert drive.pv_control.u_ref_V == u and drive.pv_control.tracking == "perturb_observe"
    load = hydraulics(system.pump.curve(), system.pipe, system.pump.omega_max)
    least = (load.tau / load.omega**2).min()
    assert drive.pv_control.k_dry_Nms2 == pytest.approx(0.4 * least, rel=5e-3)
    course = drive.source
    assert [*course.t_s] == [0, 7, 8] and drive.simulation.until_s == 13
    assert [*course.poa_global_Wpm2] == [1000, 1000, 300] and {*course.temp_cell_degC} == {50}
    assert drive.reference.speed_rpm == pytest.approx(system.pump.omega_max * 30 / np.pi, abs=1e-3)
    held = system.with_table("operation", {"kind": "constant", "u_V": 230.0, "C_uF": 500.0})
    other = drive_of(held)
    assert other.pv_control.u_ref_V == 230 and other.pv_control.tracking == "constant"
    assert other.source.C_uF == 500 and other.converter.u_dc_V == u


def test_a_demand_is_even_between_its_hours_and_none_outside():
    """Whatever the intervals: each has its share, and a day the whole."""
    for minutes in (1, 7.5, 30, 60):
        step = 60 * minutes
        t = pd.date_range(date(2026, 3, 21), periods=round(1440 / minutes), freq=f"{step}s")
        demand = Demand(m3_per_day=30.0, from_h=6.25, to_h=20.0)
        found = demand.over(t + pd.Timedelta(seconds=step / 2), step)
        assert found.sum() == pytest.approx(30.0)
        ends = np.arange(len(t) + 1) * minutes / 60
        share = np.diff(np.clip((ends - 6.25) / 13.75, 0, 1))
        assert found == pytest.approx(30 * share)
    always = Demand(m3_per_day=24.0)
    for shift in ("0min", "30min", "50min"):  # one around midnight is of two days
        assert always.over(t + pd.Timedelta(shift), 3600.0) == pytest.approx(1.0)
