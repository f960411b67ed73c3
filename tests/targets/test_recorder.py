"""The recorder of a firmware package: the desk computes again what a target recorded."""

import ctypes
import json
import subprocess
import sys
import zlib

import numpy as np
import pytest
from firmware_tools import ROOT, Native, drive, needs_target

import reluctance as rl
from reluctance.targets.export import firmware
from reluctance.targets.export.dump import (
    API,
    HEADER,
    MAGIC,
    NO_SAMPLE,
    VERSION,
    read_dump,
    record_type,
)
from reluctance.targets.export.recording import record
from reluctance.targets.export.replay_dump import replay_dump
from reluctance.targets.export.target import build, run_program

SAMPLES, AFTER = 64, 32  # of a segment, and after the trigger, as in emulated/recorded.cpp
START = 3600  # calls until `run`
NAME = "deadbeat"
PUT = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.POINTER(ctypes.c_uint32), ctypes.c_uint32)


def calls(name, steps, fail):
    """Calls of reluctance_run: the way to `run`, then a recorded simulation; from sample `fail` on
    the sensor of phase b shows nothing."""
    given = drive(name)
    samples = record(given, steps=steps).samples
    N, n = given.machine.n_phases, np.arange(START + steps)
    rows = np.vstack([np.tile(samples[0], (START, 1)), samples])
    advance = given.machine.N_r * samples[0, N + 1] * given.control.T_s
    rows[:START, N] = (samples[0, N] + (n[:START] - START) * advance) % (2 * np.pi)
    rows[:START, :N] = 0.0
    rows[START + fail :, 1] = 0.0
    request = np.zeros((len(rows), 4), "<u4")
    request[:, 0] = 1
    request[:, 3] = np.where(n >= START, n, 0)
    rows = np.ascontiguousarray(rows, "<f4").view("<u4")
    return np.hstack([rows[:, :-1], request, rows[:, -1:]])


def with_parameter(words, changes):
    """Adds what is set before each call: {call: (number, value)}."""
    more = np.full((len(words), 2), 0xFFFFFFFF, "<u4")
    for n, (number, value) in changes.items():
        more[n] = number, np.float32(value).view(np.uint32)
    return np.ascontiguousarray(np.hstack([words, more]))


def dumped(name, folder):
    """A dump of the emulated Cortex-M7: a sensor dies in `run`, soon after a parameter was set."""
    program = build(firmware(drive(name), folder / "package").folder, "cortex-m7")
    program = program.with_name("recorded.elf")
    words = with_parameter(calls(name, steps=1500, fail=900), {START + 870: (0, 41.0)})
    (program.parent / "calls").write_bytes(words.tobytes())
    run_program(program, "cortex-m7")
    return program.with_name("dump")


@pytest.fixture(scope="module")
def target_dump(tmp_path_factory):
    return dumped(NAME, tmp_path_factory.mktemp("recorder"))


@needs_target
def test_a_ring_holds_the_segments_that_were_asked_for_whatever_the_state(tmp_path):
    """A drive with diagnosis remembers more than the others, and is computed again as they are."""
    name = "deadbeat_diagnosis"
    found = replay_dump(dumped(name, tmp_path), drive(name))
    assert found.exact
    assert found.dump.state_words > 256
    assert len(found.dump.segments) == 4


@needs_target
def test_the_desk_repeats_a_fault_of_the_target_from_the_middle_of_the_run(target_dump):
    found = replay_dump(target_dump, drive(NAME))
    dump = found.dump
    assert found.exact
    assert dump.status in (8, 9)  # dead, or too low
    assert dump.phase == 1
    assert dump.samples > 2 * SAMPLES
    assert dump.segments[0].first > START  # the start is no longer in the ring
    last = dump.segments[-1]
    assert last.first + len(last.records) - 1 == dump.trigger + AFTER
    rows = np.concatenate([s.records for s in dump.segments])
    number = np.concatenate([s.first + np.arange(len(s.records)) for s in dump.segments])
    assert np.array_equal(number, np.arange(number[0], number[0] + len(number)))
    assert (rows["mode"][number < dump.trigger] == 4).all()
    assert (rows["mode"][number >= dump.trigger] == 5).all()
    assert (rows["order"]["leg"][number >= dump.trigger] == -1).all()


@needs_target
def test_a_segment_begins_where_a_parameter_was_set(target_dump):
    """The orders after it are those of the new value: with the old one the replay would differ."""
    dump = read_dump(target_dump)
    assert START + 870 in [s.first for s in dump.segments]
    short = [s for s in dump.segments[:-1] if len(s.records) < SAMPLES]
    assert [s.first + len(s.records) for s in short] == [START + 870]


def damaged(path, place, change):
    data = bytearray(path.read_bytes())
    change(data)
    out = place / "dump"
    out.write_bytes(data)
    return out


def flip(data, bit):
    data[bit // 8] ^= 1 << bit % 8


def sealed(data):
    data[-4:] = zlib.crc32(data[:-4]).to_bytes(4, "little")


@needs_target
def test_a_damaged_dump_is_refused(target_dump, tmp_path):
    rng = np.random.default_rng(1)
    size = target_dump.stat().st_size
    for bit in rng.integers(32, 8 * size, 25):
        path = damaged(target_dump, tmp_path, lambda data, bit=int(bit): flip(data, bit))
        with pytest.raises(rl.ParameterError, match="is damaged: its CRC-32 is wrong"):
            read_dump(path)
    for end in (0, 10, 40, size - 4, size - 1):
        path = damaged(target_dump, tmp_path, lambda d, n=end: d.__delitem__(slice(n, None)))
        with pytest.raises(rl.ParameterError):
            read_dump(path)


@needs_target
@pytest.mark.parametrize(
    "field, value, message",
    [
        ("magic", 1, "is no dump of the recorder"),
        ("version", 9, "version 9 of the dump, need 1"),
        ("api", 9, "api 9 of the dump, need 3"),
        ("segments", 99, "segments do not fill it"),
        ("fingerprint", 1, "give the drive file that was flashed"),
        ("record_words", 7, "samples of 7 words are unknown"),
        ("phases", 2_000_000_000, "need 1 to 6"),
    ],
)
def test_a_dump_of_another_form_or_drive_is_refused(target_dump, tmp_path, field, value, message):
    def change(data):
        head = np.frombuffer(data, HEADER, 1).copy()
        head[field] = value
        data[: HEADER.itemsize] = head.tobytes()
        sealed(data)

    with pytest.raises(rl.ParameterError, match=message):
        replay_dump(damaged(target_dump, tmp_path, change), drive(NAME))


def run_replay(*arguments):
    return subprocess.run(
        [sys.executable, "-m", "reluctance", "replay", *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=120,
    )


@needs_target
def test_the_command_tells_that_all_orders_are_equal_and_plots(target_dump, tmp_path):
    file = ROOT / "examples" / "deadbeat.toml"
    plot = tmp_path / "dump.png"
    done = run_replay(target_dump, "--drive", file, "--plot", plot)
    assert (done.returncode, done.stderr) == (0, "")
    assert f"all {read_dump(target_dump).samples} orders equal" in done.stdout
    assert plot.stat().st_size > 20_000
    told = json.loads(run_replay(target_dump, "--drive", file, "--json").stdout)
    assert (told["different"], told["first"]) == (0, None)


@needs_target
def test_the_command_names_the_first_order_that_differs(target_dump, tmp_path):
    dump = read_dump(target_dump)
    at = HEADER.itemsize + 4 * (2 + dump.state_words) + record_type(3).fields["order"][1]

    def change(data):
        data[at] ^= 1  # the first leg state of the first order
        sealed(data)

    done = run_replay(
        damaged(target_dump, tmp_path, change), "--drive", ROOT / "examples" / "deadbeat.toml"
    )
    assert done.returncode == 2
    first = dump.segments[0].first
    where = f"1 of {dump.samples} samples differ, first sample {first}: `order.leg[0][0]` is"
    assert where in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_damaged_dump_is_one_line_and_exit_2(tmp_path):
    (tmp_path / "dump").write_bytes(b"RELD" + bytes(200))
    done = run_replay(tmp_path / "dump", "--drive", ROOT / "examples" / "deadbeat.toml")
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
    assert "damaged" in done.stderr


class Recorder:
    """The recorder of a package on the desk."""

    def __init__(self, package, words, samples, after):
        self.package, self.library = package, package.library
        self.recorder = np.zeros(64, np.uint64)
        self.memory = np.zeros(words, np.uint32)
        self.held = self.library.reluctance_recorder_start(
            *self.pointers(self.recorder, self.memory), words, samples, after
        )

    @staticmethod
    def pointers(*arrays):
        return [ctypes.c_void_p(a.ctypes.data) for a in arrays]

    def run(self, sample, request):
        p = self.package
        p.sample[0], p.request[0] = sample, request
        return self.library.reluctance_run_recorded(
            *self.pointers(self.recorder, p.state, p.sample, p.request, p.command, p.outputs)
        )

    def trigger(self):
        self.library.reluctance_recorder_trigger(*self.pointers(self.recorder))

    def dump(self, path):
        parts = []

        @PUT
        def put(_, words, count):
            parts.append(np.ctypeslib.as_array(words, (count,)).tobytes())

        count = self.library.reluctance_recorder_dump(*self.pointers(self.recorder), put, None)
        path.write_bytes(b"".join(parts))
        assert path.stat().st_size == 4 * count
        return count


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    return Native(drive("deadbeat"), tmp_path_factory.mktemp("recorder"))


def idle(n):
    return ([0.0, 0.0, 0.0], 1.0, 0.0, 240.0, 0.0), (0, 0, 0, n, 0.0)


def test_the_ring_holds_what_it_said_and_freezes_after_the_trigger(package, tmp_path):
    recorder = Recorder(package.again(), 4000, 10, 7)
    assert recorder.held % 10 == 0
    assert recorder.held > 20
    for n in range(500):
        recorder.run(*idle(n))
        if n == 321:
            recorder.trigger()
    recorder.dump(tmp_path / "dump")
    found = replay_dump(tmp_path / "dump", drive("deadbeat"))
    assert (found.exact, found.dump.trigger, found.cause) == (True, 321, "trigger")
    assert recorder.held <= found.dump.samples <= recorder.held + 10
    last = found.dump.segments[-1]
    assert last.first + len(last.records) - 1 == 321 + 7
    assert last.records["sequence"][-1] == 321 + 7


def test_a_ring_from_the_reset_on_is_replayed_from_the_reset_on(package, tmp_path):
    recorder = Recorder(package.again(), 4000, 10, 7)
    for n in range(15):
        recorder.run(*idle(n))
    recorder.dump(tmp_path / "dump")
    found = replay_dump(tmp_path / "dump", drive("deadbeat"))
    assert (found.exact, found.dump.trigger, found.dump.samples) == (True, None, 15)
    assert [s.first for s in found.dump.segments] == [0, 10]


def test_too_little_memory_records_nothing_and_the_drive_runs(package, tmp_path):
    too_many = [(4000, n, 0) for n in (0xFFFFFFFF, 2**32 // 59 + 1, 2**31)]
    for words, samples, after in ((100, 10, 0), (4000, 0, 0), (4000, 10, 4000), *too_many):
        recorder = Recorder(package.again(), words, samples, after)
        assert recorder.held == 0
        assert recorder.run(*idle(0)) == 0
        recorder.trigger()
        assert recorder.dump(tmp_path / "dump") == 0
        assert not recorder.memory.any()


@pytest.mark.parametrize("phases", [0, 1, 2, 4, 6, 7])
def test_a_dump_of_another_number_of_phases_never_reaches_the_package(package, tmp_path, phases):
    """The package writes its three orders into a row of this dump: memory that is not there."""
    recorder = Recorder(package.again(), 4000, 10, 7)
    recorder.run(*idle(0))
    recorder.dump(tmp_path / "dump")
    real, record = read_dump(tmp_path / "dump"), record_type(phases)
    head = np.zeros(1, HEADER)
    for name, value in dict(
        magic=MAGIC, version=VERSION, api=API, fingerprint=real.fingerprint, phases=phases,
        state_words=real.state_words, record_words=record.itemsize // 4, segments=1,
        trigger=NO_SAMPLE, phase=-1,
    ).items():  # fmt: skip
        head[name] = value
    segment = np.array([0, 3], "<u4").tobytes() + bytes(4 * real.state_words)
    data = bytearray(head.tobytes() + segment + np.zeros(3, record).tobytes() + bytes(4))
    sealed(data)
    (tmp_path / "dump").write_bytes(data)
    with pytest.raises(rl.ParameterError, match=f"phases = {phases}, ") as told:
        replay_dump(tmp_path / "dump", drive("deadbeat"))
    assert "need 1 to 6" in str(told.value) or "has 3; give the drive file" in str(told.value)


def test_a_dump_without_samples_is_not_drawn(package, tmp_path):
    recorder = Recorder(package.again(), 4000, 10, 7)
    recorder.run(*idle(0))
    recorder.dump(tmp_path / "dump")
    data = bytearray((tmp_path / "dump").read_bytes())
    head = np.frombuffer(data, HEADER, 1).copy()
    head["segments"] = 0
    data = bytearray(head.tobytes() + bytes(4))
    sealed(data)
    (tmp_path / "dump").write_bytes(data)
    plot = tmp_path / "x.png"
    file = ROOT / "examples" / "deadbeat.toml"
    done = run_replay(tmp_path / "dump", "--drive", file, "--plot", plot)
    assert (done.returncode, done.stderr.count("\n"), plot.exists()) == (2, 1, False)
    assert "holds no samples" in done.stderr
