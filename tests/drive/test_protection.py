"""The exported protection in closed loop, on the desk: no false alarms, and faults are found."""

import csv
import ctypes

import numpy as np
import pytest
from false_alarms import COURSES, row
from fault_table import FAULTS, LAWS, compiled, noisy, play
from firmware_tools import ROOT, Native

import reluctance as rl
from reluctance import _core
from reluctance.base.units import to_si
from reluctance.drive.guard.trip_levels import protection

pytestmark = pytest.mark.long

AT = 25e-3  # phase 1 conducts


@pytest.mark.parametrize("name", [*LAWS, "map_mpc", "ditc", "pwm_current", "five_phases_losses"])
def test_noise_trips_nothing(name):
    """8 LSB rms, 48 LSB at most, of 12 bits; `fault_table.py noise` runs a second."""
    given = noisy(name)
    target = compiled(name).again()
    rl.simulate(given, until=0.1, record=None, controller=target.controller)
    assert len(target.status) >= 1000
    assert target.trip is None


@pytest.mark.parametrize("law", LAWS)
def test_the_first_seconds_of_ten_minutes_have_no_false_alarm(law):
    """`python tests/support/false_alarms.py` runs all of them."""
    for course in COURSES:
        found = row(law, course, 12.0)
        assert found["in_run_pct"] > 99
        assert (found["trips"], found["doubted_samples"]) == (0, 0)


def test_ten_stored_minutes_of_each_law_have_no_false_alarm():
    with (ROOT / "bench" / "protection_alarms.csv").open() as file:
        stored = list(csv.DictReader(file))
    for law in LAWS:
        rows = [part for part in stored if part["law"] == law]
        assert sum(float(part["simulated_s"]) for part in rows) == 600
        assert {part["course"] for part in rows} == {*COURSES}
        for part in rows:
            assert (part["trips"], part["doubted_samples"]) == ("0", "0")
            assert int(part["reversals"]) > 200


def test_a_drive_that_brakes_together_with_its_fan_is_not_taken_for_a_stuck_angle():
    """Both slow the rotor down. The 6/4 machine has 100.6 N m at 150 A, two phases together."""
    drive = COURSES["fan"]("paper_rated")
    strong = drive.with_values({"load.k_fan_Nms2": 1.0})
    taken = drive.load.k * protection(drive).levels.omega_max ** 2
    assert taken < 100
    assert acceleration(drive) == pytest.approx(1.25 * 4 * (100.57 + taken) / drive.J, rel=1e-3)
    assert acceleration(strong) == pytest.approx(1.25 * 4 * 2 * 100.57 / drive.J, rel=1e-3)


@pytest.mark.parametrize("name", ["hysteresis_200A", "ditc", "pwm_current"])
def test_a_light_rotor_under_its_own_torque_is_no_stuck_angle(name):
    """Also under a law that has a current to hold, and no torque."""
    drive = rl.load(ROOT / "examples" / f"{name}.toml")
    light = {"load.J_kgm2": 0.5 * drive.machine.J_kgm2, "sensing.encoder_counts": 4096}
    fan = {"load.kind": "fan", "load.k_fan_Nms2": 1e-3, "load.speed_rpm": 200.0}
    fan |= {"protection.speed_max_rpm": 3000.0}
    given = drive.with_values({**fan, **light, "supervision.enable_s": 0.0})
    result = rl.simulate(given, until=0.2)
    assert result.omega_m.max() > 2 * to_si(200.0, "rpm")
    assert 7 not in [event.status for event in result.events]


def test_the_course_of_a_held_speed_is_no_stuck_angle():
    """It may change faster than the torque lets the rotor turn: 3000 rpm in 5 ms."""
    drive = COURSES["fan"]("paper_rated").with_values(
        {"load.kind": "locked", "load.k_fan_Nms2": 0.0, "supervision.enable_s": 0.0}
        | {"load.t_s": [0.0, 0.14, 0.145, 0.3], "load.values": [1500.0, 1500.0, -1500.0, -1500.0]}
        | {"sensing.encoder_counts": 4096}
    )
    assert acceleration(drive) == pytest.approx(1.25 * 4 * 100 * np.pi / 5e-3)
    assert not [event for event in rl.simulate(drive, until=0.2).events if event.mode == "fault"]


def acceleration(drive):
    """The greatest that the protection expects, electrical [rad/s^2]."""
    advance = protection(drive).advance
    return advance.bend / (advance.parts * advance.block * drive.control.T_s) ** 2


@pytest.mark.parametrize("name", LAWS)
def test_noise_delays_a_dying_sensor_by_one_sample_at_most(name):
    """The reading of the phase with most current becomes 0, at eight instants of a period."""
    found = {}
    for lsb in (0.0, 8.0):
        given = noisy(name, lsb=lsb)
        n = round(AT / given.control.T_s)
        for shift in range(8):
            dead = n + shift * round(1e-2 / 8 / given.control.T_s)
            phase = {}

            def spoil(y, sample, dead=dead, phase=phase):
                if sample >= dead:
                    y["i"][phase.setdefault("k", int(np.argmax(y["i"])))] = 0

            target = compiled(name, lsb).again(spoil)
            until = (dead + 40) * given.control.T_s
            rl.simulate(given, until=until, record=None, controller=target.controller)
            trip = target.trip
            assert trip is not None and trip[1] == 8
            found[lsb, shift] = trip[0] - dead
    for shift in range(8):
        assert found[8.0, shift] <= found[0.0, shift] + 1
    assert max(found.values()) <= 3


# Within what the model may be wrong by; or slow enough for the observer of the speed to follow.
WITHIN_THE_MODEL = ("gain 0.7", "gain 1.4", "from the start", "index lost")
FOLLOWED = ("edge_mpc_mcu", "encoder loses 2 % of its counts")


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("fault", [f for f in FAULTS if "shorted" not in f or "sensor" in f])
def test_no_fault_of_a_sensor_drives_a_current_past_what_the_machine_stands(name, fault):
    found = play(name, fault, at=AT, until=AT + 12e-3)
    assert found.i_peak < 1.3 * found.i_max
    if not any(part in fault for part in WITHIN_THE_MODEL) and (name, fault) != FOLLOWED:
        assert found.status != 0
        assert found.late_us < 11_000  # the phase conducts again


@pytest.mark.parametrize("counts", [1024, 4096, 16384])
def test_an_encoder_drive_accelerates_to_its_speed(counts, tmp_path):
    given = rl.load(ROOT / "examples" / "paper_pump.toml", [f"sensing.encoder_counts={counts}"])
    target = Native(given, tmp_path)
    run = rl.simulate(given, until=0.3, record=1e-3, controller=target.controller)
    assert target.trip is None
    assert run.omega_m.max() * 30 / np.pi > 1495


def test_braking_into_a_small_capacitor_folds_back_and_does_not_trip(tmp_path):
    """-41 N m at 1500 rpm on 1 mF behind a rectifier: 1.4 kW would reach the trip in 12 ms."""
    source = ["source.kind=battery", "source.C_uF=1000", "source.R_ohm=0.05", "source.one_way=true"]
    given = rl.load(ROOT / "examples" / "sharing_cubic.toml", ["reference.tau_Nm=-41", *source])
    target = Native(given, tmp_path)
    run = rl.simulate(given, until=0.1, record=1e-4, controller=target.controller)
    assert target.trip is None
    assert 260 < run.u_dc.max() < 300  # the trip level
    early = run.t < 3e-3
    assert run.tau_ref[early].min() < -40
    assert abs(run.tau_ref[-1]) < 10


def test_one_disturbed_reading_switches_off_for_a_sample_and_two_latch(tmp_path):
    given = noisy("sharing_cubic")

    def spoil(y, n):
        if n in (1000, 1300, 1310):
            y["i"][1] = 1.25 * given.machine.i_max_A

    target = Native(given, tmp_path, spoil)
    rl.simulate(given, until=0.03, record=None, controller=target.controller)
    status = np.array(target.status)
    assert status[1000] == 2 and not status[1001:1300].any()
    assert status[1300] == 2 and not status[1301:1310].any()
    assert (status[1310:] == 2).all()
    fault = target.fault()
    assert (fault.status, fault.phase) == (2, 1)
    assert fault.value == pytest.approx(187.5)
    assert fault.limit == pytest.approx(180)
    assert fault.age == len(status) - 1311


class Drive:
    """The exported states of a drive, sampled by hand with the rotor turning at 300 rpm."""

    def __init__(self, given, folder):
        self.given, self.target = given, Native(given, folder)
        self.n = 0
        self.lost = 0.0  # by the shown angle [rad electrical]

    def step(
        self, *, u_dc=240.0, enable=1, clear=0, tripped=0, fresh=True, i=(0.0, 0.0, 0.0), tau=0.0
    ):
        omega = 10 * np.pi
        theta = _core.wrap_float(4 * omega * self.n * self.given.control.T_s - self.lost)
        self.n += 1
        self.sequence = getattr(self, "sequence", 0) + int(fresh)
        return self.target.run(
            (i, theta, omega, u_dc, 0.0), (enable, clear, tripped, self.sequence, tau)
        )

    def until(self, mode, most=400_000, **how):
        for _ in range(most):
            if self.step(**how)["mode"] == mode:
                return self.n
        raise AssertionError(f"mode {mode} was not reached")


OFF, PRECHARGE, CALIBRATE, READY, RUN, FAULT = range(6)


@pytest.fixture
def states(tmp_path):
    return Drive(rl.load(ROOT / "examples" / "sharing_cubic.toml"), tmp_path)


@pytest.mark.parametrize(("per_sample", "trips"), [(1 / 48, True), (1 / 80, False)])
def test_a_slow_slip_adds_up_over_64_samples(per_sample, trips, tmp_path):
    """The sum of a slip s in each sample tends to 64 s: s = slack/48 reaches the slack when
    1 - (63/64)^n = 48/64, after 88 samples; s = slack/80 never does."""
    slack = np.radians(20)
    given = rl.load(ROOT / "examples" / "sharing_cubic.toml")
    states = Drive(given.with_values({"protection.angle_slack_deg": 20}), tmp_path)
    states.until(RUN)
    samples = 0
    while samples < 2000 and states.step()["mode"] == RUN:
        samples += 1
        states.lost += per_sample * slack
    if trips:
        assert samples == pytest.approx(88, abs=2)
        assert states.target.fault().status == 7  # stuck angle
    else:
        assert samples == 2000


def legs_are_off(states):
    return all(
        order["gate"] == 1 and (order["leg"] == -1).all()
        for order in states.target.command["phase"][0]
    )


def test_a_rising_dc_link_latches_nothing_and_leads_to_run(states):
    """0 to 240 V in 0.4 s."""
    modes = []
    for n in range(25_000):
        modes.append(states.step(u_dc=min(n * 20e-6 / 0.4, 1) * 240)["mode"])
        assert modes[-1] == RUN or legs_are_off(states)
    assert [m for n, m in enumerate(modes) if n == 0 or m != modes[n - 1]] == [1, 2, 3, 4]
    assert modes.index(CALIBRATE) * 20e-6 == pytest.approx(0.4 * 0.7 + 0.02, abs=1e-3)
    states.step(tau=20.0)
    assert not legs_are_off(states)


def test_the_law_does_not_run_without_a_dc_link(states):
    for _ in range(1000):
        assert states.step(u_dc=0.0)["mode"] == PRECHARGE
        assert legs_are_off(states)
    assert states.target.fault().status == 0


def test_precharge_that_does_not_come_is_a_fault(states):
    states.until(FAULT, u_dc=100.0)
    assert states.target.fault().status == 12
    assert states.n * 20e-6 == pytest.approx(5.0, abs=1e-3)


def test_calibration_takes_the_offsets_from_every_reading(states):
    offset = (1.5, -2.5, 0.7)
    states.until(RUN, i=offset)
    for _ in range(100):
        assert states.step(i=offset)["mode"] == RUN  # -2.5 A alone would be out of range at -3
    states.step(i=(1.5, -2.5 - 3.1, 0.7))
    assert states.target.fault().status == 6


def test_a_sensor_with_too_large_an_offset_fails_calibration(states):
    states.until(FAULT, i=(0.0, 4.0, 0.0))
    fault = states.target.fault()
    assert (fault.status, fault.phase, fault.value) == (13, 1, pytest.approx(4.0))


def test_silence_of_the_command_stops_the_drive(states):
    states.until(RUN)
    start = states.n
    states.until(FAULT, fresh=False)
    assert (states.n - start) * 20e-6 == pytest.approx(0.1, abs=1e-3)
    assert states.target.fault().status == 14
    assert legs_are_off(states)


def test_a_fault_stays_until_it_is_cleared_without_enable_and_without_its_cause(states):
    states.until(RUN)
    assert states.step(tripped=1)["mode"] == FAULT
    hot = {"i": (0.0, 0.0, 200.0)}
    for how in ({}, {"clear": 1}, {"enable": 0}, {"enable": 0, "clear": 1, **hot}):
        assert states.step(**how)["mode"] == FAULT
        assert legs_are_off(states)
    assert states.target.fault().status == 15
    assert states.step(enable=0, clear=1)["mode"] == OFF
    assert states.target.fault().status == 0
    states.until(RUN)


def test_under_voltage_is_a_fault_in_run_only(states):
    states.until(READY, fresh=False)
    assert states.step(u_dc=30.0, fresh=False)["mode"] == PRECHARGE
    states.until(RUN)
    states.step(u_dc=30.0)
    assert states.step(u_dc=30.0)["mode"] == FAULT
    assert states.target.fault().status == 4


def test_the_chopper_switches_with_hysteresis_below_the_trip(states):
    on = [bool(states.step(u_dc=u)["chopper"]) for u in (270, 277, 270, 260, 257, 270, 277)]
    assert on == [False, True, True, True, False, False, True]


def test_the_outputs_say_when_gates_and_relay_may_close(states):
    seen = {}
    for _ in range(5000):
        out = states.step()
        seen[int(out["mode"])] = (int(out["gate_enable"]), int(out["precharged"]))
    assert seen == {1: (0, 0), 2: (0, 1), 3: (0, 1), 4: (1, 1)}


def test_an_order_of_zeros_is_all_off(states):
    zero = np.zeros(64, np.uint8)
    leg = states.target.library.reluctance_compared_leg
    leg.restype, leg.argtypes = (
        ctypes.c_int8,
        [ctypes.c_void_p, ctypes.c_int8, ctypes.c_float, ctypes.c_float, ctypes.c_int],
    )
    for before in (-1, 0, 1):
        assert leg(zero.ctypes.data, before, 5.0, 1.0, 0) == -1
    assert states.target.library.reluctance_api() == 3


def test_a_board_that_is_quieter_than_the_simulated_one_has_no_frozen_sensor(tmp_path):
    """Built for 8 LSB of noise: equal readings in a row are healthy where there is none."""
    for law in ("sharing_cubic", "paper_rated"):
        target = compiled(law).again()
        rl.simulate(noisy(law, lsb=0.0), until=0.1, record=None, controller=target.controller)
        assert target.trip is None
