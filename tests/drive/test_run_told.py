"""What a run says of its drive: limits not kept, angles too coarse, faults too late, power left to
the array; where the rotor is by the flux linkages; windings that warm; waveforms on a grid."""

import re
from dataclasses import fields, replace
from importlib import import_module
from itertools import count
from pathlib import Path
from types import SimpleNamespace as Namespace

import numpy as np
import pytest
from matplotlib.figure import Figure

import reluctance as rl
from reluctance import _core
from reluctance.cli.run import unmet
from reluctance.drive.run import array_left, kpis, plots, safety
from reluctance.drive.run.columns import Rows
from reluctance.drive.run.estimate import Estimate, estimate
from reluctance.drive.run.losses import switching_loss
from reluctance.drive.run.record import WAVEFORMS
from reluctance.drive.run.safety import (
    beyond_angles,
    coarse_angle,
    coarse_current,
    drained,
    exceeded,
    folded_back,
    handed_over,
    never_planted,
    refused_by_firmware,
)
from reluctance.machine.loss_data import Iron, SwitchingEnergies

EXAMPLES = Path(__file__).parents[2] / "examples"
RPM = np.pi / 30
IRON = Iron(p_ref_W=60.0, psi_ref_Wb=0.3, f_ref_Hz=100.0, alpha=1.4, beta=1.9)
LIMITS = {
    "converter.u_rating_V": 300.0,
    "protection.u_dc_max_V": 320.0,
    "protection.speed_max_rpm": 2000.0,
}


@pytest.fixture(scope="module")
def rated():
    return rl.load(EXAMPLES / "paper_rated.toml")  # i_max_A = 150, 240 V


@pytest.fixture(scope="module")
def pulse():
    """A law that asks for no resistance: fixed angles."""
    return rl.load(EXAMPLES / "single_pulse.toml")


def test_a_torque_that_a_fault_takes_is_not_looked_for_in_the_limit(rated):
    """An open phase costs a third of the torque; the drive file says so itself."""
    broken = rated.with_values({"faults": [{"kind": "open_wire", "phase": "b"}]})
    (line,) = (
        text for text in unmet(broken, rl.simulate(broken, until=0.04).kpis) if "held" in text
    )
    assert "[[faults]], [mismatch] or [sensing] of the drive file may be why" in line
    assert "`reluctance limit`" not in line


@pytest.mark.parametrize(
    ("sensing", "limit"),
    [
        ({"i_offset_A": [20.0, 20.0, 20.0]}, False),
        ({"i_gain": [1.5, 1.0, 1.5]}, False),
        ({"i_offset_A": [0.0, 0.0, 0.0], "i_gain": [1.0, 1.0, 1.0]}, True),
    ],
)
def test_nor_is_a_torque_that_wrong_sensors_take(rated, sensing, limit):
    drive = rated.with_values({f"sensing.{key}": value for key, value in sensing.items()})
    low = replace(rl.simulate(rated, until=0.04).kpis, tau_mean=18.0)
    (line,) = (text for text in unmet(drive, low) if "held" in text)
    assert ("`reluctance limit`" in line) == limit
    assert ("[sensing] of the drive file may be why" in line) != limit


@pytest.mark.parametrize(
    ("law", "comparators", "error", "told"),
    [
        ("angles", "analog", {"i_gain": [1.0, 1.1, 1.0]}, True),
        ("angles", "two_level", {"i_offset_A": [0.0, 0.0, 1.0]}, True),
        ("angles", "sampled", {"i_gain": [1.0, 1.1, 1.0]}, False),
        ("angles", "analog", {"i_gain": [1.0, 1.0, 1.0], "i_offset_A": [0.0, 0.0, 0.0]}, False),
        ("deadbeat", "analog", {"i_gain": [1.0, 1.1, 1.0]}, False),
    ],
)
def test_errors_that_comparators_do_not_see_are_told(rated, law, comparators, error, told):
    values = {"control.law": law, "sensing.comparators": comparators}
    drive = rated.with_values(values | {f"sensing.{k}": v for k, v in error.items()})
    assert bool(safety.compared_truly(drive)) == told


def test_a_run_takes_numbers_of_numpy(rated):
    short = rl.simulate(rated, until=np.float32(0.01), record=np.float32(1e-4))
    assert short.t[-1] == pytest.approx(0.01)
    with pytest.raises(rl.ParameterError, match=r"until = '0\.1', need a number of seconds"):
        rl.simulate(rated, until="0.1")


def told(drive, **reached):
    usual = {"i_peak_run": 150.0, "u_dc_peak_run": 240.0, "speed_peak_run": 1500 * RPM}
    return exceeded(drive, Namespace(**usual | reached))


@pytest.mark.parametrize(
    ("figure", "reached", "beyond", "what"),
    [
        ("i_peak_run", 164.9, 165.1, r"the peak current of the run, 165.1 A, .* i_max_A = 150"),
        ("u_dc_peak_run", 300.0, 300.1, r"reaches 300.1 V .* \[converter\] u_rating_V = 300:"),
        ("speed_peak_run", 2000 * RPM, 2001 * RPM, r"speed reaches 2001 rpm .* = 2000$"),
    ],
)
def test_a_limit_is_told_where_a_run_passes_it(rated, figure, reached, beyond, what):
    """A comparator's band takes a tenth of i_max_A; a voltage and a speed may be reached."""
    drive = rated.with_values(LIMITS)
    assert told(drive, **{figure: reached}) == []
    (line,) = told(drive, **{figure: beyond})
    assert re.search(what, line)
    assert len(told(drive, u_dc_peak_run=330.0)) == 2  # the rating and the trip level
    if figure != "i_peak_run":
        assert told(rated, **{figure: beyond}) == []  # it states no such limit


@pytest.mark.parametrize(("given", "trip"), [({}, 180.0), ({"protection.i_trip_A": 170.0}, 170.0)])
def test_a_current_above_the_trip_level_is_told_as_such(rated, given, trip):
    drive = rated.with_values(given)
    assert "trip level" not in told(drive, i_peak_run=trip)[0]
    (line,) = told(drive, i_peak_run=trip + 0.1)
    assert f", and above the trip level of {trip:g} A: a shorter" in line


def test_noise_of_the_current_sensors_is_told_from_a_thirtieth_of_the_limit_on(rated):
    """150 A; a step of 12 bits over 200 A is 0.0488 A."""
    given = ["sensing.adc_bits=12", "sensing.i_range_A=200"]
    for noise, told in ((90, False), (95, True)):
        drive = rl.load(EXAMPLES / "paper_rated.toml", [*given, f"sensing.i_noise_LSB={noise}"])
        assert bool(coarse_current(drive)) == told
    assert "4.64 A rms, 3% of i_max_A = 150: check the unit" in coarse_current(drive)[0]


def test_levels_that_firmware_refuses_are_told_by_a_run_that_does_not_use_them(rated):
    for level, told in (
        ("u_dc_min_V=300", "u_dc_min_V = 300"),
        ("speed_limit_rpm=90000", "speed_limit_rpm = 90000"),
        ("u_ready_V=900", "u_ready_V = 900"),
        ("i_zero_A=80", "i_zero_A = 80"),
        ("command_timeout_ms=1e-3", "command_timeout_ms = 0.001"),
    ):
        (note,) = refused_by_firmware(
            rl.load(EXAMPLES / "paper_rated.toml", [f"protection.{level}"])
        )
        assert note.startswith("not looked at in this run") and told in note, level
    assert (
        refused_by_firmware(rl.load(EXAMPLES / "paper_rated.toml", ["protection.u_dc_min_V=100"]))
        == []
    )
    assert refused_by_firmware(rated) == []


def test_an_encoder_is_coarse_whose_step_is_wider_than_a_stroke(rated):
    """Three phases and four rotor poles: twelve strokes of 30 degrees."""

    def of(counts, **more):
        return coarse_angle(
            replace(rated, sensing=rated.sensing.computed(encoder_counts=counts, **more))
        )

    (line,) = of(11)
    assert "encoder_counts = 11 is 32.7 deg of the shaft, wider than a stroke, 30 deg" in line
    assert "take at least 48 counts" in line
    assert of(12) == of(0) == of(11, hall=True) == []
    assert len(of(1)) == 1


def test_a_fault_from_the_end_of_a_run_on_is_told(rated):
    kinds = [{"kind": "sensor_dead", "phase": "b", "t_s": t} for t in (0.1, 0.2, 0.3)]
    drive = rated.with_values({"faults": kinds})
    last, at_end = never_planted(drive, 0.3), never_planted(drive, 0.2)
    assert [line.split()[0] for line in last] == ["[faults.2]"]
    assert [line.split()[0] for line in at_end] == ["[faults.1]", "[faults.2]"]
    assert "t_s = 0.3 is not before the end of the run at 0.3 s: sensor_dead" in last[0]
    assert never_planted(drive, 0.31) == []


@pytest.mark.parametrize(
    ("end", "keys"),
    [
        (0.06, []),
        (0.05, ["restart_s"]),
        (0.04, ["clear_s", "restart_s"]),
        (0.02, ["fault_s", "gone_s", "clear_s", "restart_s"]),
        (0.01, ["enable_s", "fault_s", "gone_s", "clear_s", "restart_s"]),
    ],
)
def test_an_event_of_the_states_from_the_end_of_a_run_on_is_told(end, keys, rated):
    at = {"enable_s": 0.01, "fault_s": 0.02, "gone_s": 0.03, "clear_s": 0.04, "restart_s": 0.05}
    events = {"supervision.fault": "over_current"} | {f"supervision.{k}": at[k] for k in at}
    drive = rated.with_values(events)
    assert never_planted(drive, end) == [
        f"[supervision] {key} = {at[key]:g} is not before the end of the run at {end:g} s: it does "
        "not come; run longer (--until), or set it earlier"
        for key in keys
    ]


def test_a_course_that_changes_once_after_the_end_of_a_run_is_told(rated):
    course = {"reference.tau_Nm": None, "reference.t_s": [0.0, 0.3], "reference.values": [5.0, 8.0]}
    drive = rated.with_values(course)
    (line,) = never_planted(drive, 0.2)
    assert line.startswith("the course of [reference] goes on to 0.3 s, the run ends at 0.2 s")
    assert never_planted(drive, 0.3) == []


def left(tracking, part):
    """Of a drive at its greatest speed for a part of 2 s, and at half of it for the rest."""
    t = np.array([0.0, 2 * part, 2.0])
    window = {"t": t, "theta_m": np.array([0.0, 200 * part, 200 * part + 100 * (1 - part)])}
    drive = Namespace(omega_nominal=100.0, machine=Namespace(N_r=4))
    run = Namespace(drive=drive, kpis=Namespace(tracking=tracking), periods=window)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(array_left, "evaluated", lambda rows, N_r: (rows, 2))
        return array_left.left(run)


def test_what_an_array_could_give_is_told_of_a_drive_at_its_greatest_speed():
    """Below 98 % of the energy available, and for 2 % of the time."""
    (line,) = left(0.9, 0.25)
    assert "greatest speed, 954.9 rpm, for 0.5 of 2 s, and leaves what the array gives" in line
    assert left(0.98, 0.25) and not left(0.981, 0.25) and not left(None, 0.25)
    assert left(0.9, 0.021) and not left(0.9, 0.019)


def rows_of(t, theta_m, **columns):
    """Rows with an estimate; each column constant but for the time and the angles."""
    usual = dict.fromkeys(_core.flux_estimate_columns, 0.0) | {"psi_scale_hat": 1.0} | columns
    table = {"t": t, "theta_m": theta_m} | {
        n: np.broadcast_to(v, t.shape) for n, v in usual.items()
    }
    return Rows(np.stack([*table.values()], axis=1), [*table])


def test_between_samples_the_rotor_turns_on_at_the_speed_that_is_estimated():
    """At a sample it is as estimated there: nothing has passed since, whatever the clock rounds."""
    T_s, N_r, omega = 1e-3, 4, 50.0
    n = np.arange(1, 200)
    t = np.concatenate([n * T_s, np.cumsum(np.full(199, T_s)), (n + 0.25) * T_s])
    since = np.where(np.arange(t.size) < 2 * n.size, 0.0, 0.25 * T_s)
    found = estimate(rows_of(t, 0 * t, theta_hat=1.5, omega_hat=omega), N_r, T_s)
    assert found.theta_e == pytest.approx(1.5 + N_r * omega * since, abs=1e-9)
    assert found.omega_m == pytest.approx(np.full(t.size, omega))


def test_an_estimate_is_an_angle_of_one_turn_and_its_error_of_half_a_turn():
    t, theta_hat = 1e-3 * np.arange(5), np.array([-0.1, 6.4, 3.0, 3.0, 0.1])
    theta_m = np.array([-0.2, 6.3, -3.0, 3.2, 2 * np.pi]) / 4
    columns = {"zero_hat": 0.3, "theta_deviation": 0.2, "R_scale_hat": 1.1, "tau_load_hat": 7.0}
    found = estimate(rows_of(t, theta_m, theta_hat=theta_hat, **columns), 4, 1e-3)
    assert found.theta_e == pytest.approx(np.array([2 * np.pi - 0.1, 6.4 - 2 * np.pi, 3, 3, 0.1]))
    assert found.error == pytest.approx(np.array([0.1, 0.1, 6 - 2 * np.pi, -0.2, 0.1]))
    for values, want in (
        (found.zero, 0.3), (found.deviation, 0.2), (found.R_scale, 1.1), (found.tau_load, 7.0),
        (found.psi_scale, 1.0),
    ):  # fmt: skip
        assert values == pytest.approx(np.full(5, want))
    shown = found.columns()
    assert shown["zero_hat_deg"] == pytest.approx(np.degrees(found.zero))
    assert shown["tau_load_hat_Nm"] == pytest.approx(found.tau_load)
    unknown = estimate(rows_of(t, theta_m, psi_scale_hat=np.array([0.0, 1, 1, 1, 0])), 4, 1e-3)
    for field in fields(unknown):
        values = np.isnan(getattr(unknown, field.name))
        assert values.tolist() == [True, False, False, False, True], field.name


def test_figures_of_an_estimate_are_of_the_second_half_of_what_is_known():
    """Errors of its last three instants of six; the rest as it ends."""
    error = np.radians([np.nan, 50.0, -60.0, 70.0, 3.0, -4.0, 0.0, np.nan])
    ramp = np.arange(8.0)
    made = Estimate(error * 0 + 1, ramp, ramp, ramp, ramp / 10, ramp / 100, ramp / 1000, error)
    assert made.figures() == pytest.approx(
        {
            "error_rms_deg": np.sqrt(25 / 3),
            "error_max_deg": 4.0,
            "deviation_deg": np.degrees(0.006),
            "zero_deg": np.degrees(0.06),
            "psi_scale": 6.0,
            "R_scale": 0.6,
        }
    )
    assert made.text() == (
        "wrong by 2.9 deg electrical rms, 4 at most; zero of the sensor +3.4 deg, "
        "flux linkage 6.000 and R 0.600 of what the control believes"
    )
    assert made.columns()["speed_hat_rpm"] == pytest.approx(ramp / RPM)
    some = made.kept(ramp > 5)
    assert some.R_scale == pytest.approx(np.array([0.6, 0.7])) and some.error.shape == (2,)


def test_a_winding_that_is_warm_throughout_has_the_resistance_of_a_warm_machine(pulse):
    """The law asks for no resistance. A factor that rises is followed to a millisecond."""
    warm = replace(pulse, machine=pulse.machine.computed(R_ohm=1.5 * pulse.machine.R))
    times = [0.0, 0.02]
    plain, at_once, as_file = (
        rl.simulate(pulse, until=0.012, record=1e-3, warming=(times, [1.0, 1.0])),
        rl.simulate(pulse, until=0.012, record=1e-3, warming=(times, [1.5, 1.5])),
        rl.simulate(warm, until=0.012, record=1e-3),
    )
    cold = rl.simulate(pulse, until=0.012, record=1e-3)
    assert plain.i == pytest.approx(cold.i, rel=1e-6, abs=1e-6)
    assert at_once.i == pytest.approx(as_file.i, rel=1e-6, abs=1e-6)
    assert at_once.i.max() < 0.999 * plain.i.max()


def test_waveforms_on_a_grid_are_those_of_all_points(pulse):
    """States straight between their neighbours; legs and orders as they last were, and the end."""
    whole, thinned = (rl.simulate(pulse, until=0.00505, record=r) for r in (0.0, 1e-4))
    lossy = replace(pulse, machine=pulse.machine.computed(iron=IRON))
    after = rl.simulate(lossy, until=0.00505, record=1e-4)
    for grid in (thinned, after):
        assert grid.t == pytest.approx([*(1e-4 * np.arange(51)), 0.00505], abs=1e-12)
        for k in range(3):
            want = np.interp(grid.t, whole.t, whole.i[k])
            assert grid.i[k] == pytest.approx(want, abs=1e-3 * whole.i.max())
            last = whole.leg[k][np.searchsorted(whole.t, grid.t + 1e-10, side="right") - 1]
            assert np.array_equal(grid.leg[k], last)


def test_the_wall_time_of_a_run_is_that_of_its_steps_alone(pulse, monkeypatch):
    """A clock that goes on by 0.25 s with each look at it, before and after a step."""
    looks, reached = count(), []
    clock = Namespace(perf_counter=lambda: 0.25 * next(looks))
    monkeypatch.setattr(import_module("reluctance.drive.run.simulate"), "time", clock)
    run = rl.simulate(pulse, until=0.02, record=None, progress=reached.append)
    assert reached[-1] == pytest.approx(0.02) and next(looks) == 2 * len(reached)
    assert run.kpis.wall_s_per_sim_s == pytest.approx(0.25 * len(reached) / 0.02)


def test_a_run_since_an_instant_has_its_rows_from_there_on(pulse):
    run = rl.simulate(pulse, until=0.004, record=1e-3)
    late = run.since(0.002)
    for name in WAVEFORMS:
        assert np.array_equal(getattr(late, name), getattr(run, name)[..., 2:]), name
    assert run.since(0.0021).t[0] == pytest.approx(0.003)


def test_a_guide_that_is_not_found_is_told_in_the_place_of_its_run(pulse, monkeypatch):
    """Of a run on a thread, and of one that needs Python."""

    def none(*_):
        raise RuntimeError("no optimum found")

    lossy = replace(pulse, machine=pulse.machine.computed(iron=IRON))
    for name, made in (("simulate_all", "controller"), ("simulate", "guarded")):
        monkeypatch.setattr(import_module(f"reluctance.drive.run.{name}"), made, none)
    for found in rl.simulate_all([pulse, lossy], until=0.001):
        assert isinstance(found, rl.ParameterError) and str(found) == "no optimum found"


def test_switching_energies_scale_with_voltage_and_current_of_each_edge():
    """2.5 mJ a turn-on with the recovery of its diode and 1.5 mJ a turn-off, at 600 V and 50 A."""
    point = {"u_sw_ref_V": 600.0, "i_sw_ref_A": 50.0}
    energies = SwitchingEnergies(E_on_mJ=2.0, E_rr_mJ=0.5, E_off_mJ=1.5, **point)
    at_point = 600.0 * 50.0 * 1000  # a thousand edges in a second [VA/s]
    assert switching_loss(energies, at_point, 0.0) == pytest.approx(2.5)
    assert switching_loss(energies, 0.0, at_point) == pytest.approx(1.5)
    assert switching_loss(energies, at_point / 2, at_point / 4) == pytest.approx(1.625)
    assert switching_loss(SwitchingEnergies(), at_point, at_point) is None


def test_a_speed_is_shown_beside_the_course_that_is_asked_for(pulse):
    """Straight between its points; the flow of a pump has an axis and a column of its own."""
    run = rl.simulate(pulse, until=0.004, record=1e-3)
    course = Namespace(kind="speed", course=([0.0, 0.002, 9.0], [0.0, 100.0, 100.0]))
    asked = replace(run, drive=Namespace(reference=course, load=run.drive.load))
    ax = plots.plot_speed(Figure().add_subplot(), asked)
    shown = {line.get_label(): line.get_ydata() for line in ax.lines}
    assert shown["reference"] == pytest.approx(np.array([0, 50, 100, 100, 100]) / RPM)
    assert shown["speed"] == pytest.approx(run.omega_m / RPM)
    assert len(plots.plot_speed(Figure().add_subplot(), run).lines) == 1
    load = Namespace(pump="one", flow=lambda omega_m, t: 1e-3 * t)
    pumped = replace(run, drive=Namespace(reference=course, load=load))
    assert len(plots.plot_speed(Figure().add_subplot(), pumped).figure.axes) == 2
    assert pumped.columns()["Q_m3ph"] == pytest.approx(3.6 * run.t)
    assert "Q_m3ph" not in run.columns()


def over(**columns):
    """Rows of a run."""
    return Rows(np.stack([np.array(v, float) for v in columns.values()], axis=1), [*columns])


def test_a_mean_flow_is_that_of_the_mean_speeds_of_the_periods():
    """Of 10 rad/s for a second and 20 for two, by the time that each takes; an end that has two
    rows is no period."""
    times = []

    def flow(omega_m, t):
        times.append(t.tolist())
        return 1e-3 * omega_m**2

    window = over(t=[0, 1, 1, 3], theta_m=[0, 10, 10, 50])
    drive = Namespace(load=Namespace(pump="one", flow=flow))
    assert kpis._mean_flow(drive, window) == pytest.approx((0.1 * 1 + 0.4 * 2) / 3)
    assert times == [[0, 1]]
    assert kpis._mean_flow(drive, over(t=[1, 1], theta_m=[0, 0])) is None
    assert kpis._mean_flow(Namespace(load=Namespace(pump=None)), window) is None


def test_tracking_is_the_energy_taken_over_that_of_the_maximum_power_point():
    """100 W/s t from 1 to 3 s are 400 J."""
    window = over(t=[1, 2, 3], E_source=[5, 100, 305])
    source = Namespace(kind="pv", available=lambda t: 100 * t)
    assert kpis._tracking(Namespace(source=source), window) == pytest.approx(0.75)
    assert kpis._tracking(Namespace(source=Namespace(kind="battery")), window) is None


@pytest.mark.parametrize(
    ("values", "u_max", "told"),
    [  # of 240 V nominal and 300 V at the trip: from 264 V on
        (["reference.tau_Nm=-20"], 264.1, True),
        (["reference.tau_Nm=-20"], 263.9, False),
        (["reference.tau_Nm=20"], 288.0, False),  # motors
        (["reference.tau_Nm=20", "load.speed_rpm=-1500"], 288.0, True),
        (["reference.tau_Nm=-20", "protection.u_dc_max_V=400"], 288.0, False),
    ],
)
def test_braking_that_charges_the_dc_link_is_told_as_the_cause_of_less_torque(values, u_max, told):
    drive = rl.load(EXAMPLES / "battery.toml", values)
    speed = -1500 * RPM if "load.speed_rpm=-1500" in values else 1500 * RPM
    lines = folded_back(drive, Namespace(speed_mean=speed, u_dc_max=u_max))
    assert bool(lines) == told
    if told:
        assert f"to {u_max:.4g} V, since the source does not take its energy" in lines[0]
        assert "back from 264 V on, all of it at 288 V" in lines[0]


@pytest.mark.parametrize(
    ("taken", "stored", "part"),
    [
        (100.0, 5.0, ""),  # a twentieth is settled
        (100.0, 5.1, "takes 5%"),
        (100.0, -5.0, ""),
        (100.0, -6.0, "gives 6%"),
        (-100.0, 20.0, "takes 20%"),
        (1e-3, 0.0004, "takes 40%"),
        (1e-3, -0.0004, "gives 40%"),
    ],
)
def test_a_capacitor_that_gives_or_takes_more_than_a_twentieth_of_the_energy_is_told(
    rated, monkeypatch, taken, stored, part
):
    rows = over(E_dc=[7.0, 7.0 + taken], W_dc=[3.0, 3.0 + stored])
    monkeypatch.setattr(safety, "evaluated", lambda periods, N_r: (rows, 1))
    lines = drained(rated, Namespace(u_dc_min=201.0, u_dc_max=256.5), rows)
    if not part:
        assert lines == []
        return
    (line,) = lines
    assert f"the capacitor of the dc link {part} of the drive's power" in line
    assert "(201 to 256.5 V)" in line


def test_what_a_law_does_not_use_is_that_of_the_means_of_its_figures():
    """At the mean torque and speed, and half way between the voltages."""
    asked = []

    def unused(**at):
        asked.append(at)
        return "its sharing" if at["u_dc"] < 200 else ""

    drive = Namespace(unused=unused)
    figures = {"tau_ref_mean": 20.0, "speed_mean": 1500 * RPM, "u_dc_min": 100.0}
    (line,) = handed_over(drive, Namespace(**figures, u_dc_max=280.0))
    assert asked == [{"tau": 20.0, "omega_m": 1500 * RPM, "u_dc": 190.0}]
    assert line.startswith("at 20 N m and 1500 rpm the law does not use [control] its sharing. It")
    assert handed_over(drive, Namespace(**figures, u_dc_max=300.0)) == []
    none = figures | {"tau_ref_mean": None, "u_dc_max": 280.0}
    assert handed_over(drive, Namespace(**none)) == [] and len(asked) == 2


@pytest.mark.parametrize(
    ("rpm", "said"), [(474, True), (476, False), (-3000, False), (3149, False), (-3151, True)]
)
def test_a_speed_beyond_a_table_of_angles_is_told_in_both_directions(rpm, said):
    """The example's table is of 500 to 3000 rpm."""
    drive = rl.load(EXAMPLES / "angle_table.toml")
    lines = beyond_angles(drive, Namespace(speed_mean=rpm * RPM))
    turns = f"angle_table.csv has angles from 500 to 3000 rpm, and the drive turns at {abs(rpm)}: "
    assert [turns in line for line in lines] == [True] * said


def test_fixed_angles_are_of_no_table(pulse):
    assert beyond_angles(pulse, Namespace(speed_mean=1e4)) == []


def test_a_source_that_takes_no_energy_is_charged_by_braking_and_one_that_does_is_not():
    """And the remedy, followed, is right."""
    given = ["reference.tau_Nm=-20", "simulation.until_s=0.1"]
    one_way = rl.load(EXAMPLES / "battery.toml", [*given, "source.one_way=true"])
    assert folded_back(one_way, k := rl.simulate(one_way, record=None).kpis)
    assert abs(k.tau_mean) < 1
    other = rl.load(EXAMPLES / "battery.toml", given)
    assert not folded_back(other, k := rl.simulate(other, record=None).kpis)
    assert k.tau_mean == pytest.approx(-20, rel=0.02)
