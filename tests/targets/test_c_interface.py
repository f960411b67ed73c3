"""The C interface: the same bits as the simulation of Python, however a run is cut or put together
of its parts; and an error code for whatever is done wrong."""

import re
import struct
import subprocess
from pathlib import Path

import c_fuzz
import numpy as np
import pytest
from c_library import SENSORS, TABLES, Unit, compiled, library
from command import command
from coupled import SENSED, WORKING
from firmware_tools import coupled_machine

import reluctance as rl
from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.drive.guard.supervised import controller
from reluctance.drive.run.events import MODES
from reluctance.drive.run.plant import closed_loop
from reluctance.targets.export.blob import blob, kind

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
UNTIL = 0.012
TURNING = [
    "load.speed_rpm=2200",
    "reference.kind=torque",
    "reference.speed_rpm=",
    "reference.tau_Nm=18",
]
STATES = {  # a drive that meets a fault, is cleared and enabled again
    "supervision.enable_s": 0.0,
    "supervision.precharge_ms": 1.0,
    "supervision.fault": "dead_current_sensor",
    "supervision.fault_s": 0.085,
    "supervision.clear_s": 0.09,
    "supervision.restart_s": 0.092,
}
EVENT = ("t", "mode", "status", "phase", "value", "limit")
COUPLED = [f"machine={coupled_machine()}", *WORKING]
LAWS = "TorqueSharing,Ditc,Angles,PwmCurrent,TorqueSharingOfPairs"
DRIVES = {
    "sharing": rl.load(EXAMPLES / "sharing_cubic.toml"),
    "battery": rl.load(EXAMPLES / "battery.toml"),
    "load step": rl.load(EXAMPLES / "load_step.toml"),
    "sensors": rl.load(EXAMPLES / "sharing_cubic.toml").with_values(SENSORS),
    "ditc": rl.load(EXAMPLES / "ditc.toml"),
    "map": rl.load(EXAMPLES / "map_mpc.toml").with_values(
        {"control.law": "torque_sharing", "control.precision": "float"}
    ),
    "states": rl.load(EXAMPLES / "sharing_cubic.toml").with_values({**SENSORS, **STATES}),
    "states, float": rl.load(EXAMPLES / "map_mpc.toml").with_values(
        {"control.law": "torque_sharing", "control.precision": "float", **STATES}
    ),
    "states, diagnosed": rl.load(EXAMPLES / "sharing_cubic.toml").with_values(
        {**SENSORS, **STATES, "protection.diagnosis": True, "protection.flux_angle": True}
    ),
    "angle table": rl.load(EXAMPLES / "angle_table.toml", TURNING),
    "pairs of the law": rl.load(EXAMPLES / "sharing_cubic.toml", COUPLED),
    "pairs of the frame": rl.load(EXAMPLES / "pwm_current.toml", COUPLED),
}


@pytest.fixture(scope="module")
def lib(tmp_path_factory):
    place = tmp_path_factory.mktemp("library")
    return library(compiled(place / "reluctance.so", laws=LAWS, phases="3"))


def end(name):
    """Of a run: a drive with states runs from 0.07 s on."""
    return 0.1 if name.startswith("states") else UNTIL


def desk(drive, until=UNTIL, record=0.0):
    """Rows of waveforms and periods that the simulation of Python leaves."""
    loop = closed_loop(drive, controller(drive), -1.0 if record is None else record)
    loop.close_period()
    t, waveforms, periods = 0.0, [], []
    while t < until:
        t = loop.advance(until)
        waveforms.append(loop.take_waveforms())
        periods.append(loop.take_periods())
    return np.vstack(waveforms), np.vstack(periods)


@pytest.mark.parametrize("name", DRIVES)
def test_it_computes_the_bits_of_the_simulation(lib, name):
    drive = DRIVES[name]
    unit = Unit(lib, blob(drive, record=0.0)).start()
    waveforms, periods = unit.advance(end(name))
    expected = desk(drive, end(name))
    assert len(waveforms) > 500
    assert waveforms.tobytes() == expected[0].tobytes()
    assert periods.tobytes() == expected[1].tobytes()
    names = [*_core.waveform_columns(3), *_core.flux_estimate_columns]
    assert unit.names("waveform") == names[: waveforms.shape[1]]
    assert (waveforms.shape[1] == len(names)) == drive.protection.flux_angle
    assert unit.names("period") == _core.period_columns(3)
    unit.free()


@pytest.mark.long
@pytest.mark.parametrize("example", ["edge_mpc_mcu", "finite_set_mpc", "deadbeat", "ditc"])
def test_laws_of_pairs_compute_the_bits_of_the_simulation(example, tmp_path):
    """Under a name of their own, in a library of all laws for maps with three phases."""
    more = SENSED if example == "edge_mpc_mcu" else []
    drive = rl.load(EXAMPLES / f"{example}.toml", [*COUPLED, *more])
    assert kind(drive).law.endswith("OfPairs")
    file = tmp_path / "reluctance.so"
    lib = library(compiled(file, laws=kind(drive).law, machines="FluxMap", phases="3"))
    unit = Unit(lib, blob(drive, record=0.0)).start()
    waveforms, periods = unit.advance(0.01)
    expected = desk(drive, 0.01)
    assert len(waveforms) > 500
    assert waveforms.tobytes() == expected[0].tobytes()
    assert periods.tobytes() == expected[1].tobytes()
    unit.free()


@pytest.mark.parametrize("name", DRIVES)
def test_a_run_does_not_depend_on_where_it_is_interrupted(lib, name):
    unit = Unit(lib, blob(DRIVES[name], record=0.0)).start()
    whole = unit.advance(end(name))
    unit.reset()
    unit.start()
    parts = [unit.advance(t) for t in np.linspace(0, end(name), 778)[1:]]
    for j in (0, 1):
        assert np.vstack([p[j] for p in parts]).tobytes() == whole[j].tobytes()
    unit.free()


@pytest.mark.parametrize("name", DRIVES)
def test_stage_and_controller_make_the_drive(lib, name):
    """At each period the stage's measurement goes to the controller, and its orders back."""
    drive = DRIVES[name]
    content = blob(drive, record=0.0)
    whole = Unit(lib, content).start()
    stage, control = (Unit(lib, content, p).start() for p in ("stage", "controller"))
    T_s = drive.control.T_s
    samples = round(end(name) / T_s)
    expected = whole.advance(T_s * samples)[0]
    reference = drive.reference.course
    rows = []
    for n in range(samples):
        control.write("measurement", stage.read("measurement"))
        if "reference" in control.names("input"):
            held = np.interp(T_s * n, *reference)
            control.set("input", "reference", held)
        control.sample()
        orders = control.read("order")
        assert control.names("order")[-1] == "tau_ref"
        stage.write("order", orders[:-1])
        stage.sample()
        rows.append(stage.advance(T_s * (n + 1))[0])
    coupled = np.vstack(rows)
    of = [j for j, column in enumerate(stage.names("waveform")) if column != "tau_ref"]
    assert coupled[:, of].tobytes() == expected[:, of].tobytes()
    for unit in (whole, stage, control):
        unit.free()


def test_legs_step_the_stage(lib):
    """A magnetized phase at standstill rises by u_dc/L; freewheeling holds; then it falls."""
    drive = DRIVES["sharing"].with_values({"load.speed_rpm": 0.0})
    stage = Unit(lib, blob(drive), "stage").start()
    currents = []
    for n, legs in enumerate(([1, 0, -1], [0, 1, -1], [-1, 0, 0])):
        stage.write("leg", legs)
        stage.sample()
        stage.advance(20e-6 * (n + 1))
        currents.append([stage.get("waveform", f"i_{k}") for k in range(3)])
    (a1, b1, c1), (a2, b2, c2), (a3, b3, _) = currents
    assert a1 == pytest.approx(240 * 20e-6 / 0.67e-3, rel=0.02)  # unaligned, less R i
    assert b1 == c1 == c2 == 0
    assert a2 == pytest.approx(a1, rel=0.03) and b2 > 0
    assert a3 < 0.1 * a2 and 0 < b3 < b2


@pytest.mark.parametrize("name", ["sensors", "pairs of the frame"])
@pytest.mark.parametrize("part", ["drive", "stage", "controller"])
def test_a_restored_state_goes_on_with_the_same_bits(lib, part, name):
    """The second law integrates."""
    unit = Unit(lib, blob(DRIVES[name], record=0.0), part).start()

    def go_on(t):
        if part == "controller":
            given = unit.read("measurement") + t
            unit.write("measurement", given)
            unit.sample()
            return unit.read("order").tobytes()
        if part == "stage":
            unit.write("leg", [1, 0, -1])
            unit.sample()
        return unit.advance(t)[0].tobytes(), unit.read("period").tobytes()

    go_on(0.0031234)
    state = unit.save()
    after = go_on(0.006)
    unit.restore(state)
    assert go_on(0.006) == after
    other = Unit(lib, blob(DRIVES[name], record=0.0), part).start()
    other.restore(state)
    unit.free()
    unit = other
    assert go_on(0.006) == after
    unit.free()


def test_inputs_take_the_place_of_constants(lib):
    """A reference, load or voltage set from outside acts as the drive file's does."""
    drive = DRIVES["sharing"]
    other = drive.with_values({"reference.tau_Nm": 20.0, "converter.u_dc_V": 250.0})
    unit = Unit(lib, blob(drive, record=0.0))
    assert unit.names("input") == ["reference", "u_dc", "omega_m"]
    unit.set("input", "u_dc", 250.0)
    unit.start()
    unit.set("input", "reference", 20.0)
    fields = ["plant.source.u_dc.value_0", "reference.value_0"]
    assert [unit.get("parameter", f) for f in fields] == [250.0, 20.0]
    i_band = DRIVES["sharing"].control.i_band_A
    assert other.control.i_band_A == i_band
    assert unit.advance(UNTIL)[0].tobytes() == desk(other)[0].tobytes()
    stepped = unit.read("waveform").copy()
    unit.set("input", "reference", 30.0)
    unit.advance(UNTIL + 1e-3)
    assert unit.get("waveform", "tau_ref") == 30.0 and stepped[4] == 20.0
    unit.free()
    unit = Unit(lib, blob(DRIVES["load step"]))  # its load has a course over time
    assert "tau_load" not in unit.names("input")
    unit.free()


@pytest.mark.parametrize(
    ("part", "fault", "diagnosis", "expected"),
    [
        ("drive", "over_current", False, 2),
        ("drive", "dead_current_sensor", False, 8),
        ("drive", "no_command", False, 14),
        ("drive", "hardware_trip", False, 15),
        ("controller", "over_current", False, 2),
        ("drive", "frozen_current_sensor", False, 10),
        ("drive", "frozen_current_sensor", True, 9),
        ("controller", "frozen_current_sensor", True, 9),
    ],
)
def test_its_states_and_faults_are_those_of_the_desk(lib, part, fault, diagnosis, expected):
    """Times, states and faults with their evidence in every bit: of a drive in one run, and of a
    controller that is shown sample by sample what the stage measures."""
    drive = DRIVES["states"].with_values(
        {
            "supervision.fault": fault,
            "protection.command_timeout_ms": 2.0,
            "protection.diagnosis": diagnosis,
        }
    )
    control = controller(drive)
    loop = closed_loop(drive, control, -1.0)
    while loop.advance(0.1) < 0.1:
        loop.take_periods()
    told = _core.events(control)
    content = blob(drive)
    unit = Unit(lib, content, part).start()
    if part == "drive":
        unit.advance(0.1)
    else:
        stage = Unit(lib, content, "stage").start()
        for n in range(round(0.1 / drive.control.T_s)):
            unit.write("measurement", stage.read("measurement"))
            unit.sample()
            stage.write("order", unit.read("order")[:-1])
            stage.sample()
            stage.advance(drive.control.T_s * (n + 1))
        stage.free()
    rows = unit.take("states")
    columns = [unit.names("states").index(c) for c in EVENT]
    assert np.ascontiguousarray(rows[:, columns]).tobytes() == told.tobytes()
    entered = [lib.srm_mode_text(int(mode)).decode() for mode in told[:, 1]]
    assert entered[:7] == [*MODES[1:], "off", "precharge"]
    status = int(told[4, 2])
    assert status == expected
    assert lib.srm_fault_text(status).decode() == _core.describe_status(status)
    assert len(unit.take("states")) == 0
    unit.free()


def test_states_and_faults_have_words_and_no_others(lib):
    assert [lib.srm_mode_text(n).decode() for n in range(len(MODES))] == list(MODES)
    for n in (-1, len(MODES), 1 << 30):
        assert lib.srm_mode_text(n) == b"unknown"
    for n in (-1, 100, 258, 1 << 30):
        assert lib.srm_fault_text(n) == b"unknown"


def test_a_drive_with_states_is_asked_and_tells(lib):
    """Enabled from outside; a reading beyond the trip level ends the run until it is cleared."""
    drive = DRIVES["sharing"].with_values({"supervision.enable_s": 0.0})
    unit = Unit(lib, blob(drive))
    assert unit.names("input")[:3] == ["reference", "enable", "clear"]
    unit.set("input", "enable", 0.0)
    unit.start()
    unit.advance(0.002)
    told = dict(zip(unit.names("states"), unit.read("states"), strict=True))
    assert told["mode"] == 0 and told["gate_enable"] == 0
    unit.set("input", "enable", 1.0)
    unit.advance(0.08)
    assert unit.get("states", "mode") == 4 and unit.get("states", "gate_enable") == 1
    assert unit.get("period", "E_dc") > 0
    i_trip = unit.get("parameter", "control.drive.control.protection.levels.i_trip")
    unit.free()

    control = Unit(lib, blob(drive), "controller").start()
    seen = dict(zip(control.names("measurement"), control.read("measurement"), strict=True))
    seen |= {"u_dc": 240.0, "theta_e": 1.0}

    def sampled(**values):
        control.write("measurement", [*(seen | values).values()])
        control.sample()
        return dict(zip(control.names("states"), control.read("states"), strict=True))

    modes = [sampled()["mode"]]
    while modes[-1] < 4 and len(modes) < 20000:
        modes.append(sampled()["mode"])
    assert set(modes) == {1, 2, 3, 4} and modes == sorted(modes)
    sampled(i_1=1.1 * i_trip)
    fault = sampled(i_1=1.1 * i_trip)
    assert (fault["mode"], fault["status"], fault["phase"]) == (5, 2, 1)
    assert fault["value"] == 1.1 * i_trip and fault["limit"] == i_trip
    assert control.get("order", "at_once") == 1 and control.get("order", "leg_0_0") == -1
    control.set("input", "clear", 1.0)
    assert sampled()["mode"] == 5  # while it is enabled
    control.set("input", "enable", 0.0)
    assert sampled()["mode"] == 0
    control.free()
    unit = Unit(lib, blob(DRIVES["sharing"])).start()
    with pytest.raises(RuntimeError, match="-11"):  # a drive without states
        unit.names("states")
    unit.free()


def test_parameters_have_the_names_of_the_fields(lib):
    unit = Unit(lib, blob(DRIVES["sharing"], record=0.0))
    names = unit.names("parameter")
    assert len(names) == len(set(names))
    assert {"plant.R", "sampling.T_s", "resolution.record_every", "control.law.i_band"} <= {*names}
    unit.set("parameter", "control.law.i_band", 2.5)
    unit.start()
    changed = DRIVES["sharing"].with_values({"control.i_band_A": 2.5})
    assert unit.advance(UNTIL)[0].tobytes() == desk(changed)[0].tobytes()
    unit.free()


def wrong(lib, call, *arguments):
    """The status of a call that must fail, which has a text."""
    status = getattr(lib, f"srm_{call}")(*arguments)
    assert status < 0, (call, arguments)
    assert lib.srm_last_error().startswith(lib.srm_text(status))
    return status


def checksummed(content: bytes) -> bytes:
    value = 14695981039346656037  # FNV-1a
    for byte in content[:80] + content[88:]:
        value = (value ^ byte) * 1099511628211 % 2**64
    return content[:80] + struct.pack("<Q", value) + content[88:]


def test_a_wrong_blob_is_told(lib):
    good = blob(DRIVES["sharing"])

    def create(content):
        handle = np.ones(1, np.uint32)
        status = wrong(lib, "create", content, len(content), 0, handle.ctypes.data)
        assert handle[0] == 0
        return status, lib.srm_last_error().decode()

    assert create(b"")[0] == create(b"SRMDRIVE")[0] == create(b"x" * 200)[0] == -5
    assert create(good[:-8])[0] == create(good[:100] + b"?" + good[101:])[0] == -7
    assert create(good[:8] + b"\x01" + good[9:])[0] == -6
    assert create(checksummed(good[:-8]))[0] == -5
    assert create(checksummed(good + bytes(8)))[0] == -5
    other_layout = checksummed(good[:72] + bytes(8) + good[80:])
    assert create(other_layout) == (
        -6,
        "the blob is of another version of reluctance: export it again: fields",
    )
    assert create(checksummed(good[:12] + b"\x05" + good[13:]))[0] == -8
    assert create(checksummed(good[:16] + b"EdgeMpc".ljust(24, b"\0") + good[40:])) == (
        -8,
        "this library was compiled without this kind of drive: "
        "EdgeMpc, LeHuy, 3 phases, double, frame",
    )
    assert create(checksummed(good[:64] + b"states\0\0" + good[72:]))[0] == -6
    assert create(checksummed(good[:64] + b"other\0\0\0" + good[72:]))[0] == -8
    nan = checksummed(good[:96] + struct.pack("<d", np.nan) + good[104:])
    assert create(nan)[1].endswith("plant.machine.L_u")


@pytest.mark.long
def test_every_number_of_a_blob_may_be_anything(lib):
    """Zero, negative, huge, not a number: refused, or a drive that runs or says it diverged."""
    good = blob(DRIVES["load step"])
    handle, reached = np.zeros(1, np.uint32), np.zeros(1)
    refused = 0
    values = (0.0, -1.0, 0.5, 1e300, -1e300, 7.0, np.nan, np.inf)
    for j in range(88, len(good), 8):
        for value in np.roll(values, j // 8)[:2]:  # the fuzzer below tries more
            content = checksummed(good[:j] + struct.pack("<d", value) + good[j + 8 :])
            status = lib.srm_create(content, len(content), 0, handle.ctypes.data)
            if status == 0:
                status = lib.srm_start(handle[0])
                if status == 0:
                    lib.srm_advance(handle[0], 1e-4, reached.ctypes.data)
                assert lib.srm_free(handle[0]) == 0
            refused += status < 0
    assert refused > 100


def test_wrong_calls_are_told(lib):
    content = blob(DRIVES["sharing"])
    here = np.zeros(100)
    at = here.ctypes.data
    assert wrong(lib, "create", None, 10, 0, at) == -1
    assert wrong(lib, "create", content, len(content), 0, None) == -1
    assert wrong(lib, "create", content, len(content), 3, at) == -11
    for call, arguments in {
        "free": (),
        "start": (),
        "reset": (),
        "sample": (),
        "advance": (1.0, at),
        "read": (2, at, 24),
        "state_size": (at,),
    }.items():
        assert wrong(lib, call, 0, *arguments) == -2
        assert wrong(lib, call, 123456789, *arguments) == -2

    unit = Unit(lib, content)
    u = unit.handle
    assert wrong(lib, "advance", u, 1.0, at) == -10
    assert wrong(lib, "read", u, 2, at, len(unit.names("waveform"))) == -10
    assert wrong(lib, "save", u, at, 800) in (-4, -10)
    assert wrong(lib, "take", u, 2, at, 1, at) == -10
    unit.start()
    assert wrong(lib, "start", u) == -10
    assert wrong(lib, "sample", u) == -11
    assert wrong(lib, "advance", u, np.nan, at) == wrong(lib, "advance", u, np.inf, at) == -14
    assert wrong(lib, "set", u, 0, 0, 4.0) == -10
    assert wrong(lib, "set", u, 1, 0, np.nan) == -14
    assert wrong(lib, "set", u, 1, 99, 1.0) == wrong(lib, "get", u, 1, -1, at) == -12
    assert wrong(lib, "set", u, 2, 0, 1.0) == wrong(lib, "set", u, 6, 0, 1.0) == -13
    assert wrong(lib, "read", u, 2, None, 24) == wrong(lib, "find", u, 2, None, at) == -1
    assert wrong(lib, "read", u, 2, at, 23) == wrong(lib, "restore", u, at, 3) == -4
    assert wrong(lib, "find", u, 2, b"torque", at) == wrong(lib, "count", u, 9, at) == -12
    assert wrong(lib, "take", u, 3, at, 0, at) == -4  # the row of the start waits
    unit.advance(1e-3)
    assert wrong(lib, "advance", u, 1e-4, at) == -9
    state = bytearray(unit.save())
    state[100] ^= 1
    assert wrong(lib, "restore", u, bytes(state), len(state)) == -7
    other = Unit(lib, blob(DRIVES["sensors"])).start()
    assert wrong(lib, "restore", u, other.save(), len(state)) == -16
    other.free()
    unit.free()
    assert wrong(lib, "free", u) == wrong(lib, "advance", u, 2.0, at) == -2

    stage = Unit(lib, content, "stage").start()
    orders = stage.read("order")
    assert wrong(lib, "set", stage.handle, TABLES.index("leg"), 0, 2.0) == -9
    edges = stage.names("order").index("t_edge_0_0")
    assert wrong(lib, "set", stage.handle, TABLES.index("order"), edges + 1, -1.0) == -9
    assert (stage.read("order") == orders).all()
    controller = Unit(lib, content, "controller").start()
    assert wrong(lib, "advance", controller.handle, 1.0, at) == -11
    assert wrong(lib, "count", controller.handle, TABLES.index("waveform"), at) == -11
    for each in (stage, controller):
        each.free()


def test_units_are_many_but_not_endless(lib):
    content = blob(DRIVES["sharing"])
    units = []
    with pytest.raises(RuntimeError, match="too many units"):
        while len(units) <= 4096:
            units.append(Unit(lib, content))
    assert len({u.handle for u in units}) == len(units) > 4000  # some are left from other tests
    units.pop().free()
    units.append(Unit(lib, content))
    for u in units:
        u.free()


def test_the_header_is_c99_and_a_program_in_c_runs(tmp_path):
    """As printed in docs/c_interface.md."""
    page = (ROOT / "docs" / "c_interface.md").read_text()
    program = page.partition("```c\n")[2].partition("```")[0]
    compile_it, run_it = re.search(r"^(cc .*)\n(./torque .*)$", page, flags=re.M).groups()
    (tmp_path / "torque.c").write_text(program)
    (tmp_path / "include").symlink_to(ROOT / "include")
    (tmp_path / "build").mkdir()
    library = tmp_path / "build" / "libreluctance.so"
    compiled(library, laws="TorqueSharing", machines="LeHuy", phases=3)
    strict = ["-Wall", "-Wextra", "-Wpedantic", "-Werror"]
    subprocess.run([*compile_it.split(), *strict], check=True, cwd=tmp_path)
    blob_file = tmp_path / run_it.split()[1]
    done = command("export", "blob", EXAMPLES / "sharing_cubic.toml", "--out", blob_file)
    assert done.code == 0, done.error
    told = subprocess.check_output(run_it.split(), text=True, cwd=tmp_path)
    mean = rl.simulate(DRIVES["sharing"], until=0.05, record=None).periods
    expected = mean["tau"][-1] / 0.05
    assert told == f"mean torque {expected:.6f} N m\n"


def test_a_law_in_python_has_no_blob():
    drive = rl.load(EXAMPLES / "own_law" / "own_law.toml", trust=True)
    with pytest.raises(ParameterError, match="cannot be exported"):
        blob(drive)


def test_a_blob_is_a_pure_function_of_the_drive():
    drive = DRIVES["map"]
    assert blob(drive) == blob(
        rl.load(EXAMPLES / "map_mpc.toml").with_values(
            {"control.law": "torque_sharing", "control.precision": "float"}
        )
    )
    assert str(kind(drive)) == "TorqueSharing, FluxMap, 3 phases, float"


@pytest.mark.long
def test_random_sequences_of_calls_are_answered(tmp_path):
    """With address and undefined-behaviour sanitizers; tests/support/c_fuzz.py runs 10^6."""
    found = c_fuzz.fuzzed(c_fuzz.program(tmp_path), 1000, 1)
    assert found["sequences"] == 1000 and found["calls"] > 20_000
    assert {"0", "-2", "-9", "-10", "-11", "-13"} <= found.keys()


def test_the_numbers_of_the_long_run_are_of_a_million_sequences():
    rows = (ROOT / "bench" / "c_interface_fuzz.csv").read_text().splitlines()
    found = dict(row.split(",") for row in rows[1:])
    assert int(found["sequences"]) >= 1_000_000 < int(found["calls"])
