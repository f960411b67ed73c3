"""Tables of a drive as a run takes them: in SI, at their times, by the laws they stand for."""

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from reluctance.base.errors import ParameterError
from reluctance.drive.tables.load import Load
from reluctance.drive.tables.sections import (
    Converter,
    Reference,
    Sensing,
    SimulationSettings,
    padded,
)
from reluctance.plant.hydraulics.pipe import Pipe
from reluctance.plant.hydraulics.pump import pump_from

RPM = np.pi / 30
COURSE = {"t_s": [0.0, 1.0, 1.0], "values": [300.0, 600.0, -60.0]}


@pytest.mark.parametrize(
    ("load", "omega", "tau"),
    [
        (Load(kind="locked", speed_rpm=1500.0), 100.0, 0.0),
        (Load(kind="torque", tau_Nm=-7.0), 100.0, -7.0),
        (Load(kind="torque", t_s=[0.0, 1.0, 2.0], values=[3.0, -9.0, 4.0]), 100.0, -9.0),
        (Load(kind="pump", k_pump_Nms2=0.002), 100.0, 20.0),
        (Load(kind="pump", k_pump_Nms2=0.002), -100.0, -20.0),
        (Load(kind="fan", k_fan_Nms2=0.001), -50.0, -2.5),
    ],
)
def test_a_load_has_the_torque_of_its_law(load, omega, tau):
    assert load.torque(omega) == pytest.approx(tau)


def test_speeds_of_a_locked_shaft_are_a_course_and_of_others_the_start():
    t, omega = Load(kind="locked", **COURSE).omega
    assert t == [0, 1, 1] and omega == pytest.approx([300 * RPM, 600 * RPM, -60 * RPM])
    assert Load(kind="locked", speed_rpm=60.0).omega == ([0.0], [pytest.approx(2 * np.pi)])
    fan = Load(kind="fan", k_fan_Nms2=0.1, speed_rpm=60.0)
    assert fan.omega == ([0.0], [pytest.approx(2 * np.pi)]) and fan.tau_0 == ([0.0], [0.0])
    assert Load(kind="torque", **COURSE).tau_0 == ([0, 1, 1], [300, 600, -60])
    assert fan.H_static == ([0.0], [0.0]) and [*fan.flow([1.0, 2.0], [0.0, 0.0])] == [0, 0]


PUMP = {"kind": "pump", "pump": "synthetic_70_25", "D_mm": 125.0, "L_m": 120.0, "K": 4.0}


@pytest.mark.parametrize("head", [5.0, 15.0])
@pytest.mark.parametrize("rpm", [900.0, 1200.0, 1400.0, 1700.0])
def test_a_pump_gives_the_flow_at_which_its_head_is_that_of_the_pipe(head, rpm):
    """By root finding: affinity laws of its curve, Swamee and Jain's friction; none below the speed
    at which the shut-off head is the static one."""
    load = Load(**PUMP, H_static_m=head)
    curve = pump_from("synthetic_70_25", Path()).curve()
    pipe = Pipe(H_static_m=head, L_m=120.0, D_mm=125.0, roughness_mm=0.05, K=4.0)
    r = rpm * RPM / curve.omega_ref

    def spare(Q):
        lost = head + float(pipe.friction_head(np.array([Q]))[0])
        return float(curve.head(np.array([Q]), np.array([r]))[0]) - lost

    flow = brentq(spare, 0.0, curve.Q_end * r) if spare(0.0) > 0 else 0.0
    (found,) = load.flow([rpm * RPM], [0.0])
    assert found == pytest.approx(flow, rel=2e-3, abs=2e-5)
    assert load.flow([-rpm * RPM], [0.0]) == pytest.approx(0.0)
    power = float(curve.shaft_power(np.array([flow]), np.array([r]))[0])
    if rpm * RPM <= 180:
        assert load.torque(rpm * RPM) == pytest.approx(power / (rpm * RPM), rel=5e-3)


def test_a_pump_follows_its_static_head_and_runs_dry_where_the_level_is_below_the_intake():
    omega = 1400 * RPM
    course = {"t_s": [0.0, 10.0], "values": [5.0, 15.0]}
    load = Load(**PUMP, **course)
    alone = [Load(**PUMP, H_static_m=h).flow([omega], [0.0])[0] for h in (5.0, 10.0, 15.0)]
    assert load.flow([omega] * 3, [0.0, 5.0, 10.0]) == pytest.approx(alone, rel=2e-3)
    dry = Load(**PUMP, **course, H_dry_m=10.1)
    assert [q > 0 for q in dry.flow([omega] * 3, [0.0, 5.0, 6.0])] == [True, True, False]


@pytest.mark.parametrize(
    ("given", "course"),
    [
        ({"kind": "torque", "tau_Nm": 5.0}, ([0], [5])),
        ({"kind": "speed", "speed_rpm": 60.0}, ([0], [2 * np.pi])),
        ({"kind": "pv", "speed_rpm": 30.0}, ([0], [np.pi])),
        ({"kind": "none"}, ([0], [1])),
        ({"kind": "torque", **COURSE}, ([0, 1, 1], [300, 600, -60])),
        ({"kind": "speed", **COURSE}, ([0, 1, 1], [10 * np.pi, 20 * np.pi, -2 * np.pi])),
    ],
)
def test_a_reference_is_a_course_in_si(given, course):
    t, values = Reference(**given).course
    assert (t, values) == (pytest.approx(course[0]), pytest.approx(course[1]))


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"kind": "none", "tau_Nm": 1.0}, "tau_Nm has no effect with kind = 'none'"),
        ({"kind": "torque", "speed_rpm": 1.0}, "takes tau_Nm; remove speed_rpm"),
        ({"kind": "speed", "tau_Nm": 1.0}, "takes speed_rpm; remove tau_Nm"),
        ({"kind": "pv", "tau_Nm": 1.0}, "takes speed_rpm; remove tau_Nm"),
        ({"kind": "torque", "tau_Nm": 1.0, **COURSE}, "tau_Nm and values exclude each other"),
        ({"kind": "speed"}, "need either speed_rpm or t_s and values"),
        ({"kind": "torque"}, "need either tau_Nm or t_s and values"),
    ],
)
def test_a_reference_with_two_meanings_or_none_is_refused(given, told):
    with pytest.raises(ParameterError, match=told):
        Reference(**given)


def test_sensors_have_their_steps_in_si():
    coarse = Sensing(adc_bits=10, i_range_A=400.0, i_noise_LSB=1.5, blank_us=2.0, delay_samples=1)
    assert coarse.i_step == pytest.approx(400 / 1024)
    assert coarse.i_noise == pytest.approx(1.5 * 400 / 1024) and coarse.t_blank == 2e-6
    assert Sensing(i_range_A=400.0).i_step == 0 and Sensing().i_noise == 0
    assert not coarse.counted_angle and coarse.angle_step(3, 4) == 0
    encoder = Sensing(encoder_counts=1024, tracker_bandwidth_Hz=50.0)
    assert encoder.angle_step(3, 4) == pytest.approx(2 * np.pi / 1024) and encoder.counted_angle
    assert encoder.tracker_bandwidth == pytest.approx(100 * np.pi)
    assert Sensing().tracker_bandwidth is None
    hall = Sensing(hall=True)  # six edges an electrical period of three phases
    assert hall.angle_step(3, 4) == pytest.approx(2 * np.pi / 4 / 6) and hall.counted_angle
    assert padded([1.0, 2.0], 0.5) == [1, 2, 0.5, 0.5, 0.5, 0.5]  # of six phases at most


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"adc_bits": 1}, "adc_bits = 1 needs i_range_A > 0"),
        ({"i_noise_LSB": 0.1}, "i_noise_LSB = 0.1 needs adc_bits > 0"),
        ({"encoder_index": True}, "encoder_index needs encoder_counts > 0 and hall = true"),
        ({"encoder_index": True, "hall": True}, "encoder_index needs"),
        ({"encoder_index": True, "encoder_counts": 9}, "encoder_index needs"),
        ({"hall": True, "encoder_counts": 9}, "hall has no effect with an encoder"),
        ({"hall_error_deg": 1.0}, "hall_error_deg has no effect without hall"),
    ],
)
def test_keys_of_sensors_that_need_each_other_are_told(given, told):
    with pytest.raises(ParameterError, match=told):
        Sensing(**given)
    whole = Sensing(encoder_index=True, hall=True, encoder_counts=9, hall_error_deg=1.0)
    assert whole.encoder_counts == 9


def test_a_converter_knows_its_drops_and_its_shortest_order():
    assert not Converter(u_dc_V=1.0).has_drops and Converter(u_dc_V=1.0).t_min == 0
    for key in ("v_switch_V", "R_switch_ohm", "v_diode_V", "R_diode_ohm"):
        assert Converter(u_dc_V=1.0, **{key: 0.01}).has_drops
    late = Converter(u_dc_V=1.0, dead_time_us=1.5)
    assert late.t_dead == pytest.approx(1.5e-6) and late.t_min == 0
    both = Converter(u_dc_V=1.0, dead_time_us=1.5, min_pulse_us=2.0)
    assert both.t_min == pytest.approx(3.5e-6)
    usual = SimulationSettings()
    assert (usual.until_s, usual.dt_max_us, usual.theta_start_deg) == (0.1, 20, 0)
