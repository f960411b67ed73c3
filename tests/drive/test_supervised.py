"""A drive with [supervision]: the states, the protection and the control as one step."""

import json
import re

import numpy as np
import pytest
from command import command
from firmware_tools import ROOT, Native

import reluctance as rl
from reluctance import _core
from reluctance.drive.guard.supervised import controller
from reluctance.drive.run.events import MODES, events, evidence

FILE = ROOT / "examples" / "deadbeat_g474.toml"  # delay of a sample, noise, encoder
UP = {"supervision.enable_s": 0.0, "simulation.until_s": 0.16}
TO_RUN = 0.07 + 3e-4  # settled, calibrated, and a sample for each state [s]
FAULTS = {  # statuses, and the longest time until it is found [s]
    "over_current": ({2}, 1e-3),
    "over_voltage": ({3}, 1e-3),
    "under_voltage": ({4}, 1e-3),
    "dead_current_sensor": ({8}, 0.011),
    "frozen_current_sensor": ({8, 9, 10, 11}, 0.011),
    "lost_encoder": ({7}, 2e-3),
    "no_command": ({14}, 0.0102),
    "hardware_trip": ({15}, 2e-4),
}


@pytest.fixture(scope="module")
def drive():
    return rl.load(FILE).with_values(UP)


def ran(drive, values):
    return rl.simulate(drive.with_values(values))


def named(result):
    return [event.mode for event in result.events]


def test_a_sweep_marks_the_points_that_trip(tmp_path):
    settings = [("--set", f"{key}={value}") for key, value in UP.items()]
    order = ["sweep", FILE, *sum(settings, ()), "--set", "supervision.fault=over_current"]
    order += ["--set", "supervision.fault_s=0.1", "--vary", "supervision.fault_s=0.1,0.3"]
    order += ["--out", tmp_path / "s.sqlite", "--table", tmp_path / "t.csv"]
    for _ in range(2):  # the second time from the store
        told = command(*order).out
        assert "0.1 !" in told and "0.3 !" not in told
        said = " ".join(told.split())
        assert "note: 1 of them trip, marked `!`: their figures are of drives that do not" in said
        assert "the first: supervision.fault_s = 0.1, at 0.1" in said
    columns = np.genfromtxt(tmp_path / "t.csv", delimiter=",", names=True)
    assert columns["t_trip_s"][0] == pytest.approx(0.1, abs=1e-3)
    assert np.isnan(columns["t_trip_s"][1])
    given = rl.load(FILE).with_values(UP)
    assert rl.simulate(given).kpis.t_trip is None


def test_a_drive_is_precharged_calibrated_and_runs(drive):
    result = ran(drive, {"supervision.enable_s": 0.01, "supervision.precharge_ms": 30.0})
    assert named(result) == ["off", "precharge", "calibrate", "ready", "run"]
    run = result.events[-1].t
    charged = 0.01 + 0.03 * (0.7 - 0.01) / 0.99  # of the ready voltage, on a straight line
    assert charged + 0.07 < run < charged + TO_RUN
    before = result.t < run
    assert np.all(result.leg[:, before] == -1)
    assert np.all(result.i[:, before] == 0)
    assert result.u_dc[0] == pytest.approx(0.01 * drive.converter.u_dc_V)
    assert np.array_equal(result.mode[before] == MODES.index("run"), np.zeros(before.sum(), bool))
    assert np.all(result.mode[result.t > run] == MODES.index("run"))
    late = result.t > run + 0.02
    assert np.mean(result.tau[late]) == pytest.approx(drive.tau_max, rel=0.05)


def test_the_same_control_runs_with_and_without_states(drive):
    """Mean torque of the last periods, with the same law behind it."""
    with_states, without = ran(drive, {}), ran(drive, {"supervision.enable_s": None})
    assert without.events is None and without.mode is None
    assert "mode" not in without.columns()
    assert with_states.kpis.tau_mean == pytest.approx(without.kpis.tau_mean, rel=0.01)


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_stops_the_drive_is_cleared_and_the_drive_starts_again(drive, fault):
    statuses, longest = FAULTS[fault]
    at, clear, again = 0.09, 0.125, 0.13
    result = ran(
        drive,
        {
            "supervision.fault": fault,
            "supervision.fault_phase": "b",
            "supervision.fault_s": at,
            "supervision.clear_s": clear,
            "supervision.restart_s": again,
            "protection.command_timeout_ms": 10.0,
            "simulation.until_s": 0.22,
        },
    )
    up = ["precharge", "calibrate", "ready", "run"]
    assert named(result) == [*up, "fault", "off", *up]
    found = result.events[4]
    assert found.status in statuses
    assert [str(event) for event in result.events[4:6]] == [f"fault: {found.text}", "off"]
    assert at <= found.t <= at + longest
    T_s = drive.control.T_s
    off = (result.t > found.t) & (result.t < result.events[-1].t)
    assert np.all(result.leg[:, off] == -1)
    assert np.all(result.i[:, off & (result.t > found.t + 3e-3)] == 0)
    assert result.events[5].t == pytest.approx(clear, abs=1.5 * T_s)
    assert 0 < result.events[-1].t - again < TO_RUN
    late = result.t > result.events[-1].t + 0.01
    assert np.mean(result.tau[late]) == pytest.approx(drive.tau_max, rel=0.05)


@pytest.mark.parametrize("again", [0.215, 0.25])
def test_a_drive_that_starts_again_on_a_turning_rotor_finds_its_speed_anew(again):
    """While the drive is off nothing follows the rotor, which goes on: what the observer knew of
    angle and speed at the fault is wrong, and made the protection trip."""
    fan = rl.load(
        ROOT / "examples" / "fan.toml",
        ["sensing.encoder_counts=4096", "sensing.delay_samples=1", "simulation.theta_start_deg=7"],
    )
    result = ran(
        fan,
        {
            "supervision.enable_s": 0.0,
            "supervision.fault": "hardware_trip",
            "supervision.fault_s": 0.2,
            "supervision.clear_s": 0.21,
            "supervision.restart_s": again,
            "simulation.until_s": again + 0.12,
        },
    )
    assert named(result)[-5:] == ["off", "precharge", "calibrate", "ready", "run"]
    late = result.t > result.events[-1].t + 0.02
    assert np.all(result.tau_ref[late] > 0)  # slower than its reference: it has to drive


def test_a_fault_stays_while_its_cause_does(drive):
    result = ran(
        drive,
        {
            "supervision.fault": "over_voltage",
            "supervision.fault_s": 0.09,
            "supervision.gone_s": 0.13,
            "supervision.clear_s": 0.11,
        },
    )
    assert named(result)[-2:] == ["fault", "off"]
    assert result.events[-1].t == pytest.approx(0.13, abs=2 * drive.control.T_s)


def test_a_law_in_python_stands_in_the_same_states(drive):
    class Off(rl.Law):
        def step(self, y, tau_ref):
            return [rl.Order() for _ in range(y.n_phases)]

    result = rl.simulate(drive, law=Off())
    assert named(result) == ["precharge", "calibrate", "ready", "run"]


def test_many_drives_have_their_states_too(drive):
    (figures,) = rl.simulate_all([drive], jobs=1)
    assert figures.tau_mean == rl.simulate(drive, record=None).kpis.tau_mean


def test_a_start_within_the_half_that_is_evaluated_is_the_only_note():
    """Its torque has not settled and is below its reference, which then says nothing of the law."""
    sets = ("--set", "supervision.enable_s=0", "--until", "0.1")
    notes = [line for line in command("run", FILE, *sets).out.splitlines() if "note: " in line]
    (told,) = notes
    assert "the drive reaches `run` at 0.0701 s, within the half that is evaluated" in told


def test_the_command_prints_the_states(tmp_path):
    sets = [f"--set={key}={value}" for key, value in UP.items()]
    sets += ["--set=supervision.fault=hardware_trip", "--set=supervision.fault_s=0.1"]
    done = command("run", FILE, *sets)
    assert done.code == 0
    assert re.search(r"0\.1000 s  fault: the board tripped by itself \(status 15\)", done.out)
    out = tmp_path / "run.csv"
    events = json.loads(command("run", FILE, *sets, "--json", "--out", out).out)["events"]
    assert [e["mode"] for e in events] == ["precharge", "calibrate", "ready", "run", "fault"]
    assert events[-1]["t_s"] == pytest.approx(0.1, abs=1e-4)
    assert out.read_text().splitlines()[0].endswith(",mode")


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"enable_s": None, "clear_s": 0.1}, "clear_s has no effect without enable_s"),
        ({"fault": "lost_encoder"}, "need both or none"),
        ({"fault_phase": "b"}, "fault_phase has no effect without a fault"),
        ({"restart_s": 0.2}, "restart_s needs clear_s"),
        ({"clear_s": 0.2, "restart_s": 0.1}, "restart_s = 0.1, need more than clear_s = 0.2"),
        ({"fault": "no_command", "fault_s": 0.1, "fault_phase": "d"}, "one of the 3 phases"),
        ({"fault": "smoke"}, "need 'none', 'over_current'"),
    ],
)
def test_what_cannot_be_meant_is_refused_in_a_line(drive, values, said):
    with pytest.raises(rl.ParameterError, match=said) as told:
        drive.with_values({f"supervision.{key}": value for key, value in values.items()})
    assert "\n" not in str(told.value)
    assert "[supervision]" in str(told.value)


def test_a_course_of_the_voltage_is_no_precharge(drive):
    with pytest.raises(rl.ParameterError, match="needs a \\[source\\] of constant voltage"):
        drive.with_values(
            {
                "supervision.precharge_ms": 10.0,
                "source.t_s": [0.0, 0.1],
                "source.values": [240.0, 200.0],
            }
        )


@pytest.mark.parametrize("fault", ["lost_encoder", "hardware_trip"])
def test_every_order_is_that_of_the_package_in_every_bit(drive, fault, tmp_path):
    """The step of the desk and reluctance_run of the exported package, on the same samples: from
    power-up through a fault and its clearing to the second run."""
    at, clear, again = 0.08, 0.085, 0.09
    given = drive.with_values(
        {
            "control.precision": "float",
            "supervision.fault": fault,
            "supervision.fault_s": at,
            "supervision.clear_s": clear,
            "supervision.restart_s": again,
        }
    )
    desk, target = controller(given), Native(given, tmp_path)
    T_s, n_phases = given.control.T_s, given.machine.n_phases
    different, modes, held = 0, [], 0.0

    def step(y, reference):
        nonlocal different, held
        t = T_s * len(modes)
        orders = _core.step(desk, y, reference)
        troubled = at <= t < clear
        if not (troubled and fault == "lost_encoder"):
            held = y.theta_e
        sample = (y.i, _core.wrap_float(held), y.omega_m, y.u_dc, y.i_source)
        enable, cleared = not clear <= t < again, clear <= t < again
        tripped = troubled and fault == "hardware_trip"
        out = target.run(sample, (enable, cleared, tripped, len(modes) + 1, reference))
        modes.append(MODES[out["mode"]])
        told = target.row()
        different += np.asarray(orders[:-1], np.float32).tobytes() != told.tobytes()
        return orders

    rl.simulate(given, until=0.18, record=None, controller=_core.controller_from(n_phases, step))
    assert different == 0
    entered = [mode for n, mode in enumerate(modes) if n == 0 or modes[n - 1] != mode]
    assert entered == [event.mode for event in events(desk)]
    up = ["precharge", "calibrate", "ready", "run"]
    assert entered == [*up, "fault", "off", *up]


FAN = """
machine = "generic_1hp_8_6"
[converter]
u_dc_V = 300
[load]
kind = "fan"
k_fan_Nms2 = 1.4e-4
J_kgm2 = 0.004
[reference]
kind = "speed"
speed_rpm = 800
[control]
law = "angles"
T_s_us = 50
tau_max_Nm = 3
i_band_A = 0.1
[sensing]
delay_samples = 1
adc_bits = 12
i_range_A = 10
encoder_counts = 4096
[supervision]
enable_s = 0.0
[simulation]
until_s = 0.8
"""


@pytest.mark.parametrize(
    "counts", [4096, *(pytest.param(n, marks=pytest.mark.long) for n in (512, 1024))]
)
@pytest.mark.parametrize("start", [0.0, 7.5, 20.0, 31.0, 44.0])
def test_edges_at_the_true_angle_are_no_fault_of_a_coarse_encoder(start, counts, tmp_path):
    """The window's edges come at the true angle, and the protection knows the measured one."""
    (tmp_path / "fan.toml").write_text(FAN)
    drive = rl.load(tmp_path / "fan.toml").with_values(
        {"simulation.theta_start_deg": start, "sensing.encoder_counts": counts}
    )
    assert named(rl.simulate(drive))[-1] == "run"


@pytest.mark.parametrize(
    ("status", "phase", "value", "limit", "said"),
    [
        (2, 1, 8.09, 8.0, "phase 1 (b): 8.09 A, above the limit of 8 A"),
        (4, -1, 100.0, 120.0, "100 V, below the limit of 120 V"),
        (5, -1, 50 * np.pi, 40 * np.pi, "1500 rpm, above the limit of 1200 rpm"),
        (5, -1, -50 * np.pi, 40 * np.pi, "-1500 rpm, above the limit of 1200 rpm"),
        (6, 0, -2.0, -1.0, "phase 0 (a): -2 A, below the limit of -1 A"),
        (6, -1, 7.0, 2 * np.pi, "401.1 deg el., need 0 to 360"),
        (7, -1, np.pi / 10, np.pi / 12, "18 deg el., above the limit of 15 deg el."),
        (8, 2, 0.0076, 0.0049, "phase 2 (c): 0.0076 Wb, above the limit of 0.0049 Wb"),
        (11, 0, 3.5, 20, "phase 0 (a): 3.5 A in 20 samples"),
        (14, -1, 0.1, 0.1, "0.1 s, at the limit of 0.1 s"),
        (15, -1, 0.0, 0.0, "(status 15)"),
        (18, -1, 0.3, 0.2, "0.3, above the limit of 0.2)"),
    ],
)
def test_the_evidence_of_a_fault_has_its_unit(status, phase, value, limit, said):
    assert said in evidence("x", status, phase, value, limit)
