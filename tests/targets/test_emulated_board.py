"""The emulated board: the package's own program on the emulated microcontroller, in a closed loop
with a simulated bench. tests/support/emulated_board.py has the walk through all steps."""

import csv
import ctypes
import json
import re
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from command import command, refused
from emulated_board import (
    COUNTS,
    MACHINES,
    blocks,
    commands,
    drive_file,
    run,
    walk,
    zero_error,
)
from firmware_tools import ROOT, needs_target
from on_the_bench import bench_drive

import reluctance as rl
from reluctance.base.toolchain import build
from reluctance.cli.emulate import _hint
from reluctance.machine.held_pulses import read_held_pulses
from reluctance.machine.maps import write_map
from reluctance.targets.commission import Held, Wires, commission, emulated, read_wires, steps
from reluctance.targets.commission.board import ORDER, Board
from reluctance.targets.commission.wiring import Wiring, read_wiring, write_wiring
from reluctance.targets.export import firmware
from reluctance.targets.export.target import answering

STRAIGHT = Wiring((0, 1, 2), (0, 1, 2), (1, 1, 1))
CROSSED = Wires(phase=(0, 2, 1), sensor=(1, 0, 2), sign=(1, -1, 1), direction=-1, zero_deg=70.0)


def stored():
    with (ROOT / "bench" / "emulated_board.csv").open() as file:
        return {row["machine"]: row for row in csv.DictReader(file)}


@pytest.mark.parametrize("machine", MACHINES)
def test_the_stored_walks_keep_the_bounds(machine):
    row = {key: float(value) for key, value in stored()[machine].items() if key != "machine"}
    assert row["noise_LSB"] == 8
    assert row["torque_error_pct"] < 2
    assert row["zero_error_counts"] < 1
    assert abs(row["R_error_pct"]) < 0.5
    spin = row["spin_rpm"] / row["speed_limit_rpm"]
    assert 0.8 < spin < 1.001  # what is limited is the speed that the board has found
    assert row["trips"] == 4


@needs_target
@pytest.mark.long
def test_the_readme_leads_from_the_first_power_up_to_a_turning_rotor(tmp_path):
    """Its commands as printed; the board's wires are crossed and its encoder counts backwards."""
    walked, said = walk("paper_6_4", tmp_path)
    assert walked.torque_error_pct < 2
    assert walked.zero_error_counts < 1
    for key, value in asdict(walked).items():
        if key != "machine":
            assert value == pytest.approx(float(stored()["paper_6_4"][key]), rel=1e-3, abs=2e-3)
    for step in ("wiring", "alignment"):  # the second time
        assert "as it must be" in said[step]
    states = ["precharge", "calibrate", "ready"]
    assert [line.split()[-1] for line in said["precharge"].splitlines()[:3]] == states
    offset = [float(x) for x in said["precharge"].splitlines()[3].split(":")[1].split(",")]
    assert offset == pytest.approx([-1.0, -1.5, 0.4], abs=0.08)  # of phases 1, 0, 2; one reversed


@pytest.fixture
def coupled(tmp_path, monkeypatch):
    """A drive whose phases couple and its package, which is the current folder; its README."""
    (tmp_path / "DRIVE.toml").write_text((ROOT / "examples" / "coupled_phases.toml").read_text())
    drive = rl.load(tmp_path / "DRIVE.toml")
    monkeypatch.chdir(firmware(drive, tmp_path / "package").folder)
    return drive, Path("README.md").read_text().replace("DRIVE.toml", "../DRIVE.toml")


def test_the_commands_of_the_readme_carry_the_pairs_of_a_drive_into_the_measured_package(coupled):
    """A pulse ends some per cent above the greatest current, and so does the map."""
    drive, readme = coupled
    table = drive.machine.table
    write_map(replace(table, i=1.02 * table.i), Path("map.csv"))
    said = [
        command(*line.split()[1:])
        for line in commands(readme)
        if line.startswith(("reluctance map import", "reluctance export"))
    ]
    assert [one.code for one in said] == [0, 0], said
    assert "EdgeMpc<srm::WithPairs<srm::FluxMap<float> >" in said[1].out
    found = rl.load("../DRIVE.toml", ["machine=motor.toml"]).machine
    assert found.i_max_A == drive.machine.i_max_A
    i, theta_e = np.array([7.0, 0.0, 4.0]), np.linspace(0, 6, 9)
    torque = drive.machine.coupling.tau(i, theta_e)
    assert found.coupling.tau(i, theta_e) == pytest.approx(torque, abs=1e-6 * np.abs(torque).max())


@needs_target
@pytest.mark.long
def test_the_commands_of_the_readme_measure_the_factor_of_the_pairs(coupled):
    _, readme = coupled
    loop = blocks(readme, "sh")[1].replace("$BOARD", "--drive ../DRIVE.toml")
    said = run(loop, Path())
    assert float(re.search(r"next: pair_factor = (\S+)", said)[1]) == pytest.approx(1, abs=0.01)


@needs_target
def test_a_map_of_one_phase_that_couples_with_others_says_where_the_pairs_come_from(coupled):
    asked = ["pulses", "--angles", "2", "--pulses", "1", "--drive", "../DRIVE.toml"]
    for beside in ([], ["--held", "2", "--held_A", "3"]):
        said = command("emulate", ".", *asked, *beside, "--out", "p.csv").out
        assert ("takes the pairs over" in said) is (not beside)


def test_an_export_that_loses_the_pairs_of_the_drive_says_so(coupled):
    drive_file = ("export", "firmware", "../DRIVE.toml", "--set", "sensing.i_range_A=100")
    for machine, lost in (("onelab_6_4", True), ("onelab_6_4_pairs", False), ("own_12_8", False)):
        done = command(*drive_file, "--set", f"machine={machine}", "--out", machine, "--json")
        assert done.code == 0, done.error
        warnings = json.loads(done.out).get("warnings", [])
        assert any("knows no pairs" in line for line in warnings) is lost


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    return rl.load(drive_file("paper_6_4", tmp_path_factory.mktemp("drive")))


@pytest.fixture(scope="module")
def package(drive, tmp_path_factory):
    return firmware(drive, tmp_path_factory.mktemp("board") / "package").folder


@pytest.fixture
def uncorrected(package):
    write_wiring(package, STRAIGHT)
    return package


def on_the_desk(package, library):
    """The same C and C++ as a library of this computer, in the place of the target."""
    sources = ["main.c", "emulated/timer.c", "emulated/board.c", "controller.cpp", "commission.cpp"]
    flags = ("-O1", "-I.", "-Iinclude")
    desk = ctypes.CDLL(str(build(sources, library, flags, folder=package, what="the package")))
    desk.bench_start()

    def answer(record, size):
        told = ctypes.create_string_buffer(size)
        desk.bench_period(record, told)
        return told.raw

    return answer


def kept(answer, all_answers):
    """Keeps the answers without the byte of an order that has no meaning."""

    def told(record, size):
        given = answer(record, size)
        kept_bytes = bytearray(given)
        for k in range(3):
            kept_bytes[k * ORDER.size + 7] = 0
        all_answers.append(bytes(kept_bytes))
        return given

    return told


@needs_target
@pytest.mark.parametrize(
    ("commissions", "held", "until"),
    [(True, None, 0.25), (True, Held(2, 20.0), 0.55), (False, None, 0.25)],
    ids=["pulses", "beside a held phase", "first turn"],
)
def test_the_target_and_the_desk_agree_in_every_bit(
    drive, uncorrected, commissions, held, until, tmp_path
):
    """Pulses at a clamped rotor, or the first turn: the loops are closed by each for itself."""
    write_wiring(uncorrected, Wiring((0, 1, 2), (0, 1, 2), (1, 1, 1), 1, 0.3))
    on = emulated(uncorrected, drive, Wires(zero_deg=np.degrees(0.3)))
    answers = {"target": [], "desk": []}
    desk = on_the_desk(uncorrected, tmp_path / "board.so")
    with answering(on.program, on.cpu) as target:
        for side, answer in (("target", target), ("desk", desk)):
            board = Board(
                on,
                kept(answer, answers[side]),
                theta_e_deg=150.0,
                clamped=commissions,
            )
            board.reference = 4.0
            if commissions:
                board.begin("pulses", pulses=2, held=held)
            board.run(until)
            assert "run" in [mode for _, mode in board.modes]
            assert board.fault is None
    assert len(answers["target"]) > 4990
    assert answers["target"] == answers["desk"]
    if commissions:
        assert len(board.rows) > 100
        beside = np.array(board.rows)[:, -1]
        assert beside == pytest.approx(0.0 if held is None else held.i_A, abs=2.0)


@needs_target
def test_pulses_beside_a_held_phase_are_recorded_over_a_period(uncorrected, tmp_path):
    path = drive_file("paper_6_4", tmp_path)
    asked = ["pulses", "--angles", "2", "--pulses", "1", "--held", "1", "--held_A", "20"]
    out = tmp_path / "p.csv"
    said = command("emulate", uncorrected, *asked, "--drive", path, "--out", out).out
    assert f"next: reluctance map identify {out} --R_ohm R --pairs DRIVE.toml" in said
    read = read_held_pulses([out], n_phases=3)
    assert [one.pair for one in read] == ["ab", "ab"]
    turned = np.degrees([one.theta_m for one in read])
    assert turned[1] - turned[0] == pytest.approx(45, abs=0.2)
    for one in read:
        assert one.i_held.mean() == pytest.approx(20, rel=0.02)


@needs_target
def test_pulses_over_a_period_find_the_zero_without_a_turning_rotor(uncorrected, tmp_path):
    """As of a machine whose inductance is flat around alignment. The message leads to a map of the
    same recording, and to the zero of the wires."""
    path = drive_file("paper_6_4", tmp_path)
    (tmp_path / "wires.toml").write_text("zero_deg = 70.0")
    out = tmp_path / "p.csv"
    asked = ["pulses", "--whole-period", "--angles", "12", "--pulses", "2", "--out", out]
    said = command(
        "emulate", uncorrected, *asked, "--drive", path, "--wires", tmp_path / "wires.toml"
    ).out
    assert "add N_r A - 180 degrees to WIRING_ZERO_RAD" in said
    identify = ["map", "identify", out, "--R_ohm", "0.72", "--N_r", "4"]
    told = refused(*identify, "--out", tmp_path / "map.csv")
    aligned = told.partition("(--aligned_at ")[2].partition(")")[0]
    assert (4 * float(aligned) - 180) % 360 == pytest.approx(70, abs=1)
    done = command(*identify, "--aligned_at", aligned, "--out", tmp_path / "map.csv")
    assert done.code == 0 and (tmp_path / "map.csv").exists()


def test_an_alignment_that_fails_does_not_ask_for_itself(uncorrected):
    """It leads to the pulses that find the zero of a machine that is flat there."""
    told = _hint(uncorrected, "alignment")
    assert "was `wiring` done?" in told and "--whole-period" in told
    assert "were `wiring` and `alignment` done?" in _hint(uncorrected, "pulses")
    write_wiring(uncorrected, Wiring((0, 1, 2), (0, 1, 2), (1, 1, -1), 1, 0.3))
    assert "done?" not in _hint(uncorrected, "alignment")
    assert "--whole-period" in _hint(uncorrected, "alignment")
    assert _hint(uncorrected, "pulses") == _hint(uncorrected, "wiring") == ""


@needs_target
def test_what_is_wired_wrongly_is_found_and_corrected(drive, uncorrected):
    on = emulated(uncorrected, drive, CROSSED)
    found = steps.routine(on, "wiring")
    assert (found.sensor, found.sign) == ((1, 2, 0), (-1, 1, 1))
    write_wiring(uncorrected, read_wiring(uncorrected).with_sensors(found.sensor, found.sign))
    found = steps.routine(emulated(uncorrected, drive, CROSSED), "wiring")
    assert (found.sensor, found.sign) == ((0, 1, 2), (1, 1, 1))


@needs_target
def test_a_turning_rotor_goes_on_for_as_long_as_it_is_asked_to(drive, uncorrected):
    """More electrical periods than the simulation keeps between two looks."""
    found = steps.spin(emulated(uncorrected, drive, Wires()), until=1.2)
    assert found.done
    assert found.fastest_rpm > 1600


@needs_target
def test_a_step_that_does_not_succeed_says_why(uncorrected, tmp_path):
    path = drive_file("paper_6_4", tmp_path)
    (tmp_path / "wires.toml").write_text("sign = [1, -1, 1]")
    board = ["--drive", path, "--wires", tmp_path / "wires.toml"]
    far = "sensing.i_offset_A=[1.5, -6.0, 0.4]"
    done = command("emulate", uncorrected, "precharge", *board, "--set", far)
    assert done.code == 2
    assert done.out.splitlines()[2].split()[-1] == "fault"
    assert "too large an offset (status 13, phase 1 (b): 6.0" in done.error
    for step, why in (("alignment", "above the trip level"), ("spin", "a current is negative")):
        done = command("emulate", uncorrected, step, *board)
        assert (done.code, why in done.error) == (2, True)


def test_a_wiring_is_read_as_it_was_written(uncorrected):
    assert read_wiring(uncorrected) == STRAIGHT
    other = Wiring((0, 2, 1), (2, 0, 1), (-1, 1, -1), -1, 6.25)
    write_wiring(uncorrected, other)
    assert read_wiring(uncorrected) == other


@pytest.mark.parametrize(
    ("line", "said"),
    [
        (
            "ZERO_RAD (70.0F * 0.0174532925F)",
            "ZERO_RAD is `(70.0F * 0.0174532925F)`, need a line as",
        ),
        ("CHANNEL {0, 1}", "need each phase once"),
        ("LEG {0, 1, 1}", "need each phase once"),
        ("SIGN {1, 2, 1}", "need 1 or -1"),
        ("DIRECTION 0", "need 1 or -1"),
        ("DIRECTION", "is no such line"),
    ],
)
def test_a_wiring_that_cannot_be_meant_is_refused(line, said, uncorrected):
    path = uncorrected / "emulated" / "wiring.h"
    text = path.read_text()
    name = line.split()[0]
    kept = [row for row in text.splitlines() if not row.startswith(f"#define WIRING_{name} ")]
    try:
        path.write_text("\n".join([*kept, f"#define WIRING_{line}", ""]))
        with pytest.raises(rl.ParameterError) as fault:
            read_wiring(uncorrected)
        assert said in str(fault.value)
    finally:
        path.write_text(text)


def test_a_package_without_its_numbers_is_refused(tmp_path):
    """As the templates of the package are."""
    path = drive_file("paper_6_4", tmp_path)
    (tmp_path / "reluctance_controller.h").write_text("/* nothing */")
    assert "does not define PHASES" in refused("emulate", tmp_path, "spin", "--drive", path)


@pytest.mark.parametrize("way", [1, -1])
def test_legs_in_another_order_are_put_in_order_before_the_zero_is_taken(way):
    drive = bench_drive("generic_1hp_8_6", **{"control.T_s_us": 50})
    assert drive.sensing.encoder_counts == COUNTS
    order = (0, 2, 1, 3)
    wires = Wires(phase=order, sensor=order, sign=(1,) * 4, direction=way, zero_deg=70.0)
    found = commission(drive, "alignment", wires=wires)
    assert found.direction == 0
    wiring = Wiring((0, 1, 2, 3), (0, 1, 2, 3), (1, 1, 1, 1))
    wiring = wiring.with_angle(found.direction, found.zero_deg, found.place)
    now = tuple(order[leg] for leg in wiring.leg)
    again = commission(
        drive, "alignment", wires=Wires(phase=now, sensor=now, direction=way, zero_deg=70.0)
    )
    assert abs(again.direction) == 1
    wiring = wiring.with_angle(again.direction, again.zero_deg, again.place)
    assert zero_error(drive, wires, wiring) < 1


WRONG = {
    "need one of: precharge": ["fly"],
    "goes with wiring or alignment": ["spin", "--correct"],
    "needs --out": ["pulses"],
    "need less than 3": ["spin", "--phase", "3"],
    "--out goes with pulses": ["spin", "--out", "x.csv"],
    "--whole-period goes with pulses": ["spin", "--whole-period"],
    "--until goes with spin": ["wiring", "--until", "1"],
    "--reference goes with spin or trip": ["pulses", "--reference", "1"],
    "need a finite number": ["spin", "--reference", "nan"],
    "--held and --held_A go together": ["pulses", "--held", "1", "--out", "p.csv"],
    "--held goes with pulses": ["spin", "--held", "1", "--held_A", "9"],
    "need another phase than 0": ["pulses", "--held", "0", "--held_A", "9", "--out", "p.csv"],
    "need at most 400 s": ["spin", "--reference", "1e-6"],
    "spin for inf s": ["spin", "--until", "inf"],
    "has a control period of 5e-05 s": ["spin", "--set", "control.T_s_us=40"],
    "is for 3 phases, the drive has 4": [
        *("spin", "--set", "machine=generic_1hp_8_6", "--set", "reference.tau_Nm=2"),
        *("--set", "sensing.i_offset_A="),
    ],
}


@pytest.mark.parametrize("said", WRONG)
def test_what_cannot_be_meant_is_refused(said, package, tmp_path):
    path = drive_file("paper_6_4", tmp_path)
    assert said in refused("emulate", package, *WRONG[said], "--drive", path)


def test_a_folder_that_is_no_package_is_refused(tmp_path):
    path = drive_file("paper_6_4", tmp_path)
    assert "is no package" in refused("emulate", tmp_path, "spin", "--drive", path)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("phases = [0, 2, 1]", "unknown key `phases`"),
        ("phase = [0, 1.5, 2]", "need whole numbers"),
        ("phase = 1", "need whole numbers"),
        ("zero_deg = [1]", "need a number"),
        ("direction = true", "need a number"),
    ],
)
def test_wires_that_cannot_be_meant_are_refused(text, said, tmp_path):
    (tmp_path / "wires.toml").write_text(text)
    with pytest.raises(rl.ParameterError, match=said):
        read_wires(tmp_path / "wires.toml")


@pytest.mark.parametrize(
    "wires", [Wires(phase=(0, 0, 1)), Wires(sign=(1, 1)), Wires(direction=2), Wires(sign=(1, 0, 1))]
)
def test_wires_that_no_board_has_are_refused(wires):
    with pytest.raises(rl.ParameterError, match="need"):
        wires.checked(3)


def test_trips_that_cannot_begin_have_one_cause_and_it_is_said_once(
    drive, uncorrected, tmp_path, monkeypatch
):
    cause = "no test began: it does not reach 750 rpm"
    never = steps.Trip("a plug", False, 0, cause, 0.0, True, False, False)
    monkeypatch.setattr(steps, "_trip", lambda on, what, how, asked: never)
    done = command("emulate", uncorrected, "trip", "--drive", drive_file("paper_6_4", tmp_path))
    assert done.code == 2
    assert (done.out + done.error).count(cause) == 1
    assert "DOES NOT" not in done.out
