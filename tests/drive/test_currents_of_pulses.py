"""Currents of pulses from their mean torque: inverted curves, pulses that end early, what a mean is
taken over. The mean torque of a window is a formula here, of which the answers are known."""

import json
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import reluctance as rl
from reluctance import _core
from reluctance.base.arrays import FloatArray
from reluctance.drive.laws import angles as angles_of
from reluctance.drive.laws import current_table, left_earlier, pulse_table, pwm_current
from reluctance.drive.laws.angle_table import AngleTable
from reluctance.drive.laws.current_table import Curve, Window
from reluctance.drive.laws.pulse_current import PulseCurrent
from reluctance.drive.laws.pulses import FixedLaw, chopped, period, pulses
from reluctance.drive.tables.known import Known

RATED = Path(__file__).parents[2] / "examples" / "paper_rated.toml"
ON, OFF = 0.2, 2.6  # [rad]
Given = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]


@cache
def known() -> Known:
    return rl.load(RATED, ["control.law=angles"]).known()


def fixed_law(*, smooth: bool) -> FixedLaw:
    return replace(chopped(known(), 1.0, brakes=False, hard=False), smooth=smooth)


def given_by(monkeypatch: pytest.MonkeyPatch, module: object, tau: Given) -> None:
    """Mean torques by a formula of turn-on, turn-off and current."""

    def made(_: object, *arguments: object) -> SimpleNamespace:
        return SimpleNamespace(tau=tau(*(np.asarray(v, float) for v in arguments)))

    monkeypatch.setattr(module, "pulses", made)


def squared(on: FloatArray, off: FloatArray, i: FloatArray) -> FloatArray:
    """Without saturation the torque is as the square of the current: 40 N m at 100 A."""
    return np.asarray(40 * (i / 100) ** 2 * (off - on) / (OFF - ON))


def test_between_two_currents_the_torque_is_taken_to_grow_as_the_square() -> None:
    curve = Curve(np.array([0.0, 1.0, 3.0]), np.array([0.0, 1.0, 9.0]))
    assert curve.inverse(np.array([0.0, 0.25, 4.0, 9.0])) == pytest.approx([0, 0.5, 2, 3])


def test_of_a_torque_that_several_currents_give_the_least_is_taken() -> None:
    curve = Curve(np.arange(5.0), np.array([0.0, 0.0, 4.0, 4.0, 9.0]))
    assert curve.inverse(np.array([4.0, 6.25, 100.0])) == pytest.approx([2, 3, 4])


@pytest.mark.parametrize("smooth", [True, False])
def test_table_of_currents_inverts_the_mean_torque(
    monkeypatch: pytest.MonkeyPatch, smooth: bool
) -> None:
    given_by(monkeypatch, current_table, squared)
    window = Window(ON, OFF, fixed_law(smooth=smooth))
    assert window.ends == (ON, OFF)
    torques = np.linspace(0, 41, 17)
    assert window.currents(41.0) == pytest.approx(100 * np.sqrt(torques / 40), rel=1e-9)
    beyond = window.currents(200.0)  # 90 N m are all that 150 A give
    assert beyond[-1] == known().i_max == pytest.approx(100 * np.sqrt(90 / 40))


def jumping(on: FloatArray, off: FloatArray, i: FloatArray) -> FloatArray:
    """A chopping more from 60 A on: 10 % of the torque, as long as the window is whole."""
    return squared(on, off, i) * np.where(i < 60, 1.0, 1.1)


def test_where_the_mean_torque_jumps_the_currents_are_found_to_a_finer_step(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """To a fifth of the distance of 2.5 A that the currents of the curve have there."""
    given_by(monkeypatch, current_table, jumping)
    window, low, high = Window(ON, OFF, fixed_law(smooth=False)), 40 * 0.36, 40 * 0.36 * 1.1
    at_jump = []
    for tau_max in np.linspace(30, 44, 29):
        for current, torque in zip(
            window.currents(tau_max), np.linspace(0, tau_max, 17), strict=True
        ):
            if low < torque < high:
                at_jump.append(abs(current - 60))
            else:
                whole = 100 * np.sqrt(torque / 40 / (1.1 if torque >= high else 1))
                assert current == pytest.approx(whole, rel=2e-3)
    assert len(at_jump) > 15 and max(at_jump) < 0.5


def early(monkeypatch: pytest.MonkeyPatch, given: Given, tau_max: float = 40.0) -> _core.PulseTable:
    given_by(monkeypatch, left_earlier, given)
    given_by(monkeypatch, current_table, given)
    window = Window(ON, OFF, fixed_law(smooth=False))
    return left_earlier.left_earlier(window, tau_max, window.currents(tau_max))


def test_torque_within_a_jump_takes_a_window_that_is_left_earlier(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The table gives every torque, and its window ends early within the jump only."""
    table = early(monkeypatch, jumping)
    low, high = 40 * 0.36, 40 * 0.36 * 1.1
    for torque in np.linspace(6, 40, 200):
        on, off, i = table.at(known().omega_m, torque)
        assert on == pytest.approx(ON)
        assert float(jumping(*map(np.asarray, (on, off, i)))) == pytest.approx(torque, rel=4e-3)
        if torque < 0.99 * low or torque > 1.02 * high:
            assert off == pytest.approx(OFF)
        elif 1.01 * low < torque < 0.99 * high:
            assert off < OFF and i == pytest.approx(60, abs=1)
        for other in (0.1, 10):
            assert table.at(other * known().omega_m, torque) == [on, off, i]


@pytest.mark.parametrize("step", [1.5, 1.06])
def test_every_jump_has_its_own_window(monkeypatch: pytest.MonkeyPatch, step: float) -> None:
    """Two jumps, far apart or next to each other."""

    def twice(on: FloatArray, off: FloatArray, i: FloatArray) -> FloatArray:
        return squared(on, off, i) * (1 + 0.05 * ((i > 50) * 1.0 + (i > 50 * step)))

    table = early(monkeypatch, twice)
    for torque in np.linspace(6, 40, 200):
        found = table.at(known().omega_m, torque)
        assert float(twice(*map(np.asarray, found))) == pytest.approx(torque, rel=6e-3)


def test_without_a_jump_there_is_no_table(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor where it lies above the greatest torque."""
    for given, tau_max in ((squared, 40.0), (jumping, 12.0)):
        with pytest.raises(ValueError, match="empty"):
            early(monkeypatch, given, tau_max).at(100.0, 10.0)


@pytest.mark.parametrize(("part", "looked_at"), [(0.09, False), (0.15, True)])
def test_a_jump_is_looked_for_from_an_eighth_of_the_greatest_torque_on(
    monkeypatch: pytest.MonkeyPatch, part: float, looked_at: bool
) -> None:
    """And down to 6 % less current than that takes."""
    at = 100 * np.sqrt(part)

    def once(on: FloatArray, off: FloatArray, i: FloatArray) -> FloatArray:
        return squared(on, off, i) * np.where(i < at, 1.0, 1.1)

    table = early(monkeypatch, once)
    if looked_at:
        assert table.at(known().omega_m, 1.05 * part * 40)[1] < OFF
    else:
        with pytest.raises(ValueError, match="empty"):
            table.at(known().omega_m, 1.05 * part * 40)


def test_no_torque_takes_no_current_where_small_currents_give_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(pulse_table, "cached", lambda kind, inputs, compute, algorithm: compute())
    given_by(monkeypatch, pulse_table, lambda on, off, i: squared(on, off, np.maximum(i - 30, 0.0)))
    of = np.full((2, 2), ON), np.full((2, 2), OFF)
    angles = AngleTable(np.array([100.0, 102.0]), np.array([10.0, 40.0]), *of)
    table = pulse_table.pulse_table(known(), angles, 1.0, hard=False)
    assert table.at(100.0, 0.0)[2] == 0
    assert table.at(100.0, 10.0)[2] == pytest.approx(30 + 50, rel=5e-3)


def test_table_of_angles_has_the_current_of_each_torque_up_to_the_limit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Windows that differ from node to node; at the last 45 N m are all that 150 A give."""
    monkeypatch.setattr(pulse_table, "cached", lambda kind, inputs, compute, algorithm: compute())
    given_by(monkeypatch, pulse_table, squared)
    dwell = np.array([[OFF - ON, OFF - ON], [(OFF - ON) / 2] * 2])
    on = np.array([[ON, ON], [ON, ON]])
    angles = AngleTable(np.array([100.0, 200.0]), np.array([10.0, 40.0]), on, on + dwell)
    table = pulse_table.pulse_table(replace(known(), tau_max=60.0), angles, 1.0, hard=False)
    for omega_m, part in ((50, 1.0), (100, 1.0), (150, 0.75), (200, 0.5), (900, 0.5)):
        for torque in (0.0, 10.0, 25.0, 40.0):
            found = table.at(omega_m, torque)
            assert found[:2] == pytest.approx([ON, ON + part * (OFF - ON)])
            i = 100 * np.sqrt(torque / 40 / part)
            assert found[2] == pytest.approx(i, rel=5e-3, abs=1e-9)
    assert table.at(200, 60.0)[2] == known().i_max


@pytest.mark.parametrize("hard", [True, False])
def test_the_pulses_of_a_table_are_chopped_as_the_law_chops(
    monkeypatch: pytest.MonkeyPatch, hard: bool
) -> None:
    asked = []

    def noted(of: Known, half: float, *, brakes: bool, hard: bool) -> FixedLaw:
        asked.append((of.omega_m, half, brakes, hard))
        return fixed_law(smooth=True)

    monkeypatch.setattr(pulse_table, "cached", lambda kind, inputs, compute, algorithm: compute())
    monkeypatch.setattr(pulse_table, "chopped", noted)
    given_by(monkeypatch, pulse_table, squared)
    of = np.full((2, 2), ON), np.full((2, 2), OFF)
    angles = AngleTable(np.array([100.0, 102.0]), np.array([10.0, 40.0]), *of)
    pulse_table.pulse_table(replace(known(), omega_m=100.0), angles, 3.0, hard=hard)
    assert asked == [(100.0, 3.0, False, hard), (102.0, 3.0, False, hard)]


def test_a_stored_table_is_another_one_with_another_drive_or_band(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    keys = []

    def noted(kind: type, inputs: list[object], compute: object, algorithm: int) -> object:
        keys.append(json.dumps(inputs, default=float))
        return kind(np.zeros((2, 2)))

    angles = AngleTable(np.array([1.0, 1.05]), np.array([1.0, 1.01]), *np.zeros((2, 2, 2)))
    monkeypatch.setattr(pulse_table, "cached", noted)
    monkeypatch.setattr(pulse_table._core, "PulseTable", lambda **_: None)
    for of, half, hard in (
        (known(), 1.0, False),
        (known(), 2.0, False),
        (known(), 1.0, True),
        (replace(known(), u_dc=300.0), 1.0, False),
        (replace(known(), tau_max=50.0), 1.0, False),
    ):
        pulse_table.pulse_table(of, angles, half, hard=hard)
    assert len(set(keys)) == 5


def pwm(*given: str) -> PulseCurrent:
    control = rl.load(RATED, ["control.law=pwm_current", *given]).control
    assert isinstance(control, PulseCurrent)
    return control


def test_a_mean_is_of_enough_samples_and_of_two_periods_at_least(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """600 samples fall on all angles; a period has 1500 at most, and the loop is no faster."""
    asked: list[dict[str, float]] = []
    fast, slow = (
        pwm().fixed(replace(known(), omega_m=omega_m), brakes=False) for omega_m in (2000.0, 5.0)
    )
    samples = period(fast.known) / fast.known.T_s
    assert fast.known.T_s == known().T_s and samples < 300
    assert fast.periods * samples >= 600 > (fast.periods - 1) * samples
    assert slow.periods == 2 and slow.smooth
    assert period(slow.known) / slow.known.T_s == pytest.approx(1500)
    monkeypatch.setattr(pwm_current._core, "pwm_current", lambda *_, **given: asked.append(given))
    monkeypatch.setattr(pwm_current._core, "Controller", lambda *_: None)
    for law in (fast, slow):
        law.controller(law.known, None, 60.0)
    assert [law["bandwidth"] * law["T_s"] for law in asked] == pytest.approx([0.3, 0.3])


def test_bandwidth_of_the_current_loop_is_as_given_or_by_the_control_period() -> None:
    assert pwm().bandwidth == pytest.approx(0.3 / 20e-6)
    assert pwm("control.bandwidth_Hz=100").bandwidth == pytest.approx(200 * np.pi)
    assert pwm("control.bandwidth_Hz=0.5").bandwidth == pytest.approx(np.pi)
    with pytest.raises(rl.ParameterError, match="bandwidth_Hz = 0, need > 0"):
        pwm("control.bandwidth_Hz=0")
    most = 1 / (2 * np.pi * 20e-6)  # one radian in a control period
    pwm(f"control.bandwidth_Hz={0.9999 * most}")
    with pytest.raises(rl.ParameterError, match=r"bandwidth_Hz = .*, need <= 7957\.7"):
        pwm(f"control.bandwidth_Hz={1.0001 * most}")


def test_pulses_know_no_error_of_a_sensor_and_no_dead_time() -> None:
    dirty = replace(
        known(), t_dead=2e-6, angle_step=0.01, i_step=1.0, i_noise=2.0, tracker_bandwidth=50.0
    )
    clean, same = (
        pulses(chopped(of, 1.0, brakes=False, hard=False), ON, OFF, 60.0) for of in (known(), dirty)
    )
    assert float(clean.tau) == float(same.tau) and float(clean.i_rms) == float(same.i_rms)


def test_pulses_are_computed_in_double_whatever_the_law_of_the_drive_is() -> None:
    """A float knows the flux linkage to 1e-7, and the torque of a pulse to 1e-6."""
    single = _core.angles(
        known().magnetics,
        3,
        True,
        conduction=_core.Conduction(
            theta_on=ON, theta_off=OFF, brake_on=ON, brake_off=OFF, omega_start=0.0
        ),
        reference=_core.MeanTorque.constant(60.0),
        i_band=1.0,
        chop=_core.Leg.freewheel,
        watch=_core.AngleWatch.compare,
        table=_core.PulseTable(),
    )
    double = chopped(known(), 1.0, brakes=False, hard=False)
    of_float = replace(double, controller=lambda *_: _core.Controller(single, _core.Frame(delay=0)))
    ours, other = (pulses(law, ON, OFF, 60.0) for law in (double, of_float))
    assert 0 < abs(float(ours.tau) - float(other.tau)) < 1e-4 * float(ours.tau)


def test_hard_chopping_switches_more_and_braking_is_always_hard() -> None:
    """Freewheeling holds a current longer than demagnetizing: a band is passed less often."""
    soft, hard = (
        pulses(chopped(known(), 8.0, brakes=False, hard=hard), ON, OFF, 60.0)
        for hard in (False, True)
    )
    assert float(soft.tau) != pytest.approx(float(hard.tau), rel=1e-4)
    one, other = (
        pulses(chopped(known(), 8.0, brakes=True, hard=hard), np.pi + ON, np.pi + OFF, 60.0)
        for hard in (False, True)
    )
    assert float(one.tau) == float(other.tau) > 0


def test_a_band_is_as_wide_as_the_voltage_crosses_in_a_thousandth_of_a_period(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Where the flux linkage grows in proportion to the current; at most 7 % of the current."""
    own, bands = _core.angles, []

    def noted(*given: object, i_band: float, **named: object) -> object:
        bands.append(i_band)
        return own(*given, i_band=i_band, **named)

    monkeypatch.setattr(_core, "angles", noted)
    half_way = _core.magnetics(known().magnetics, np.array([known().i_max]), np.array([np.pi / 2]))
    i_per_psi = known().i_max / half_way[0, 0]
    wide = known().u_dc * 1e-3 * period(known()) * i_per_psi / 2
    turns = {"brake_on": np.pi, "brake_off": np.pi + 1.0, "omega_start": 0.0}
    window = _core.Conduction(theta_on=ON, theta_off=OFF, **turns)
    for half in (0.5 * wide, 2 * wide):
        law = chopped(known(), half, brakes=False, hard=False)
        assert (law.smooth, law.periods) == ((True, 1) if half < wide else (False, 2))
        for i in (5 * wide, 100 * wide):
            law.controller(law.known, window, i)
    narrowed = max(0.5 * wide, 0.07 * 5 * wide)
    assert bands == pytest.approx([narrowed, wide, 2 * wide, 2 * wide], rel=1e-9)


def test_two_pulses_that_share_nothing_broadcast() -> None:
    law = chopped(known(), 1.0, brakes=False, hard=False)
    on, i = np.array([[ON], [ON + 0.1]]), np.array([30.0, 60.0, 90.0])
    both = pulses(law, on, OFF, i)
    assert both.tau.shape == both.i_rms.shape == (2, 3)
    assert both.tau[1, 2] == pulses(law, ON + 0.1, OFF, 90.0).tau
    assert (np.diff(both.tau, axis=1) > 0).all() and (both.i_rms < i).all()


def angles(*given: str) -> PulseCurrent:
    control = rl.load(RATED, ["control.law=angles", *given]).control
    assert isinstance(control, PulseCurrent)
    return control


@pytest.mark.parametrize("brakes", [True, False])
@pytest.mark.parametrize(
    ("given", "half", "hard"),
    [
        (("control.i_band_A=",), 3.0, False),  # 2 % of 150 A
        (("control.i_band_A=", "control.chop=hard"), 3.0, True),
        (("control.i_band_A=1.5",), 1.5, False),
    ],
)
def test_fixed_pulses_have_the_band_and_the_chopping_of_the_table(
    monkeypatch: pytest.MonkeyPatch, given: tuple[str, ...], half: float, hard: bool, brakes: bool
) -> None:
    monkeypatch.setattr(angles_of, "chopped", lambda *of, **how: (of, how))
    (of, band), how = angles(*given).fixed(known(), brakes=brakes)
    assert of is known() and band == pytest.approx(half)
    assert how == {"brakes": brakes, "hard": hard}


@pytest.mark.parametrize(
    ("tau_max", "rooms"), [(20.0, [1.1]), (24.0, [1.1, 1.3]), (29.0, [1.1, 1.3, 1.6])]
)
def test_a_window_by_rule_is_searched_with_more_room_until_it_gives_the_torque(
    monkeypatch: pytest.MonkeyPatch, tau_max: float, rooms: list[float]
) -> None:
    """Its pulses may fall short of what the search expects; 20 N m here for a room of 1."""
    asked: list[float] = []
    law = angles()

    def window(self: object, of: Known, room: float = 1.1) -> tuple[float, float]:
        asked.append(room)
        return ON, ON + room

    monkeypatch.setattr(type(law), "window", window)
    monkeypatch.setattr(type(law), "brake_window", lambda *_: (4.0, 6.0))
    given_by(monkeypatch, current_table, lambda on, off, i: 20 * (i / 150) ** 2 * (off - on))
    found = law.windows(replace(known(), tau_max=tau_max))[0]
    assert asked == rooms
    assert found.ends == (ON, ON + asked[-1])


def able(most: float) -> Window:
    """A window of 10 to 150 deg that gives so much torque at most."""
    made = SimpleNamespace(
        curve=SimpleNamespace(tau=np.array([0.0, most])),
        ends=np.radians([10.0, 150.0]),
        currents=lambda tau_max: [most, tau_max],
    )
    return made


OWN = ["control.theta_on_deg=10", "control.theta_off_deg=150"]


@pytest.mark.parametrize(
    ("given", "direction", "motors", "brakes", "enough"),
    [
        ([], {"motors": True}, 40.0, 40.0, True),
        ([], {"motors": True}, 30.0, 50.0, False),
        ([], {"motors": True}, 40.0, 10.0, True),
        ([], {"brakes": True}, 50.0, 30.0, False),
        ([], {"brakes": True}, 10.0, 40.0, True),
        ([], {"reference": "speed"}, 10.0, 40.0, True),  # one direction is enough
        ([], {"reference": "pv"}, 10.0, 40.0, False),  # a pump motors
        ([], {"reference": "pv"}, 40.0, 10.0, True),
        ([], {}, 39.0, 39.0, False),
        (OWN, {}, 39.0, 90.0, False),  # angles of one's own must motor
        (OWN, {}, 40.0, 10.0, True),
    ],
)
def test_the_direction_of_all_references_must_have_its_torque(
    given: list[str], direction: dict[str, bool], motors: float, brakes: float, enough: bool
) -> None:
    of = replace(
        known(),
        **{"motors": False, "brakes": False, "tau_max": 40.0, "tau_working": 40.0} | direction,
    )
    windows, law = (able(motors), able(brakes)), angles(*given)
    if enough:
        assert law.currents(of, windows) == ([motors, 40], [brakes, 40])
        return
    with pytest.raises(rl.ParameterError) as told:
        law.currents(of, windows)
    assert "angles 10 to 150 deg give a mean torque of at most" in str(told.value)
    assert "at i_max_A = 150 and 1500 rpm, need 40;" in str(told.value)


def test_a_torque_that_neither_direction_gives_is_told_by_the_one_that_is_asked() -> None:
    of = replace(known(), motors=True, brakes=False, tau_max=60.0, tau_working=40.0)
    with pytest.raises(rl.ParameterError, match=r"of at most 30 N m at .* need 40;"):
        angles().currents(of, (able(30.0), able(50.0)))


def test_the_working_torque_alone_is_asked_of_its_direction() -> None:
    of = replace(known(), motors=True, brakes=False, tau_max=40.0, tau_working=20.0)
    assert angles().currents(of, (able(25.0), able(45.0))) == ([25, 40], [45, 40])
    with pytest.raises(rl.ParameterError, match="need 20;"):
        angles().currents(of, (able(15.0), able(45.0)))


def test_a_fixed_current_is_its_own_reference_and_has_no_table() -> None:
    unasked = ["reference.kind=none", "reference.tau_Nm="]
    law = angles(*OWN, "control.i_ref_A=60", *unasked)
    assert law.currents(known(), (able(1.0), able(1.0))) is None
    with pytest.raises(rl.ParameterError, match="without a torque reference needs theta_on_deg"):
        angles("control.i_ref_A=60", *unasked)
    for i_ref, fits in ((150, True), (150.1, False)):
        given = [*OWN, f"control.i_ref_A={i_ref}", *unasked]
        if fits:
            angles(*given)
        else:
            with pytest.raises(rl.ParameterError, match=r"need <= \[machine\] i_max_A = 150"):
                angles(*given)
