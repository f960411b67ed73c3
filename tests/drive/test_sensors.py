"""What the sensors show: noise, offset, gain, encoder with index, Hall sensors."""

from pathlib import Path

import numpy as np
import pytest

import reluctance as rl
from reluctance import _core

EXAMPLES = Path(__file__).parents[2] / "examples"
T_S = 20e-6
STEP = 200 / 4096  # of a 12-bit converter over 200 A
BITS = ["sensing.adc_bits=12", "sensing.i_range_A=200"]


def seen(*overrides, until=0.02, law=None):
    """Currents, angles and dc voltages that a controller sees, and the run; all legs off."""
    drive = rl.load(EXAMPLES / "sharing_cubic.toml", list(overrides))
    rows = []
    off = [0.0] * (3 * len(_core.ORDER_COLUMNS) + 1)

    def step(y, reference):
        rows.append([*y.i, y.theta_e, y.u_dc])
        return law(len(rows)) if law else off

    run = rl.simulate(drive, until=until, controller=_core.controller_from(3, step))
    return np.array(rows), run


def test_noise_has_the_stated_rms_value_no_mean_and_a_sure_bound():
    rows, _ = seen(*BITS, "sensing.i_noise_LSB=4", until=0.4)
    steps = rows[:, :3] / STEP
    assert len(steps) == 20_001
    assert np.all(steps == np.round(steps))
    assert np.std(steps, axis=0) == pytest.approx(4, rel=0.02)
    assert np.mean(steps, axis=0) == pytest.approx(-0.5, abs=0.1)  # the converter rounds down
    assert 14 < np.max(np.abs(steps)) <= 6 * 4 + 1
    correlation = np.corrcoef(np.vstack([steps.T, [*steps[1:, 0].tolist(), 0]]))
    assert np.max(np.abs(correlation - np.eye(4))) < 0.03


def test_noise_follows_from_its_seed():
    a, b, other = (
        seen(*BITS, "sensing.i_noise_LSB=4", f"sensing.noise_seed={seed}")[0] for seed in (1, 1, 2)
    )
    assert np.array_equal(a, b)
    assert not np.array_equal(a, other)


def test_the_dc_voltage_has_noise_of_its_own():
    rows, _ = seen("sensing.u_dc_noise_V=2", until=0.2)
    assert np.std(rows[:, 4]) == pytest.approx(2, rel=0.03)
    assert np.mean(rows[:, 4]) == pytest.approx(240, abs=0.1)


def test_a_reading_is_gain_times_current_plus_offset():
    magnetized = [1.0] * 5 + [1.0] + [0.0] * 13

    def law(n):
        return [*magnetized * 3, 0.0]

    true, _ = seen(law=law, until=0.002)
    read, _ = seen("sensing.i_gain=[1, 0.5, 1.4]", "sensing.i_offset_A=[1, 0, -2]", law=law,
                   until=0.002)  # fmt: skip
    assert true[:, :3].max() > 20
    assert read[:, :3] == pytest.approx(true[:, :3] * [1, 0.5, 1.4] + [1, 0, -2], abs=1e-12)


def angle_error(rows, run):
    """Shown less true electrical angle of each sample [deg]."""
    samples = np.searchsorted(run.t, np.arange(len(rows)) * T_S - 1e-12)
    true = 4 * run.theta_m[np.minimum(samples, len(run.t) - 1)]
    return np.degrees(np.mod(rows[:, 3] - true + np.pi, 2 * np.pi) - np.pi)


def test_hall_sensors_alone_show_the_middle_of_a_sector():
    error = angle_error(*seen("sensing.hall=true", until=0.05))
    assert np.max(np.abs(error)) <= 30 + 1e-6
    assert np.max(error) > 29 and np.min(error) < -29  # 2 x 3 sectors a period


def test_an_encoder_finds_its_place_by_hall_edges_and_then_by_its_index():
    sensing = ["encoder_counts=4096", "encoder_index=true", "hall=true", "hall_error_deg=3"]
    start = "simulation.theta_start_deg=50"  # the index passes after 310 deg, 34 ms
    rows, run = seen(*(f"sensing.{key}" for key in sensing), start, until=0.05)
    error, t = angle_error(rows, run), np.arange(len(rows)) * T_S
    count = 360 * 4 / 4096
    first = np.flatnonzero(np.abs(np.diff(error)) > 2)[0] + 1  # a Hall edge has passed
    index = 310 / 360 / 25
    assert t[first] < 1 / (25 * 24)  # of 24 sectors a revolution
    assert 5 < np.max(np.abs(error[:first])) <= 30 + count
    between = (t > t[first]) & (t < index - T_S)
    assert error[between] == pytest.approx(3, abs=count / 2 + 1e-6)
    assert error[t > index + T_S] == pytest.approx(0, abs=count / 2 + 1e-6)


@pytest.mark.parametrize(
    "overrides, message",
    [
        (["i_noise_LSB=2"], "i_noise_LSB = 2 needs adc_bits > 0"),
        (["encoder_counts=1024", "encoder_index=true"], "needs encoder_counts > 0 and hall = true"),
        (["encoder_counts=1024", "hall=true"], "hall has no effect with an encoder that knows"),
        (["hall_error_deg=2"], "hall_error_deg has no effect without hall"),
        (["i_gain=[1, 1]"], r"i_gain = \[1(\.0)?, 1(\.0)?\] has 2 values, need 3: one a phase"),
        (["blank_us=11"], r"blank_us = 11, need at most half of \[control\] T_s_us = 20"),
    ],
)
def test_keys_of_sensors_that_contradict_are_refused(overrides, message):
    with pytest.raises(rl.ParameterError, match=message):
        seen(*(f"sensing.{text}" for text in overrides))


@pytest.mark.parametrize("name", ["sharing_cubic", "paper_rated", "deadbeat", "finite_set_mpc"])
def test_laws_hold_their_torque_with_noise(name):
    """8 LSB rms of 12 bits, offsets of 1 A, gains within 2 %, 1 V of noise on the dc link."""
    plain = rl.load(EXAMPLES / f"{name}.toml")
    real = plain.with_values(
        {
            "sensing.adc_bits": 12,
            "sensing.i_range_A": 240.0,
            "sensing.i_noise_LSB": 8.0,
            "sensing.i_offset_A": [1.0, -1.0, 0.5],
            "sensing.i_gain": [1.02, 0.98, 1.0],
            "sensing.u_dc_noise_V": 1.0,
        }
    )
    ideal, noisy = (rl.simulate(d, until=0.04, record=None).kpis for d in (plain, real))
    assert noisy.tau_mean == pytest.approx(ideal.tau_mean, rel=0.03)
    assert noisy.torque_error_rms < ideal.torque_error_rms + 0.02 * ideal.tau_mean
