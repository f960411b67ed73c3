"""The fair comparison of control laws: equal frequency, equal conditions, no hidden knowledge."""

import copy
import csv
import json
import re
import subprocess
import sys
from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from command import command, refused

import reluctance as rl
from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.base.units import hertz
from reluctance.drive.laws.pulses import chopped, pulses
from reluctance.explore.comparison import CONTENDERS, compare, write
from reluctance.explore.comparison.conditions import operating_point
from reluctance.explore.comparison.contest import _miss, torque_to_speed_ripple
from reluctance.explore.comparison.table import as_json, markdown, plain
from reluctance.explore.comparison.tuning import TOLERANCE, Tuner

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "studies"))
import speed_range  # noqa: E402

RATED = ROOT / "examples" / "paper_rated.toml"
FAST = ["sharing_cubic", "deadbeat"]


@pytest.fixture(scope="module")
def rated():
    return rl.load(RATED, ["control.T_s_us=5"])


@pytest.fixture(scope="module")
def found(rated):
    return compare(rated, FAST, f_switch=10e3, octaves=(-1.0,), processes=1)


def without_times(comparison):
    tree = copy.deepcopy(as_json(comparison))
    for record in tree["controls"]:
        record.pop("ns_per_step", None)
    return json.dumps(tree)


def test_every_law_switches_at_the_asked_frequency(found):
    for entry in found.entries:
        assert entry.met
        assert entry.kpis.f_switch == pytest.approx(10e3, rel=TOLERANCE)
        drive = CONTENDERS[entry.name].drive(found.point, entry.values)
        again = rl.simulate(drive, until=0.3, record=None).kpis
        assert again.f_switch == pytest.approx(10e3, rel=2 * TOLERANCE)
        assert again.torque_error_rms == pytest.approx(entry.kpis.torque_error_rms, rel=0.05)


@pytest.mark.long
def test_the_outcome_does_not_depend_on_the_run_or_the_processes(rated, found):
    again = compare(rated, FAST, f_switch=10e3, octaves=(-1.0,), processes=2)
    assert without_times(again) == without_times(found)


def test_less_switching_is_more_ripple(found):
    for entry in found.entries:
        slow, fast = entry.front
        assert slow.f_switch == pytest.approx(5e3, rel=TOLERANCE)
        assert slow.torque_error_rms > 1.2 * fast.torque_error_rms


def test_searched_angles_are_no_worse_than_those_by_rule(found):
    for entry in found.entries:
        tuner = Tuner(found.point, CONTENDERS[entry.name], 10e3, budget=0)
        by_rule = tuner.match({}, entry.values[CONTENDERS[entry.name].free.key])
        assert entry.kpis.torque_error_rms < 1.05 * by_rule.figures["torque_error_rms"]


@pytest.mark.parametrize(
    ("machine", "u_dc", "tau", "rpm"),
    [("own_12_8", 300, 12, 1200), ("generic_1hp_8_6", 240, 2, 1500)],
)
def test_a_law_that_works_at_the_period_of_the_drive_is_possible(machine, u_dc, tau, rpm):
    """In the middle of the periods of a carrier, 31 times as long, its angles give no torque."""
    values = {"machine": machine, "converter.u_dc_V": u_dc, "reference.tau_Nm": tau}
    drive = rl.load(ROOT / "examples" / "sharing_cubic.toml").with_values(
        {**values, "load.speed_rpm": rpm, "control.T_s_us": 25}
    )
    tuner = Tuner(operating_point(drive), CONTENDERS["pwm_current"], 10e3, budget=3)
    with pytest.raises(rl.ParameterError, match="mean torque of at most"):
        tuner.match({}, tuner.lever.middle)
    best = tuner.best()
    assert tuner.target.met(best.figures) or tuner.ran_out
    assert best.figures["tau_mean_Nm"] == pytest.approx(tau, rel=0.1)


def test_the_limit_is_a_limit(found):
    for entry in found.entries:
        assert entry.kpis.i_rms > 0.995 * found.bound.i_rms


def test_all_laws_meet_the_same_conditions(rated):
    point = operating_point(rated)
    for contender in CONTENDERS.values():
        drive = contender.drive(point, {})
        for field in fields(drive):
            if field.name != "control":
                assert getattr(drive, field.name) is getattr(point, field.name)
        assert drive.control.T_s_us == point.control.T_s_us
        assert drive.control.precision == point.control.precision
        low, _ = contender.range(point, 10e3)
        if contender.free.key == "T_s_us":
            assert low == point.control.T_s_us  # no carrier is faster than the sampling of others


def test_a_frequency_out_of_reach_is_told_and_not_hidden(rated):
    slow = replace(rated, sensing=type(rated.sensing)(delay_samples=1))
    out = compare(slow, ["ditc"], f_switch=200e3, octaves=(), processes=1)
    (entry,) = out.entries
    assert not entry.met
    assert entry.kpis.f_switch < 200e3
    assert "at most" in entry.note
    text = markdown(out)
    assert "`ditc` *" in text and entry.note in text
    assert any(line.startswith("ditc *") for line in plain(out))


@pytest.mark.long
def test_a_law_that_is_smoother_with_less_switching_is_told(rated):
    sampled = replace(rated, sensing=type(rated.sensing)(comparators="sampled"))
    slow = replace(sampled, control=rated.control.model_copy(update={"T_s_us": 4.0}))
    out = compare(slow, ["sharing_cubic"], f_switch=20e3, octaves=(-1.0,), processes=1)
    (entry,) = out.entries
    half, full = entry.front
    assert entry.met and half.torque_error_rms < full.torque_error_rms
    assert entry.note.startswith("smoother with less") and entry.note in markdown(out)


@pytest.mark.long
@pytest.mark.parametrize("point", ["paper_rated", "paper_half"])
def test_predictive_edges_halve_ditc_and_third_every_sharing_function_at_equal_sampling(point):
    """At 5 us and just below 20 kHz; with analog comparators no control can
    (docs/control/best_mpc.md). A rival that cannot switch so often has its ripple scaled down."""
    drive = rl.load(
        ROOT / "examples" / f"{point}.toml",
        ["control.T_s_us=5", "sensing.comparators=sampled"],
    )
    sharing = [name for name in CONTENDERS if name.startswith("sharing")]
    out = compare(drive, ["edge_mpc", "ditc", *sharing], f_switch=19.6e3, octaves=())
    best, ditc, *others = (entry.kpis for entry in out.entries)
    assert 19.2e3 < best.f_switch <= 20e3

    def at_equal_frequency(figure, k):
        return figure * min(k.f_switch / best.f_switch, 1)

    assert best.torque_ripple_rms < 0.004
    assert best.i_rms < 1.002 * out.bound.i_rms
    assert best.torque_ripple_rms < at_equal_frequency(ditc.torque_ripple_rms, ditc) / 2
    assert best.torque_error_rms < at_equal_frequency(ditc.torque_error_rms, ditc) / 2
    assert len(others) == 5
    for other in others:
        assert best.torque_ripple_rms < at_equal_frequency(other.torque_ripple_rms, other) / 3
        assert best.torque_error_rms < at_equal_frequency(other.torque_error_rms, other) / 3
        assert best.i_rms / best.tau_mean < 1.001 * other.i_rms / other.tau_mean


def test_a_law_that_does_not_suit_the_machine_is_told_and_not_hidden():
    two_phases = ["machine.N_s=4", "machine.N_r=2", "machine.n_phases=2"]
    drive = rl.load(RATED, two_phases)
    out = compare(drive, ["deadbeat"], f_switch=5e3, octaves=(), processes=1)
    (entry,) = out.entries
    assert entry.kpis is None and not entry.met
    assert "shares torque" in entry.note and entry.note in markdown(out)


def test_speed_ripple_of_a_sinusoidal_torque_is_its_amplitude_over_inertia_and_frequency(rated):
    result = rl.simulate(rated, until=0.02, record=1e-4)
    t = np.linspace(0, 0.4, 40001)
    omega, amplitude = 2 * np.pi * 300, 3.0
    start = 30.0 * (t < 0.2 - 1e-9)  # the first half does not count
    made = replace(result, t=t, tau=40 + amplitude * np.sin(omega * t) + start)
    expected = 2 * amplitude / (rated.J * omega) / result.kpis.speed_mean
    assert torque_to_speed_ripple(made) == pytest.approx(expected, rel=1e-4)


def test_speed_ripple_of_few_samples_is_that_of_their_trapezoids(rated):
    """The impulse 0, 1, 2, 2, 2, 2 less its line 0, 0.4, ... 2 is 1.2 N m s at most."""
    result = rl.simulate(rated, until=0.02, record=1e-4)
    t, tau = np.arange(11.0), np.array([9.0] * 5 + [0, 2, 0, 0, 0, 0])
    found = torque_to_speed_ripple(replace(result, t=t, tau=tau))
    assert found == pytest.approx(1.2 / rated.J / result.kpis.speed_mean, rel=1e-9)


def test_a_drive_with_a_speed_loop_is_compared_at_its_equilibrium():
    point = operating_point(rl.load(ROOT / "examples" / "paper_pump.toml"))
    omega = 1500 * np.pi / 30
    assert point.load.kind == "locked"
    assert point.load.speed_rpm == pytest.approx(1500)
    assert point.reference.tau_Nm == pytest.approx(0.0015 * omega**2 + 0.02 * omega)


@pytest.mark.parametrize(
    ("text", "value"), [("20kHz", 20e3), ("20 kHz", 20e3), ("15000", 15e3), ("2e4 Hz", 2e4)]
)
def test_frequencies_are_read_as_people_write_them(text, value):
    assert hertz(text) == value


@pytest.mark.parametrize("text", ["", "fast", "-3kHz", "0", "nan", "inf", "3MHz"])
def test_other_frequencies_are_refused(text):
    with pytest.raises(ParameterError, match="frequency"):
        hertz(text)


@pytest.mark.parametrize(
    ("override", "says"),
    [
        ("load.speed_rpm=0", "standstill"),
        ("reference.tau_Nm=-5", "need > 0"),
    ],
)
def test_a_drive_without_a_point_to_compare_at_is_refused(override, says):
    with pytest.raises(ParameterError, match=says):
        operating_point(rl.load(RATED, [override]))


def test_a_frequency_without_its_unit_is_refused(rated):
    with pytest.raises(ParameterError, match="100 Hz here; is a unit missing"):
        compare(rated, FAST, f_switch=20.0)


def test_files_are_whole_and_the_command_prints_what_they_hold(found, tmp_path):
    files = write(found, tmp_path / "new")
    assert [f.name for f in files] == ["compare.csv", "compare.json", "compare.md", "compare.png"]
    tree = json.loads(files[1].read_text())
    assert [r["control"] for r in tree["controls"]] == FAST
    assert tree["conditions"]["T_s_us"] == 5
    header, *rows = files[0].read_text().splitlines()
    assert len(rows) == 2 and "torque_ripple_pp" in header
    assert "| `deadbeat` |" in files[2].read_text()


def test_the_command_line_compares():
    given = ("--controls", "deadbeat", "--at-switching-frequency", "5kHz", "--json")
    done = command("compare", RATED, *given)
    assert (done.code, done.error) == (0, "")
    (record,) = json.loads(done.out)["controls"]
    assert record["met"] and record["f_switch_Hz"] == pytest.approx(5e3, rel=TOLERANCE)
    assert "did you mean `deadbeat`" in refused("compare", RATED, "--controls", "deadbeet")


def commands(drive, samples):
    """What the drive's law orders at a sequence of measurements."""
    controller = drive.controller()
    return [
        _core.step(
            controller,
            _core.Measurement(i=row[:3], theta_e=row[3], omega_m=row[4], u_dc=row[5]),
            40.0,
        )
        for row in samples
    ]


@pytest.fixture(scope="module")
def samples():
    """Currents, angles and speeds as of a turning drive, none of them from a plant."""
    rng = np.random.default_rng(4)
    n = 200
    i = rng.uniform(0, 120, (n, 3)) * (rng.random((n, 3)) < 0.7)
    theta = np.mod(np.cumsum(rng.uniform(0, 0.2, n)), 2 * np.pi)
    return np.column_stack([i, theta, rng.uniform(140, 170, n), rng.uniform(220, 260, n)]).tolist()


def unlike_in_the_plant_only(point):
    """The same to the control: only what it is not told differs. Factors of two are exact."""
    m = point.machine
    halved = {k: getattr(m, k) / 2 for k in ("R_ohm", "L_u_H", "L_a_H", "L_sat_H", "psi_m_Wb")}
    changed = {"J_kgm2": 3 * m.J_kgm2, "B_Nms": 5 * m.B_Nms + 0.1}
    return replace(
        point,
        machine=m.model_copy(update={**halved, **changed}),
        mismatch=point.mismatch.model_copy(update={"R_factor": 2.0, "flux_factor": 2.0}),
        converter=point.converter.model_copy(update={"v_switch_V": 2.0, "v_diode_V": 1.5}),
        load=point.load.model_copy(update={"J_kgm2": 0.1}),
        simulation=point.simulation.model_copy(update={"theta_start_deg": 33.0}),
    )


@pytest.mark.parametrize("name", CONTENDERS)
def test_no_law_knows_more_of_the_plant_than_its_measurements(rated, samples, name):
    point = operating_point(rated)
    one = CONTENDERS[name].drive(point, {})
    other = CONTENDERS[name].drive(unlike_in_the_plant_only(point), {})
    ordered = commands(one, samples)
    assert commands(other, samples) == ordered
    tau = [rl.simulate(d, until=0.02, record=None).kpis.tau_mean for d in (one, other)]
    assert abs(tau[0] - tau[1]) > 0.01 * tau[0]  # the plants do differ
    its_own = point.mismatch.model_copy(update={"flux_factor": 1.1})
    informed = CONTENDERS[name].drive(replace(point, mismatch=its_own), {})
    assert commands(informed, samples) != ordered  # and what it is told, it uses


def test_control_headers_include_nothing_of_plant_or_simulation():
    headers = sorted((ROOT / "include" / "srm" / "control").rglob("*.hpp"))
    assert len(headers) > 10
    for header in headers:
        for folder in re.findall(r'#include "srm/(\w+)/', header.read_text()):
            assert folder in ("base", "machine", "control"), header.name


def most_torque(drive: rl.Drive, omega: float) -> float:
    """Greatest mean of pulses with all their ripple [N m]: at 3000 rpm 1.7 times the limit
    without."""
    on, off = np.meshgrid(np.radians(np.arange(-120, 90, 15)), np.radians(np.arange(90, 240, 15)))
    i = drive.machine.i_max_A * np.linspace(0, 1, 13)[1:]
    ends = on.ravel()[:, None], off.ravel()[:, None]
    law = chopped(replace(drive.known(), omega_m=omega), 3.0, brakes=False, hard=False)
    return float(pulses(law, *ends, i[None, :]).tau.max())


@pytest.mark.long
def test_the_table_of_laws_over_speed_is_current():
    """Tuned anew, at every speed: a guide is one for all of them."""
    with (ROOT / "docs" / "control" / "speed_range.csv").open() as file:
        kept = [row for row in csv.DictReader(file) if row["control"] in ("limit", "edge_mpc")]
    found = speed_range.study(speed_range.PARTS, ["edge_mpc"], speed_range.BUDGET)
    for row, stored in zip(found, kept, strict=True):
        for key, within in (("i_rms_A", 0.01), ("torque_capability_Nm", 0.01)):
            assert getattr(row, key) == pytest.approx(float(stored[key]), rel=within), stored
        error = pytest.approx(float(stored["torque_error_rms"]), rel=0.1, abs=1e-4)
        assert row.torque_error_rms == error, stored


@pytest.mark.long
def test_laws_over_speed_stay_within_the_limit(tmp_path):
    done = subprocess.run(
        [sys.executable, ROOT / "studies" / "speed_range.py", "--quick", "--out", tmp_path],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    with (tmp_path / "speed_range.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert (tmp_path / "speed_range.png").stat().st_size > 10_000
    by_speed = {}
    for row in rows:
        by_speed.setdefault(float(row["speed_rpm"]), {})[row["control"]] = row
    assert list(by_speed) == [1500, 3000]
    drive = rl.load(RATED)
    with_ripple = {rpm: most_torque(drive, rpm * np.pi / 30) for rpm in by_speed}
    for at in by_speed.values():
        for control in FAST:
            assert float(at[control]["torque_error_rms"]) > float(at["limit"]["torque_error_rms"])
            capability = float(at[control]["torque_capability_Nm"])
            assert 0 < capability < 1.05 * with_ripple[float(at[control]["speed_rpm"])]


@pytest.mark.parametrize(
    ("ran_out", "off", "told"),
    [
        (True, -1.0, "switches at most 7.5 kHz here"),
        (True, 1.0, "switches at least 7.5 kHz here"),
        (False, 1.0, "its frequency jumps over the target; the nearest is 7.5 kHz"),
    ],
)
def test_why_a_frequency_is_not_met_is_told_in_kilohertz(ran_out, off, told):
    target = SimpleNamespace(off=lambda figures: off)
    tuner = SimpleNamespace(ran_out=ran_out, target=target)
    assert _miss(tuner, SimpleNamespace(figures={"f_switch_Hz": 7500.0})) == told
