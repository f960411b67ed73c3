"""Limits of the converter against what happens in the whole run, the start and braking included."""

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from command import command

import reluctance as rl

BRAKING = """machine = "generic_1hp_8_6"
[converter]
u_dc_V = 300
u_rating_V = 330
[source]
kind = "battery"
R_ohm = 0.1
C_uF = 2000
one_way = true
[load]
kind = "torque"
tau_Nm = 0.0
J_kgm2 = 0.01
speed_rpm = 1500
[reference]
kind = "torque"
t_s = [0, 0.1, 0.1, 0.25, 0.25, 1.0]
values = [-2, -2, 2, 2, 0.3, 0.3]
[control]
law = "pwm_current"
T_s_us = 50
[protection]
speed_max_rpm = 1400
[simulation]
until_s = 0.8
"""
LOW_INDUCTANCE = """[machine]
name = "low inductance"
source = "of this test"
licence = "Apache-2.0"
model = "lehuy"
N_s = 6
N_r = 4
n_phases = 3
R_ohm = 0.05
i_max_A = 40
J_kgm2 = 0.001
L_u_H = 30e-6
L_a_H = 200e-6
L_sat_H = 29e-6
i_m_A = 200
psi_m_Wb = 13.06e-3
[converter]
u_dc_V = 48
[load]
kind = "locked"
speed_rpm = 200
[reference]
kind = "none"
[control]
law = "angles"
T_s_us = 50
theta_on_deg = 10
theta_off_deg = 150
i_ref_A = 20
i_band_A = 0.5
[sensing]
comparators = "sampled"
[simulation]
until_s = 0.1
"""


def written(folder: Path, text: str) -> Path:
    (folder / "drive.toml").write_text(text)
    return folder / "drive.toml"


def test_the_greatest_bus_voltage_of_braking_is_told_against_what_the_switches_stand(
    tmp_path: Path,
) -> None:
    """By energy: C/2 (u^2 - 300^2) = J/2 (w0^2 - w1^2) less the copper loss gives 340.4 V."""
    file = written(tmp_path, BRAKING)
    done = command("run", file, "--json")
    assert json.loads(done.out)["u_dc_peak_run_V"] == pytest.approx(340.4, abs=0.3)
    told = command("run", file).out
    assert "note: the dc link reaches 340.5 V in the run" in told and "u_rating_V = 330" in told
    assert "above [protection] speed_max_rpm = 1400" in told and "340.5 V at the dc link" in told
    assert "u_rating_V" not in command("run", file, "--set", "converter.u_rating_V=345").out


def test_the_greatest_figures_of_a_run_are_those_of_its_waveforms(tmp_path: Path) -> None:
    result = rl.simulate(rl.load(written(tmp_path, BRAKING)))
    k = result.kpis
    assert k.i_peak_run == pytest.approx(result.i.max()) and k.i_peak_run > 3 * k.i_peak
    assert k.u_dc_peak_run == pytest.approx(result.u_dc.max())
    assert k.speed_peak_run == pytest.approx(np.abs(result.omega_m).max())


def test_a_current_above_its_limit_is_told(tmp_path: Path) -> None:
    """48 V over 50 us and 30 uH are 80 A, less the drop and the inductance that rises."""
    file = written(tmp_path, LOW_INDUCTANCE)
    told = command("run", file).out
    assert (
        "peak current of the run, 74.97 A, is above [machine] i_max_A = 40, and above the" in told
    )
    for remedy in ("control.T_s_us=5", "sensing.comparators=analog"):  # as the note proposes
        assert "note: the peak" not in command("run", file, "--set", remedy).out


def test_a_current_above_a_trip_level_that_is_below_the_limit_is_told(tmp_path: Path) -> None:
    file = written(tmp_path, LOW_INDUCTANCE)
    analog = ("--set", "sensing.comparators=analog")
    told = command("run", file, *analog, "--set", "protection.i_trip_A=15").out
    assert "note: the peak current of the run, 20.5 A, is above [protection] i_trip_A = 15" in told
    assert "note: the peak" not in command("run", file, *analog).out


OWN_LAW = """import reluctance as rl
class Greedy(rl.Law):
    def step(self, y, tau_ref):
        return [rl.Order.regulate(60.0, 0.5) for _ in y.i]
"""


def test_a_current_that_an_own_law_asks_for_is_not_put_down_to_the_control_period(
    tmp_path: Path,
) -> None:
    (tmp_path / "own.py").write_text(OWN_LAW)
    text = LOW_INDUCTANCE.partition("[reference]")[0]
    text += '[reference]\nkind = "torque"\ntau_Nm = 0.1\n'
    file = written(tmp_path, text + '[control]\nlaw = "python:own.py:Greedy"\nT_s_us = 50\n')
    told = command("run", file, "--trust", "--until", "0.02").out
    assert "keep the currents that your law asks for below i_max_A" in told
    assert "control period or" not in told
    given = ("--set", "control.gain=nan")
    said = command("run", file, "--trust", *given).error
    assert "[control] gain = nan, need finite numbers" in said


def test_a_current_that_nothing_bounds_is_not_put_down_to_the_control_period(
    tmp_path: Path,
) -> None:
    text = LOW_INDUCTANCE.replace("i_ref_A = 20\ni_band_A = 0.5\n", 'regulate = "none"\n')
    file = written(tmp_path, text.replace('"sampled"', '"analog"'))
    told = command("run", file, "--until", "0.03").out
    assert "a pulse ends at theta_off_deg alone; turn off earlier, or regulate" in told
    assert "control period or" not in told and "a shorter control period" not in told


def test_a_source_that_is_too_weak_is_told_while_the_capacitor_gives(tmp_path: Path) -> None:
    """300 V behind 100 ohm give 225 W at most."""
    text = BRAKING.partition("[load]")[0].replace("R_ohm = 0.1", "R_ohm = 100")
    text += '[load]\nkind = "locked"\nspeed_rpm = 1500\n'
    text += (
        '[reference]\nkind = "torque"\ntau_Nm = 2\n[control]\nlaw = "pwm_current"\nT_s_us = 50\n'
    )
    file = written(tmp_path, text)
    done = command("run", file, "--until", "0.1", "--json")
    figures = json.loads(done.out)
    assert figures["p_source_W"] < figures["p_in_W"] / 2
    assert "note: the capacitor of the dc link gives " in done.error
    low, high = figures["u_dc_min_V"], figures["u_dc_max_V"]
    assert high - low > 10 and f"({low:.4g} to {high:.4g} V)" in done.error
    stiff = command("run", file, "--until", "0.1", "--set", "source.R_ohm=0.1").error
    assert "capacitor" not in stiff


def test_a_course_that_goes_on_after_the_run_is_told(tmp_path: Path) -> None:
    file = written(tmp_path, BRAKING)
    told = command("run", file, "--until", "0.05").out
    assert "note: the course of [reference] goes on to 1 s, the run ends at 0.05 s" in told
    assert "goes on to" not in command("run", file).out


def test_a_step_of_the_current_converter_that_is_too_coarse_is_told(tmp_path: Path) -> None:
    """A range in mA: 20 000 A over 4096 steps are 4.88 A, an eighth of 40 A."""
    file = written(tmp_path, LOW_INDUCTANCE.replace("[sensing]", "[sensing]\nadc_bits = 12"))
    ranges = {n: ("--set", f"sensing.i_range_A={n}") for n in (60, 4000, 20000)}
    told = {n: command("run", file, "--until", "0.02", *given).out for n, given in ranges.items()}
    note = "note: a step of the current converter is "
    assert f"{note}4.88 A, 12% of i_max_A = 40: check the unit of [sensing]" in told[20000]
    assert note not in told[60] and note not in told[4000]


def test_notes_go_to_standard_error_beside_one_json_object(tmp_path: Path) -> None:
    file = written(tmp_path, LOW_INDUCTANCE)
    plain, beside = command("run", file), command("run", file, "--json")
    notes = [line for line in plain.out.splitlines() if line.startswith("note: ")]
    assert notes and beside.error.splitlines() == notes
    assert "note" not in beside.out and json.loads(beside.out)["i_peak_run_A"] > 40


@pytest.mark.parametrize(("min_us", "dead_us"), [(1, 0), (1, 2), (2, 2), (3, 2)])
def test_no_switch_is_on_for_less_than_the_minimum_pulse_behind_its_dead_time(
    tmp_path: Path, min_us: float, dead_us: float
) -> None:
    text = BRAKING.partition("[source]")[0].replace("u_rating_V = 330", f"dead_time_us = {dead_us}")
    text += f"min_pulse_us = {min_us}\n"
    text += '[load]\nkind = "locked"\nspeed_rpm = 60\n[reference]\nkind = "none"\n'
    text += '[control]\nlaw = "pwm_current"\nT_s_us = 50\ntheta_on_deg = 20\ntheta_off_deg = 150\n'
    result = rl.simulate(rl.load(written(tmp_path, text + "i_ref_A = 0.8\n")), until=0.2)
    on = result.u[0] > 150
    edges = np.flatnonzero(np.diff(on.astype(int)))
    lengths = [result.t[b + 1] - result.t[a + 1] for a, b in pairwise(edges)]
    pulses = [x for x, a in zip(lengths, edges, strict=False) if on[a + 1]]
    assert len(pulses) > 100
    assert min(pulses) == pytest.approx(1e-6 * min_us, rel=1e-6)
