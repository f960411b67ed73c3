"""Numbers that can be meant end at a scale of the machine; loads and jumps of torque by formula."""

from pathlib import Path

import numpy as np
import pytest

import reluctance as rl
from reluctance.drive.laws.left_earlier import _jumps, _last
from reluctance.drive.plausible import corner_speed, most_speed
from reluctance.drive.tables.load import Load

EXAMPLES = Path(__file__).parents[2] / "examples"
RPM = np.pi / 30


def drive(*given, name="paper_rated"):
    return rl.load(EXAMPLES / f"{name}.toml", list(given))


def test_at_the_corner_speed_the_voltage_brings_the_flux_to_alignment_in_half_a_period():
    found = drive()
    m = found.machine
    change = float(m.psi(150.0, np.pi) - m.psi(150.0, 0.0))
    half = np.pi / (4 * corner_speed(m, 240.0))  # of an electrical period [s]
    assert 240.0 * half == pytest.approx(change)
    assert most_speed(found) == pytest.approx(50 * corner_speed(m, 240.0))
    battery = drive("source.t_s=[0, 1]", "source.values=[200, 480]")
    assert most_speed(battery) == pytest.approx(2 * most_speed(found))


def test_iron_loss_of_the_full_flux_at_the_corner_speed_is_a_part_of_the_power_there():
    """Of a sinusoid of half the swing, by Steinmetz's formula; from 0.01 % to all of it."""
    found = drive(name="five_phases_losses")
    m, u_dc = found.machine, found.converter.u_dc_V
    omega, iron = corner_speed(m, u_dc), m.iron
    swing = float(m.psi(m.i_max_A, np.pi) - m.psi(m.i_max_A, 0.0))
    f, power = m.N_r * omega / (2 * np.pi), m.greatest_torque * omega
    loss = (f / iron.f_ref_Hz) ** iron.alpha * (swing / 2 / iron.psi_ref_Wb) ** iron.beta
    for part in (1.01e-4, 0.99):
        drive(f"machine.iron.p_ref_W={part * power / loss!r}", name="five_phases_losses")
    for part in (0.99e-4, 1.01):
        with pytest.raises(rl.ParameterError, match=r"need 0\.01% to 100% of it; check the units"):
            drive(f"machine.iron.p_ref_W={part * power / loss!r}", name="five_phases_losses")
    with pytest.raises(rl.ParameterError, match="B_ref x turns in series x pole area"):
        drive(f"machine.iron.psi_ref_Wb={iron.psi_ref_Wb / 120}", name="five_phases_losses")


def ends():
    """What is set, its greatest value, and the words of the refusal."""
    m = drive().machine
    L_u, R, i = m.L_u_H, m.R / m.R_ohm, m.i_max_A
    fastest = 50 * corner_speed(m, 240.0) / RPM
    period = 60 / (4 * 1500)  # at 1500 rpm [s]
    quick = ["control.law=angles", "reference.kind=none", "reference.tau_Nm=", "control.i_ref_A=9"]
    quick += ["control.theta_on_deg=0", "control.theta_off_deg=120"]
    laws = [*quick, "control.N_p=", "control.N_c=", "control.r_w=", "control.w_i="]
    return [
        ("machine.R_ohm", 10 * 240 / i / R, [], "need at most 10 times"),
        ("converter.u_dc_V", L_u * i / 1e-6, [], "within 1 us; check its unit"),
        ("load.speed_rpm", fastest, [*laws, "control.T_s_us=1"], "need at most"),
        ("load.speed_rpm", -fastest, [*laws, "control.T_s_us=1"], "need at most"),
        ("control.T_s_us", 1e6 * period, laws, "an electrical period at 1500 rpm"),
        ("simulation.until_s", 1e9 * 20e-6, ["simulation.dt_max_us=20"], "steps of .control. T_s"),
    ]


@pytest.mark.parametrize("n", range(6))
def test_the_greatest_value_that_can_be_meant_passes_and_a_little_more_does_not(n):
    key, most, given, told = ends()[n]
    given = [text for text in given if not text.startswith("control.") or _known(text)]
    with pytest.raises(rl.ParameterError, match=told):
        drive(*given, f"{key}={1.001 * most!r}")
    try:
        drive(*given, f"{key}={0.999 * most!r}")
    except rl.ParameterError as fault:  # another limit may come first, as of the law
        assert told.strip(".") not in str(fault)


def _known(text):
    """Removing a key that the example does not give is refused."""
    key = text.partition("=")[0].partition(".")[2]
    return not text.endswith("=") or key in drive().control.model_fields_set


def test_a_load_is_the_square_of_the_speed_with_its_sign_or_a_constant():
    for kind, key in (("pump", "k_pump_Nms2"), ("fan", "k_fan_Nms2")):
        load = Load.model_validate({"kind": kind, key: 0.002})
        for omega in (30.0, -30.0, 0.0):
            assert load.torque(omega) == pytest.approx(0.002 * omega * abs(omega))
        assert load.tau_0 == ([0.0], [0.0]) and load.k == 0.002
        with pytest.raises(ValueError, match="values have no effect"):
            Load.model_validate({"kind": kind, key: 0.002, "t_s": [0.0], "values": [1.0]})
    load = Load.model_validate({"kind": "torque", "t_s": [0, 1, 2], "values": [1.0, -7.0, 3.0]})
    assert load.torque(5.0) == -7.0  # the greatest, with its sign
    assert load.tau_0 == ([0, 1, 2], [1.0, -7.0, 3.0]) and load.omega == ([0.0], [0.0])
    held = Load.model_validate({"kind": "locked", "t_s": [0, 1], "values": [60.0, -30.0]})
    assert held.omega[1] == pytest.approx([2 * np.pi, -np.pi]) and held.torque(9.0) == 0
    started = Load.model_validate({"kind": "torque", "tau_Nm": 2.0, "speed_rpm": 60.0})
    assert started.omega == ([0.0], [pytest.approx(2 * np.pi)]) and started.torque(1.0) == 2.0
    assert not np.any(started.flow([1.0, 2.0], [0.0, 0.0]))


def test_a_torque_that_jumps_is_found_with_the_last_current_before_and_the_first_behind():
    """A torque that grows with the square of the current, but for two steps of 10 %."""
    i = np.geomspace(10, 100, 250)
    tau = 0.01 * i**2
    assert _jumps(tau, i, 100.0) == []
    tau[100:] *= 1.1
    tau[200:] *= 1.1
    first, second = _jumps(tau, i, 1000.0)
    for (below, above), place in ((first, 99), (second, 199)):
        assert below == place < above <= place + 3
    assert _jumps(tau, i, float(tau[150])) == [first]  # none above the greatest torque
    edges = 0.01 * i**2
    for place in (50, 53, 247):  # the second is clear of the first, the third ends with the curve
        edges[place:] *= 1.1
    edges[249:] *= 1.1
    assert _jumps(edges, i, 1000.0) == [(49, 51), (52, 54), (246, 249)]
    for grows, found in ((1.019, 0), (1.021, 1)):
        step = 0.01 * i**2
        step[100:] *= grows
        assert len(_jumps(step, i, 1000.0)) == found


def test_a_curve_passes_a_value_for_the_last_time_or_ends_below_it():
    x = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
    assert _last(x, np.array([0.0, 2.0, 1.0, 3.0, 5.0]), 1.5) == pytest.approx(2.25)
    assert _last(x, np.array([0.0, 2.0, 1.0, 3.0, 5.0]), 4.0) == pytest.approx(3.5)
    assert _last(x, np.arange(5.0), 9.0) == 4.0


def test_a_voltage_in_kilovolt_is_asked_about_with_its_key():
    with pytest.raises(
        rl.ParameterError, match=r"u_dc_V = 0\.24; check the units: kilovolt in u_dc_V"
    ):
        drive("converter.u_dc_V=0.24")


def test_switches_that_do_not_stand_the_dc_link_are_refused():
    with pytest.raises(rl.ParameterError, match="u_rating_V = 200, need at least u_dc_V = 240"):
        drive("converter.u_rating_V=200")
    assert drive("converter.u_rating_V=240").converter.u_rating_V == 240
