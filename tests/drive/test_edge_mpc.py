"""Predictive control with switching instants: the targets, the rule, every start."""

import csv
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mpc_loop import (
    BENCH,
    FPGA,
    GENERIC,
    HALF,
    MICROCONTROLLER,
    ONE_HP,
    PAPER,
    RATED,
    Point,
    Timing,
    controller,
    figures,
    loop,
    over_speed,
    reserves,
    single,
    sums,
    tabled,
)

import reluctance as rl
from reluctance.machine.optimum import best_profile, torque_speed_envelope

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "studies"))
from drawn_machine import drawn_machine  # noqa: E402

# The paper's machine, the default 60 kW machine, four phases: (point, least rms current [A]).
CELLS = [
    (RATED, 48.93),
    (HALF, 28.73),
    (Point(-41.339, -1500, PAPER, guide_rpm=(1500,)), 48.93),
    (Point(80.0, 1500, GENERIC, R=0.05, i_max=200.0), 84.49),
    (Point(41.339, 1500, PAPER, n_phases=4), 38.09),
    (ONE_HP, 1.898),
]


@pytest.mark.parametrize(("point", "limit_A"), CELLS)
@pytest.mark.parametrize(
    ("timing", "f_switch", "rms", "pp", "copper"),
    [(FPGA, 21e3, 0.0040, 0.020, 1.005), (MICROCONTROLLER, 16e3, 0.0065, 0.035, 1.01)],
)
def test_ripple_copper_and_switching_frequency_meet_the_targets(
    point: Point,
    limit_A: float,
    timing: Timing,
    f_switch: float,
    rms: float,
    pp: float,
    copper: float,
) -> None:
    y = figures(controller("edge_mpc", point, timing, f_switch), point, timing)
    assert y.error_rms < rms
    assert y.ripple_pp < pp
    assert y.i_rms < copper * limit_A
    assert y.f_switch < 20e3


@pytest.mark.parametrize(("point", "limit_A"), CELLS[:2])
def test_the_least_currents_of_the_cells_are_those_of_the_limit(
    point: Point, limit_A: float
) -> None:
    best = best_profile(point.at(point.rpm), point.tau)
    assert best.i_rms == pytest.approx(limit_A, rel=1e-3)


@pytest.mark.parametrize("f_switch", [8e3, 12e3, 20e3])
def test_rule_makes_the_switching_frequency_it_is_asked_for(f_switch: float) -> None:
    for point in (RATED, CELLS[3][0]):
        y = figures(controller("edge_mpc", point, FPGA, f_switch), point, FPGA)
        assert 0.7 * f_switch < y.f_switch < 1.05 * f_switch


def test_cost_of_a_turn_on_falls_with_the_cube_of_the_frequency() -> None:
    slow, fast = (RATED.guide(f).w_sw for f in (10e3, 20e3))
    assert slow == pytest.approx(8 * fast, rel=1e-9)


def test_float_is_as_good_as_double() -> None:
    for timing, f in ((FPGA, 21e3), (MICROCONTROLLER, 16e3)):
        y = [
            figures(controller("edge_mpc", RATED, timing, f, single=single), RATED, timing)
            for single in (False, True)
        ]
        assert y[0].error_rms == pytest.approx(y[1].error_rms, rel=0.1)
        assert y[0].i_rms == pytest.approx(y[1].i_rms, rel=2e-3)


@pytest.mark.parametrize(("timing", "f_switch"), [(FPGA, 20e3), (MICROCONTROLLER, 16e3)])
@pytest.mark.parametrize("tau", [41.339, -41.339, 3.0])
def test_starts_from_zero_current_at_every_angle(
    timing: Timing, f_switch: float, tau: float
) -> None:
    point = Point(tau, 0.0, PAPER, guide_rpm=(1500,))
    for theta_e in np.linspace(0, 2 * np.pi, 12, endpoint=False):
        run = loop(controller("edge_mpc", point, timing, f_switch), point, timing,
                   theta_m=theta_e / 4 + 1e-3)  # fmt: skip
        run.advance(3e-3)
        run.close_period()
        before = sums(run)
        run.advance(5e-3)
        run.close_period()
        after = sums(run)
        mean = (after["tau"] - before["tau"]) / (after["t"] - before["t"])
        assert mean == pytest.approx(tau, rel=0.01)
        assert after["tau_max"] - after["tau_min"] < 0.06 * abs(tau)


def test_no_torque_is_asked_no_current_flows() -> None:
    point = Point(1e-9, 1500.0, PAPER)
    run = loop(controller("edge_mpc", RATED, FPGA, 20e3), point, FPGA)
    run.advance(1e-3)
    run.close_period()
    assert sums(run)["tau_max"] < 1e-3


@pytest.mark.parametrize("factor", [0.8, 1.2])
def test_wrong_resistance_moves_neither_torque_nor_ripple(factor: float) -> None:
    believed = replace(RATED, R=factor * RATED.R)
    for timing, f, rms in ((FPGA, 20e3, 0.0045), (MICROCONTROLLER, 16e3, 0.0080)):
        y = figures(controller("edge_mpc", believed, timing, f), RATED, timing)
        assert y.error_rms < rms
        assert y.i_rms == pytest.approx(48.93, rel=5e-3)


def test_torque_that_the_voltage_does_not_give_takes_no_more_current_for_long() -> None:
    """All phases help for a stroke after a step; for ever they would carry 52 A for 16 N m."""
    point = Point(41.339, 2000, PAPER, u_dc=120.0, guide_rpm=(1500,))
    found = figures(controller("edge_mpc", point, MICROCONTROLLER, 16e3), point, MICROCONTROLLER)
    assert 0.5 < found.error_rms < 1
    assert found.i_rms < 30


@pytest.mark.long
def test_the_files_of_the_page_are_what_the_laws_do() -> None:
    files = {
        "mpc_loop.csv": [run.row() for run in (*tabled(), *single())],
        "mpc_speed.csv": over_speed(),
        "mpc_reserve.csv": reserves(),
    }
    for name, found in files.items():
        with (BENCH / name).open(encoding="utf-8") as file:
            stored = list(csv.DictReader(file))
        for row, was in zip(found, stored, strict=True):
            for key, text in row.items():
                same = text == was[key] or float(text) == pytest.approx(float(was[key]), rel=0.02)
                assert same, (name, row, key, was[key])


@pytest.mark.parametrize("seed", [3001, 3005, 4016])
def test_a_phase_starts_in_time_where_its_guide_takes_most_of_the_voltage(
    seed: int, tmp_path: Path
) -> None:
    """A phase that waited for a sample could not catch up: errors were 3.7 to 4.6 %. Drawn machines
    at 0.6 of the speed at which the flux linkage takes half a period, at 20 us."""
    text, u_dc = drawn_machine(seed)
    file = tmp_path / "drawn.toml"
    file.write_text(text)
    example = rl.load(ROOT / "examples" / "edge_mpc_mcu.toml")
    machine = example.with_values({"machine": str(file), "reference.tau_Nm": 0.01}).machine
    psi = float(machine.psi(2 / 3 * machine.i_max_A, np.pi))
    omega = 0.6 * np.pi * u_dc / (machine.N_r * psi)
    at = machine.at(u_dc=u_dc, omega_m=omega)
    rated = 2 / 3 * float(torque_speed_envelope(at, omega).tau_max[0])
    drive = example.with_values(
        {
            "machine": str(file),
            "converter.u_dc_V": u_dc,
            "load.speed_rpm": omega * 30 / np.pi,
            "reference.tau_Nm": 0.3 * rated,
            "control.tau_max_Nm": rated,
            "sensing.i_range_A": 1.5 * machine.i_max_A,
        }
    )
    period = 2 * np.pi / (machine.N_r * omega)
    kpis = rl.simulate(drive, until=12 * period, record=None).kpis
    assert kpis.torque_error_rms is not None and kpis.torque_error_rms < 0.02
