"""The speed loop by rule: load steps and reversals of several drives, against what physics leaves.

docs/control/speed_loop.csv is compared with runs; `python studies/speed_loop.py` writes it.
"""

import csv
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from firmware_tools import Native

import reluctance as rl
from reluctance import _core
from reluctance.drive.tables import speed_loop as rule
from reluctance.machine.optimum import fastest_torque_step

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "studies"))
import speed_loop as study  # noqa: E402

PAPER = study.CASES[0]
NAMED = {case.name: case for case in study.CASES}
each_case = pytest.mark.parametrize("case", study.CASES, ids=list(NAMED))
ANGLES = (0.0, 8.0, 21.0)  # deg
NOISE = ("sensing.adc_bits=12", "sensing.i_range_A=200", "sensing.i_noise_LSB=4",
         "sensing.u_dc_noise_V=1.2")  # fmt: skip


def rpm(run):
    return run.omega_m * 30 / np.pi


def dip(case, run):
    return case.rpm - rpm(run)[run.t >= study.T_STEP].min()


def T_sum(case, counts):
    """The sum of lags that the gain follows from [s]."""
    drive = case.drive(counts, f"control.tau_max_Nm={case.tau_max_Nm}", "reference.speed_rpm=1")
    return drive.J / (2 * drive.control.gains(drive.known())[0])


@pytest.mark.parametrize(("counts", "most"), [(0, 60), (4096, 110)])
@pytest.mark.parametrize("theta_deg", ANGLES)
def test_rated_load_on_the_paper_drive(counts, most, theta_deg):
    run = study.load_step(PAPER, counts, theta_deg)
    assert dip(PAPER, run) < most
    assert run.kpis.torque_ripple_rms < 0.007
    assert np.abs(rpm(run)[-2000:] - PAPER.rpm).max() < 1.0


@pytest.mark.parametrize("theta_deg", ANGLES)
def test_rated_load_at_the_start_from_zero_current_with_a_tracker_that_knows_no_speed(theta_deg):
    load = [f"load.t_s=[0, {study.T_STEP}]", "load.values=[41.3, 41.3]"]
    run = study.load_step(PAPER, 4096, theta_deg, *load)
    assert PAPER.rpm - rpm(run).min() < 110


@pytest.mark.parametrize("counts", [0, 4096])
@pytest.mark.parametrize("theta_deg", ANGLES)
def test_reversal_of_the_paper_drive(counts, theta_deg):
    run = study.reversal(PAPER, counts, theta_deg)
    assert rpm(run).min() > -1010
    assert study.stays(run.t, np.abs(rpm(run) + 1000) > 10) < 41e-3


@each_case
@pytest.mark.parametrize("counts", study.COUNTS)
def test_a_load_falls_on_the_inertia_for_the_sum_of_lags(case, counts):
    """dip = tau/J T_sum, and half of it more; no overshoot of 1 % of the speed when it is back."""
    run = study.load_step(case, counts, 5.0)
    drive = case.drive(counts, f"control.tau_max_Nm={case.tau_max_Nm}", "reference.speed_rpm=1")
    fall = case.tau_Nm / drive.J * T_sum(case, counts) * 30 / np.pi
    assert dip(case, run) < 1.5 * fall + 1
    assert rpm(run)[run.t > study.T_STEP].max() < 1.01 * case.rpm
    assert rpm(run)[-1000:] == pytest.approx(case.rpm, rel=2e-3)


@each_case
@pytest.mark.parametrize("counts", [0, 4096])
def test_a_reversal_takes_a_tenth_more_than_the_least_time(case, counts):
    run = study.reversal(case, counts, 5.0)
    least = study.least_time(case, case.drive(counts, "control.tau_max_Nm=1",
                                              "reference.speed_rpm=1"))  # fmt: skip
    assert -case.reversal_rpm - rpm(run).min() < 0.012 * case.reversal_rpm
    off = np.abs(rpm(run) + case.reversal_rpm) > 0.012 * case.reversal_rpm
    assert 0.9 * least < study.stays(run.t, off) < 1.1 * least


LAWS = {
    "torque_sharing": 20, "paper_mpc": 20, "deadbeat": 20, "ditc": 5, "pwm_current": 20,
    "finite_set_mpc": 5, "angles": 20,
}  # fmt: skip


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("counts", [0, 4096])
def test_every_law_holds_its_speed(law, counts):
    """30 N m, on laws with more torque ripple too: its mean is what the loop sees."""
    case = replace(PAPER, tau_Nm=30, tau_max_Nm=45, T_s_us=LAWS[law])
    more = [f"control.law={law}"]
    run = study.load_step(case, counts, 5.0, *more)
    fall = case.tau_Nm / 0.008 * T_sum(case, counts) * 30 / np.pi
    assert dip(case, run) < 1.5 * fall
    late = rpm(run)[run.t > 0.15]
    assert late.mean() == pytest.approx(case.rpm, rel=1e-3)
    assert np.ptp(late) < 0.012 * case.rpm  # the ripple of a stroke on the inertia


def test_the_time_of_the_torque_is_that_of_the_fastest_step():
    """A phase at constant current against the exact bound over the angle: of the same size."""
    for case in (PAPER, NAMED["60kW"], NAMED["12_8"], NAMED["1hp_8_6"]):
        drive = case.drive(0, f"control.tau_max_Nm={case.tau_max_Nm}", "reference.speed_rpm=1")
        point = drive.at(case.rpm * np.pi / 30)
        bound = fastest_torque_step(point, case.tau_max_Nm, n_angles=20)
        assert 0.9 < rule.torque_time(drive.known()) / bound.mean < 2.5


def test_given_gains_keep_their_meaning():
    def speed(*more):
        drive = PAPER.drive(0, "control.tau_max_Nm=60", "reference.speed_rpm=1500", *more)
        fields = _core.described(drive.controller())["control"]["fields"]["frame"]["fields"]
        pi = fields["speed"]["fields"]
        return pi["K_p"], pi["K_i"], fields["load"]["value"], fields["ramp"]["fields"]["tau"]

    integral, observer = _core.LoadTorque.integral.value, _core.LoadTorque.observer.value
    J, w = 0.008, 2 * np.pi * 30
    assert speed("control.speed_bandwidth_Hz=30") == pytest.approx((J * w, J * w * w / 2,
                                                                    integral, 0))  # fmt: skip
    assert speed("control.K_p_Nms=3", "control.K_i_Nm=400") == pytest.approx((3, 400, integral, 0))
    assert speed("control.K_p_Nms=3") == pytest.approx((3, 0, observer, 57))
    both = ("control.K_p_Nms=3", "control.speed_bandwidth_Hz=30")
    assert speed(*both) == pytest.approx((3, 3 * w / 2, integral, 0))
    K_p, K_i, load, _ = speed()
    assert (K_i, load) == (0, observer)
    lag = 20e-6 * 1.5 + rule.torque_time(PAPER.drive(
        0, "control.tau_max_Nm=60", "reference.speed_rpm=1500").known()) / 2  # fmt: skip
    assert K_p == pytest.approx(J / (2 * lag))


def test_the_rate_of_the_reference_is_kept():
    for more in ((), ("control.speed_bandwidth_Hz=20",)):
        run = study.reversal(PAPER, 0, 0.0, "control.speed_rate_rpmps=30000", *more)
        passing = (rpm(run) < 500) & (rpm(run) > -500)
        slope = np.polyfit(run.t[passing], rpm(run)[passing], 1)[0]
        assert slope == pytest.approx(-30000, rel=0.01)
        assert rpm(run).min() > -1010


def test_a_course_of_the_reference_is_followed_without_lag():
    """A ramp that the torque can follow: the speed is on it, and not T_sum behind it."""
    course = ["reference.t_s=[0.05, 0.1]", "reference.values=[1000, 2000]"]
    run = study.reversal(PAPER, 0, 0.0, *course)
    on = (run.t > 0.06) & (run.t < 0.1)
    asked = 1000 + (run.t[on] - 0.05) / 0.05 * 1000
    assert np.abs(rpm(run)[on] - asked).max() < 0.25 * 20e3 * T_sum(PAPER, 0)


def test_an_overload_leaves_no_wind_up():
    """80 N m for 10 ms at tau_max 60: the speed falls, then comes back without overshoot."""
    for counts in (0, 4096):
        load = ["load.t_s=[0.05, 0.05, 0.06, 0.06]", "load.values=[0, 80, 80, 0]"]
        run = study.load_step(PAPER, counts, 0.0, *load)
        assert dip(PAPER, run) > 250
        assert rpm(run).max() < 1.01 * PAPER.rpm
        assert rpm(run)[-2000:] == pytest.approx(PAPER.rpm, rel=1e-3)


def test_a_low_link_voltage_is_a_load_to_the_loop():
    """At 90 V the torque asked for is not there at 2000 rpm; the ramp waits for the speed."""
    course = ["reference.t_s=[0.05, 0.05]", "reference.values=[500, 2000]"]
    low = ["source.t_s=[0]", "source.values=[90]", "load.speed_rpm=500"]
    run = study.reversal(replace(PAPER, reversal_rpm=2500), 0, 0.0, *course, *low)
    assert rpm(run)[-1] == pytest.approx(2000, rel=5e-3)
    assert rpm(run).max() < 2020


@pytest.mark.parametrize("counts", [0, 4096])
def test_single_precision_and_noise_change_little(counts):
    plain = study.load_step(PAPER, counts, 5.0)
    single = study.load_step(PAPER, counts, 5.0, "control.precision=float")
    real = study.load_step(PAPER, counts, 5.0, *NOISE)
    assert dip(PAPER, single) == pytest.approx(dip(PAPER, plain), rel=0.1)
    assert dip(PAPER, real) == pytest.approx(dip(PAPER, plain), rel=0.1)
    assert real.kpis.torque_ripple_rms < 0.008


@pytest.mark.long
@pytest.mark.parametrize("counts", [1024, 4096, 65536])
def test_the_protection_lets_load_steps_and_reversals_pass(counts, tmp_path):
    """The exported firmware with noise of 4 LSB, at the greatest accelerations, known or not."""
    stepped = study.load_step_drive(PAPER, counts, 5.0, *NOISE)
    target = Native(stepped, tmp_path)
    run = rl.simulate(stepped, until=0.2, record=1e-3, controller=target.controller)
    assert target.trip is None
    assert rpm(run)[-1] == pytest.approx(PAPER.rpm, rel=5e-3)
    (tmp_path / "turned").mkdir()
    turned = study.reversal_drive(PAPER, counts, 5.0, *NOISE)
    target = Native(turned, tmp_path / "turned")
    run = rl.simulate(turned, until=0.2, record=1e-3, controller=target.controller)
    assert target.trip is None
    assert rpm(run)[-1] == pytest.approx(-1000, rel=5e-3)


def rows():
    with (ROOT / "docs" / "control" / "speed_loop.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_the_file_has_every_case():
    written = [(row["case"], row["loop"], int(row["encoder_counts"])) for row in rows()]
    assert written == [(case.name, loop, counts) for case, loop, counts in study.tasks()]


@pytest.mark.parametrize(
    ("name", "loop", "counts"),
    [("paper", "rule", 0), ("paper", "rule", 4096), ("12_8", "rule", 4096),
     ("paper", "pi_20Hz", 4096)],
)  # fmt: skip
def test_the_file_is_current(name, loop, counts):
    (row,) = [
        row for row in rows()
        if (row["case"], row["loop"], int(row["encoder_counts"])) == (name, loop, counts)
    ]  # fmt: skip
    found = vars(study.measured((NAMED[name], loop, counts)))
    for key, text in row.items():
        if isinstance(found[key], float):
            assert found[key] == pytest.approx(float(text), rel=0.01, abs=0.002), key
