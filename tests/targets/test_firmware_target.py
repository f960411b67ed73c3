"""Exported firmware on the emulated Cortex-M: parity, protection, cost, processor in the loop."""

import json
import os
import re
import subprocess
import sys
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from firmware_tools import ROOT, drive, each_drive, needs_target

import reluctance as rl
from reluctance._core import ORDER_COLUMNS
from reluctance.drive.guard.trip_levels import protection
from reluctance.targets.export import firmware
from reluctance.targets.export.cost import cost, sizes
from reluctance.targets.export.parity import check_parity, in_the_loop, parity
from reluctance.targets.export.recording import record
from reluctance.targets.export.target import build, processor_in_the_loop, replay

pytestmark = needs_target

STEPS = 20_000
REQUIRED = ["angles", "sharing", "ditc", "paper_mpc", "finite_set_1", "finite_set_2"]
ALLOWED = {"memcpy", "memmove", "memset"}  # what any C library and any startup file has
BUDGET = tomllib.loads((ROOT / "firmware" / "budget.toml").read_text())


@pytest.fixture(scope="module")
def packages(tmp_path_factory):
    """Folder and recording of a drive, made once."""
    made = {}

    def package(name):
        if name not in made:
            folder = firmware(drive(name), tmp_path_factory.mktemp(name) / "package").folder
            made[name] = folder, record(drive(name), steps=STEPS)
        return made[name]

    return package


@each_drive
def test_target_and_desk_agree_in_every_bit_within_the_budget(name, packages):
    folder, recording = packages(name)
    spent = cost(drive(name), "cortex-m7", recording, folder)
    assert spent.steps == STEPS
    assert spent.bit_exact
    limit = BUDGET[name]
    assert spent.instructions_max <= limit["instructions_max"]
    assert spent.text <= limit["text_B"]
    assert spent.stack <= limit["stack_B"] <= 2048
    assert spent.data == 0
    assert set(spent.outside) <= ALLOWED


@pytest.mark.long
@pytest.mark.parametrize("name", REQUIRED)
def test_parity_holds_on_the_smaller_core_and_no_step_trips(name, packages):
    folder, recording = packages(name)
    program = build(folder, "cortex-m4")
    found = parity(program, "cortex-m4", recording)
    assert (found.steps, found.different) == (STEPS, 0)
    assert not found.answers.status.any()
    made = (folder / "parameters.hpp").read_text()
    assert f"fingerprint = 0x{found.answers.fingerprint:08X}" in made


def test_no_double_and_no_call_but_the_allowed_ones_in_the_object(packages):
    folder, _ = packages("paper_mpc")
    build(folder, "cortex-m4")  # single-precision unit: a double would be a call
    code = subprocess.run(
        ["arm-none-eabi-objdump", "-dr", "build/cortex-m4/controller.o"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert not re.search(r"\tvfn?m[as]\.", code)  # fused: one rounding where the desk has two
    assert "\tvmul.f32" in code
    assert "__aeabi" not in code and ".f64" not in code
    stacks = (folder / "build" / "cortex-m4" / "controller.su").read_text().splitlines()
    assert all(line.endswith("static") for line in stacks)


def test_a_fault_takes_no_more_instructions_than_the_run_before_it(packages):
    folder, recording = packages("deadbeat_diagnosis")
    samples = faulty(recording.samples, 9000, u_dc=1e4)
    found = replay(build(folder, "cortex-m7"), "cortex-m7", samples)
    assert_safe_from(found, 9000, 3)
    assert found.run[9000:].max() <= found.run[:9000].max()


@pytest.mark.parametrize("file", ["docs/firmware.md", "firmware/package/board.h"])
def test_commissioning_takes_the_flash_that_is_told(file, packages):
    folder, _ = packages("paper_mpc")
    build(folder, "cortex-m4")
    text, constants, _ = sizes(folder / "build" / "cortex-m4" / "commission.o")
    told = re.search(r"takes? (\d+) KB of flash", (ROOT / file).read_text())
    assert int(told[1]) == round((text + constants) / 1024)


def faulty(samples, n, **columns):
    """The recording with other readings from step n on; `i2` is the current of phase 2."""
    changed = samples.copy()
    place = {"theta_e": -5, "omega_m": -4, "u_dc": -3, "reference": -1}
    for name, value in columns.items():
        changed[n:, place[name] if name in place else int(name[1:])] = value
    return changed


def conducting(samples, n):
    """The phase with most current at step n."""
    return int(np.argmax(samples[n, : samples.shape[1] - 5]))


def assert_safe_from(answers, n, status):
    """All legs off in the step of the fault and in every later one; the cause is latched."""
    assert not answers.status[:n].any()
    assert (answers.status[n:] == status).all()
    phases = answers.commands[n:, :-1].reshape(len(answers.status) - n, -1, len(ORDER_COLUMNS))
    columns = dict(zip(ORDER_COLUMNS, np.moveaxis(phases, 2, 0), strict=True))
    assert (columns["gate"] == 1).all()  # timer
    assert all((columns[f"leg_{n}"] == -1).all() for n in range(5))  # demagnetize


FAULTS = {  # name: (status, the readings from the fault on, of samples, step and trip levels)
    "NaN current": (1, lambda s, n, at: {f"i{conducting(s, n)}": np.nan}),
    "infinite reference": (1, lambda s, n, at: {"reference": np.inf}),
    "10 x current": (2, lambda s, n, at: {f"i{conducting(s, n)}": 10 * s[n].max()}),
    "over-voltage": (3, lambda s, n, at: {"u_dc": 1.01 * at.levels.u_dc_max}),
    "under-voltage": (4, lambda s, n, at: {"u_dc": 0.99 * at.levels.u_dc_min}),
    "over-speed": (5, lambda s, n, at: {"omega_m": -1.01 * at.levels.omega_max}),
    "negative current": (6, lambda s, n, at: {f"i{conducting(s, n)}": -1.01 * at.i_zero}),
    "angle past a turn": (6, lambda s, n, at: {"theta_e": 6.3}),
    "stuck angle": (7, lambda s, n, at: {"theta_e": s[n - 1, -5]}),
    "dead current sensor": (8, lambda s, n, at: {f"i{conducting(s, n)}": 0.0}),
}


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("name", ["sharing", "paper_mpc_map"])
def test_a_fault_ends_in_the_safe_state_within_one_control_period(name, fault, packages):
    folder, recording = packages(name)
    program = build(folder, "cortex-m7")
    status, readings = FAULTS[fault]
    samples, n = recording.samples[:700], 600
    changed = faulty(samples, n, **readings(samples, n, protection(drive(name))))
    assert_safe_from(replay(program, "cortex-m7", changed), n, status)


@pytest.mark.parametrize(
    "name, late",
    [
        ("angles", 1),  # a sample in which an edge may come tells nothing
        ("sharing", 1),
        ("ditc", 1),
        ("deadbeat", 1),
        ("finite_set_1", 1),
        ("paper_mpc", 0),  # its references start below i_zero, and tell of the sensor already
    ],
)
def test_a_sensor_that_is_dead_from_the_start_is_found_once_current_flows(name, late, packages):
    """Phase 1 reads zero throughout, while its true current is that of the recording."""
    folder, recording = packages(name)
    program = build(folder, "cortex-m7")
    samples = recording.samples[:4000].copy()
    samples[:, 1] = 0
    answers = replay(program, "cortex-m7", samples)
    assert answers.status[-1] == 8
    found = int(np.flatnonzero(answers.status)[0])
    true = recording.samples[:, 1]
    flows, passed = (int(np.flatnonzero(true > i)[0]) for i in (0, protection(drive(name)).i_zero))
    assert flows <= found <= passed + late


def test_healthy_recordings_with_real_sensors_never_trip(tmp_path):
    sensing = ["sensing.adc_bits=12", "sensing.i_range_A=250.0", "sensing.encoder_counts=4096"]
    noisy = rl.load(ROOT / "examples" / "paper_rated.toml", [*sensing, "sensing.delay_samples=1"])
    program = build(firmware(noisy, tmp_path / "package").folder, "cortex-m7")
    found = parity(program, "cortex-m7", record(noisy, steps=10_000))
    assert not found.answers.status.any()
    assert found.exact
    samples = record(noisy, steps=2000).samples
    stuck = faulty(samples, 1500, theta_e=samples[1499, -5])
    guard = protection(noisy)
    turn = 4 * 50 * np.pi * noisy.control.T_s  # of a sample at 1500 rpm, electrical [rad]
    late = int(np.ceil((3 * guard.levels.angle_slack + guard.advance.bend) / turn))
    assert 2 <= late <= guard.advance.parts * guard.advance.block
    answers = replay(program, "cortex-m7", stuck)
    found = int(np.flatnonzero(answers.status)[0])
    assert 1500 <= found <= 1500 + late + guard.advance.block
    assert_safe_from(answers, found, 7)


@pytest.mark.parametrize("compare", [check_parity, in_the_loop])
def test_a_drive_with_faults_is_not_compared_with_a_desk_that_has_no_protection(compare):
    broken = drive("deadbeat").with_values({"faults": [{"kind": "open_wire"}]})
    with pytest.raises(rl.ParameterError, match=r"\[\[faults\]\] has no form in a comparison of"):
        compare(broken)


def test_a_target_that_stops_is_told_and_nothing_waits_for_it(packages):
    folder, _ = packages("ditc")
    program = build(folder, "cortex-m7")
    broken = program.with_name("broken.elf")
    broken.write_bytes(b"no program")
    with (
        pytest.raises(rl.ParameterError, match="stopped before the simulation did"),
        processor_in_the_loop(broken, "cortex-m7", n_phases=3),
    ):
        pass


@pytest.mark.parametrize("name", ["paper_mpc", "paper_mpc_speed_loop", "angles"])
def test_processor_in_the_loop_gives_the_key_figures_of_the_simulation(name):
    target, desk = in_the_loop(drive(name), until=0.04)
    assert desk.tau_mean > 1
    assert replace(target, wall_s_per_sim_s=0) == replace(desk, wall_s_per_sim_s=0)


def test_the_target_takes_the_same_energy_from_a_cloudy_array():
    target, desk = in_the_loop(drive("sun_cloud"), until=0.2)
    assert desk.p_source > 5000
    assert replace(target, wall_s_per_sim_s=0) == replace(desk, wall_s_per_sim_s=0)


def test_the_folder_builds_in_an_empty_place_away_from_the_repository(tmp_path):
    away = firmware(drive("sharing"), tmp_path / "away").folder
    alone = {"PATH": os.environ["PATH"], "HOME": str(tmp_path)}
    subprocess.run(["make", "-s", "all", "replay"], cwd=away, env=alone, check=True)
    for source, compiler in (("main.c", "gcc"), ("controller.cpp", "g++")):  # any compiler
        standard = "-std=c99" if compiler == "gcc" else "-std=c++20"
        flags = [standard, "-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-Werror"]
        subprocess.run(
            [compiler, *flags, "-I.", "-Iinclude", "-c", source, "-o", os.devnull],
            cwd=away,
            env=alone,
            check=True,
        )


def test_the_command_line_tells_parity_and_refuses_an_unknown_processor():
    def run(*arguments):
        return subprocess.run(
            [sys.executable, "-m", "reluctance", "export", "parity", *arguments],
            capture_output=True,
            text=True,
            timeout=120,
        )

    file = str(ROOT / "examples" / "ditc.toml")
    done = run(file, "--steps", "500", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(done.stdout) == {"steps": 500, "different": 0, "cpu": "cortex-m7"}
    refused = run(file, "--cpu", "cortex-m3")
    assert refused.returncode == 2
    assert "need one of: cortex-m4, cortex-m7" in refused.stderr
