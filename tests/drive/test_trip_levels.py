"""Trip levels that follow from the drive are those of docs/firmware.md; what cannot be is told."""

from pathlib import Path

import numpy as np
import pytest

import reluctance as rl
from reluctance.drive.guard.sequence_levels import sequence
from reluctance.drive.guard.trip_levels import (
    angle_step,
    current_error,
    diagnosis,
    flux_angle,
    protection,
)

EXAMPLES = Path(__file__).parents[2] / "examples"
QUANTISED = ["sensing.adc_bits=10", "sensing.i_range_A=400", "sensing.i_noise_LSB=2"]
ENCODER = ["sensing.encoder_counts=1024", "sensing.tracker_bandwidth_Hz=100"]


def drive(*given, name="paper_rated"):
    return rl.load(EXAMPLES / f"{name}.toml", list(given))


def test_levels_are_parts_of_the_current_the_voltage_and_the_speed():
    """i_max 150 A, 240 V, 1500 rpm."""
    levels = protection(drive()).levels
    assert levels.i_trip == pytest.approx(1.2 * 150)
    assert levels.u_dc_min == pytest.approx(0.25 * 240)
    assert levels.u_dc_max == pytest.approx(1.25 * 240)
    assert levels.omega_max == pytest.approx(1.3 * 50 * np.pi)
    assert levels.angle_slack == pytest.approx(np.radians(0.1))  # of an ideal sensor
    guard = protection(drive())
    assert guard.i_zero == pytest.approx(0.02 * 150) and guard.flux.i_error == 0
    assert guard.flux.model_error == pytest.approx(0.25) and guard.frozen == 0
    assert guard.flux.u_margin == pytest.approx(0.2)
    assert guard.flux.R == drive().machine.R and guard.flux.T_s == drive().control.T_s


def test_what_a_reading_may_be_wrong_by_is_its_noise_its_step_and_its_offset():
    """10 bits over 400 A: a step of 400/1024 A; noise is simulated up to six times its rms."""
    step = 400 / 2**10
    noisy = drive(*QUANTISED, "sensing.i_offset_A=[0.5, -0.9, 0.1]")
    assert current_error(noisy) == pytest.approx(6 * 2 * step + step + 0.9, rel=2e-3)
    assert protection(noisy).i_zero == pytest.approx(1.1 * current_error(noisy))
    coarse = protection(drive(*QUANTISED, "sensing.i_gain=[1.1, 0.8, 1.0]"))
    assert coarse.flux.model_error == pytest.approx(0.25 + 0.2)


@pytest.mark.parametrize(("noise", "per_sample"), [(0.7, 0.403), (2.0, 0.141), (8.0, 0.0353)])
def test_equal_codes_in_a_row_are_frozen_where_noise_leaves_them_less_often_than_1e15(
    noise, per_sample
):
    """Two codes of a Gaussian of n steps are equal with a probability of 1/(2 sqrt(pi) n)."""
    found = drive(*QUANTISED, f"sensing.i_noise_LSB={noise}", "sensing.i_range_A=800")
    frozen = protection(found).frozen
    assert per_sample**frozen <= 1.05e-15 < per_sample ** (frozen - 1) * 1.05
    quiet = drive(*QUANTISED, "sensing.i_noise_LSB=0.69")
    assert protection(quiet).frozen == 0


def test_an_angle_may_be_wrong_by_steps_of_its_sensor():
    assert angle_step(drive(*ENCODER)) == pytest.approx(360 * 4 / 1024)
    assert angle_step(drive("sensing.hall=true")) == pytest.approx(60)
    assert angle_step(drive()) == 0
    slack = 1.5 * 360 * 4 / 1024
    assert protection(drive(*ENCODER)).levels.angle_slack == pytest.approx(np.radians(slack))
    indexed = drive(
        *ENCODER, "sensing.encoder_index=true", "sensing.hall=true", "sensing.hall_error_deg=-3"
    )
    more = slack + 90 / 3 + 3
    assert protection(indexed).levels.angle_slack == pytest.approx(np.radians(more))


@pytest.mark.parametrize("name", ["paper_rated", "paper_pump"])
def test_a_counted_angle_is_held_against_the_acceleration_of_machine_and_load(name):
    """Over tau = sqrt(2 slack/a), in eight blocks of whole samples. The machine has 100.6 N m at
    i_max."""
    counted = drive(*ENCODER[:1], name=name)
    guard = protection(counted)
    driven = 100.57 + max(abs(x) for x in counted.load.tau_0[1])
    passive = min(counted.load.k * guard.levels.omega_max**2, driven)
    a = 1.25 * 4 * (driven + passive) / counted.J
    tau = guard.advance.parts * guard.advance.block * counted.control.T_s
    assert guard.advance.parts == 8
    assert guard.advance.bend == pytest.approx(a * tau**2, rel=1e-3)
    half = 4 * counted.control.T_s
    assert abs(tau - np.sqrt(2 * guard.levels.angle_slack / a)) <= half
    assert protection(drive(name=name)).advance.block == 0


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (["protection.u_dc_min_V=240"], "u_dc_min_V = 240"),
        (["protection.u_dc_max_V=240"], "u_dc_max_V = 240"),
        (
            ["protection.speed_max_rpm=1500"],
            "need more than the 1500 rpm that the drive works at; raise it",
        ),
        ([*QUANTISED, "sensing.i_range_A=180"], "over-current is never seen"),
        ([*QUANTISED, "protection.i_zero_A=5"], "need at least the 5.08 A"),
        ([*QUANTISED, "sensing.i_range_A=200000"], "[sensing] i_range_A = 200000: a reading"),
        ([*ENCODER, "protection.angle_slack_deg=1.4"], "need more than the angle sensor's step"),
        (["converter.dead_time_us=4.1"], "need at most 0.2 of"),
    ],
)
def test_a_level_that_would_trip_in_normal_work_or_never_is_refused(given, told):
    with pytest.raises(rl.ParameterError) as fault:
        protection(drive(*given))
    assert told in str(fault.value) and "\n" not in str(fault.value)


def test_a_dead_time_of_a_fifth_of_the_control_period_is_the_longest():
    """16 us of 80 us."""
    protection(drive("control.T_s_us=80", "converter.dead_time_us=16"))
    with pytest.raises(rl.ParameterError, match=r"dead_time_us = 16\.1, need at most 0\.2 of"):
        protection(drive("control.T_s_us=80", "converter.dead_time_us=16.1"))


def test_an_array_has_no_under_voltage_and_the_rating_or_a_cold_morning_as_over_voltage():
    sun = rl.load(EXAMPLES / "sun_cloud.toml")
    levels = protection(sun).levels
    assert levels.u_dc_min == 0
    rated = sun.converter.u_rating_V
    assert levels.u_dc_max == (rated or pytest.approx(1.05 * sun.source.cold_voltage))
    other = sun.with_values(
        {"converter.u_rating_V": None} if rated else {"converter.u_rating_V": 450.0}
    )
    expected = 1.05 * sun.source.cold_voltage if rated else 450.0
    assert protection(other).levels.u_dc_max == pytest.approx(expected)


def test_states_have_the_levels_of_the_page():
    """0.7 of the voltage counts as charged; 5 s at most; 100 ms without a command; motoring up to
    0.95 of the over-speed."""
    found = drive()
    states = sequence(found, protection(found))
    assert states.u_ready == pytest.approx(0.7 * 240)
    assert states.t_precharge == pytest.approx(5) and states.t_command == pytest.approx(0.1)
    limit = 0.95 * 1.3 * 50 * np.pi
    assert states.omega_none == pytest.approx(limit)
    assert states.reference_max == pytest.approx(found.tau_max)
    assert states.u_chop_on == pytest.approx(240 + 0.6 * 60)
    assert states.u_chop_off == pytest.approx(240 + 0.3 * 60)
    assert states.n_calibrate == pytest.approx(0.05 / found.control.T_s, abs=1)
    loop = drive(name="paper_pump")
    assert sequence(loop, protection(loop)).reference_max == pytest.approx(
        0.95 * protection(loop).levels.omega_max
    )
    low = drive("protection.u_dc_min_V=200")  # 0.7 of 240 V is below it
    assert sequence(low, protection(low)).u_ready == pytest.approx(1.05 * 200)
    limited = drive("protection.speed_limit_rpm=1800", name="paper_rated")
    assert sequence(limited, protection(limited)).omega_none == pytest.approx(60 * np.pi)
    for given, told in (
        ("speed_limit_rpm=1950", "need less than the 1950 rpm of over-speed"),
        ("u_ready_V=60", "u_ready_V = 60, need between u_dc_min_V = 60 and u_dc_max_V = 300"),
        ("u_ready_V=300", "u_ready_V = 300, need between u_dc_min_V = 60 and u_dc_max_V = 300"),
    ):
        with pytest.raises(rl.ParameterError, match=told):
            wrong = drive(f"protection.{given}")
            sequence(wrong, protection(wrong))


def test_a_diagnosis_allows_what_is_stated_and_tries_a_third_of_the_current():
    found = drive(*QUANTISED, *ENCODER, "protection.diagnosis=true", "supervision.enable_s=0")
    told, m = diagnosis(found), found.machine
    assert diagnosis(drive()) is None and told is not None
    flux = told.flux
    assert told.trial.i == pytest.approx(50) and told.i_max == 150
    assert (flux.R_error, flux.map_error, flux.u_error) == pytest.approx((0.2, 0.1, 0.02))
    noise = 0.01 * float(m.psi(150.0, np.pi))  # what other phases add, none of it in this machine
    assert flux.psi_error == pytest.approx(noise)
    for value, i in ((told.trial.psi, 50.0), (flux.psi_max, 150.0)):
        assert value == pytest.approx(1.1 * float(m.psi(i, np.pi)) + noise)
    guard = protection(found)
    zero = 1.1 * float(m.psi(guard.i_zero + guard.flux.i_error, np.pi)) + noise
    assert flux.psi_zero == pytest.approx(zero)
    half_a_step = np.radians(angle_step(found) / 2)
    assert told.theta_error == pytest.approx(half_a_step + np.radians(2))
    assert told.patience == int(np.ceil(0.2 / found.control.T_s))


FOLLOWED = ["protection.diagnosis=true", "protection.flux_angle=true", "supervision.enable_s=0"]


def test_a_diagnosis_allows_the_noise_and_the_errors_of_all_sensors():
    """Noise of the dc link up to six times its rms; n samples of it add up to 2 + n/8 of one."""
    sensors = ["sensing.u_dc_noise_V=1.5", "sensing.i_gain=[1.1, 0.8, 1.0]"]
    offset = "sensing.i_offset_A=[0.5, -0.9, 0.1]"
    found = drive(*QUANTISED, *ENCODER, *FOLLOWED, *sensors, offset)
    told, m, T_s = diagnosis(found), found.machine, found.control.T_s
    step, u_noise = found.sensing.i_step, 6 * 1.5
    mutual = 0.01 * float(m.psi(150.0, np.pi))
    assert told.flux.psi_error == pytest.approx(mutual + 2 * u_noise * T_s)
    assert told.flux.u_error == pytest.approx(0.02 + u_noise / (4 * 2 * 240))
    assert told.flux.i_gain == pytest.approx(0.2)
    like = told.likeness
    assert (like.i_gain, like.i_noise) == pytest.approx((0.2, 6 * 2 * step))
    assert like.i_offset == pytest.approx(step + 0.9)
    assert like.u_noise == pytest.approx(u_noise * T_s) and like.psi_error == told.flux.psi_error
    assert (like.R_error, like.u_error, like.map_error) == pytest.approx((0.2, 0.02, 0.1))
    assert like.recent == told.patience
    theta = np.linspace(0, np.pi, 3601)
    steepest = np.abs(np.diff(np.log(m.psi(np.full(3601, 3.0), theta)))).max() * 3600 / np.pi
    half_a_step = np.radians(angle_step(found) / 2)
    assert like.spread == pytest.approx(0.01 + steepest * half_a_step, rel=1e-3)


@pytest.mark.parametrize("delay", [0, 1])
def test_a_trial_ends_before_the_current_has_risen_by_as_much_again(delay):
    """In as many samples as an order takes to act, at the least inductance up to 100 A that the
    map, which may be 10 % too high, allows."""
    found = drive(*FOLLOWED, f"sensing.delay_samples={delay}")
    i, theta = np.linspace(0, 100, 401), np.linspace(0, np.pi, 181)
    psi = found.machine.psi(i[:, None], theta)
    least = np.diff(psi, axis=0).min() / (i[1] - i[0])
    most = 0.9 * 50 * least / (1 + delay)
    assert diagnosis(found).trial.psi_sample == pytest.approx(most, rel=0.03)


def test_an_angle_that_waits_for_its_index_may_be_wrong_by_half_of_a_hall_sector():
    """Until then: a quarter of a period over the phases, 30 deg, and the error of the edges."""
    index = ["sensing.encoder_index=true", "sensing.hall=true", "sensing.hall_error_deg=-3"]
    found = drive(*ENCODER, *FOLLOWED, *index)
    wrong = np.radians(angle_step(found) / 2 + 3 + 90 / 3)
    assert diagnosis(found).theta_error == pytest.approx(wrong + np.radians(2))
    theta = np.linspace(0, np.pi, 3601)
    psi = found.machine.psi(np.full(3601, 3.0), theta)
    steepest = np.abs(np.diff(np.log(psi))).max() * 3600 / np.pi
    model = protection(found).flux.model_error
    assert model == pytest.approx(0.25 + steepest * wrong, rel=1e-3)


def test_an_angle_by_the_flux_linkages_knows_the_shaft_the_sensors_and_the_machine():
    found = drive(*QUANTISED, *ENCODER, *FOLLOWED)
    of, step = flux_angle(found), found.sensing.i_step
    assert of.T_s == found.control.T_s
    assert of.acceleration == pytest.approx(4 / found.J)  # of a newton metre, electrical
    assert of.tau_drift == pytest.approx(found.machine.greatest_torque)
    assert of.theta_step == pytest.approx(np.radians(angle_step(found)))
    assert of.theta_error == pytest.approx(np.radians(2))
    assert of.zero_drift == pytest.approx(of.theta_error * 10)  # of 100 periods a second
    assert of.omega_error == pytest.approx(4 * protection(found).levels.omega_max)
    assert of.i_noise == pytest.approx(step * np.sqrt(2**2 + 1 / 12))  # rms, and of a step
    assert of.i_zero == protection(found).i_zero
    assert (of.map_error, of.R_error) == (0.1, 0.2)
    told = diagnosis(found)
    assert (of.psi_error, of.alike) == (told.flux.psi_error, told.patience)
    assert flux_angle(drive(*QUANTISED, *ENCODER, FOLLOWED[0], FOLLOWED[2])) is None
