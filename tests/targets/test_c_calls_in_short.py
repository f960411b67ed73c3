"""Calls of the C interface, each with what it answers and says: the names of every table, and every
mistake of a caller. One small library of a drive with states."""

import ctypes
import struct

import numpy as np
import pytest
import small_library
from c_library import PARTS, TABLES, Unit

N = 3
OK, MORE, NULL, NO_UNIT, SIZE, PARAMETER, ORDER, PART, NAME, WRITABLE, FINITE, DIVERGED = (
    *(0, 1, -1, -2, -4, -9, -10, -11, -12, -13, -14, -15),
)
WRONG_STATE, CHECKSUM, OF_ANOTHER, NOT_A_BLOB = -16, -7, -6, -5
WORDS = {
    NULL: "a pointer is null",
    SIZE: "a buffer has the wrong size",
    ORDER: "wrong order of calls: srm_start comes first, srm_reset goes back",
    PART: "this part of a drive has no such function or table",
    NAME: "no entry has this name or index",
    WRITABLE: "this table can only be read",
    FINITE: "a number is not finite",
    PARAMETER: "a number cannot be what it is meant for",
}
of_each_part = pytest.mark.parametrize("part", PARTS)


class Calls(Unit):
    """A unit whose calls answer with their status."""

    def __init__(self, part="drive", record=None):
        super().__init__(small_library.compiled(), small_library.content(record), part)
        self.part = part

    def told(self, call, *arguments):
        """The status, and what is said where it is an error."""
        status = getattr(self.lib, f"srm_{call}")(self.handle, *arguments)
        return (status, self.lib.srm_last_error().decode()) if status < 0 else (status, "")

    def status(self, call, *arguments):
        status, said = self.told(call, *arguments)
        assert said.startswith(WORDS.get(status, "")), said
        return status

    def count(self, table):
        """Of its entries; none where the part has no such table."""
        found = ctypes.c_int32(-7)
        status = self.status("count", TABLES.index(table), ctypes.byref(found))
        assert status in (OK, PART) and (found.value >= 0) == (status == OK)
        return max(found.value, 0)


def room(count):
    """For so many numbers, each of them -7."""
    return np.full(max(count, 1), -7.0)


@of_each_part
def test_tables_have_the_names_of_their_columns(part):
    """The plant's are of the drive and of the stage, the states of the drive and the controller."""
    unit, phases = Calls(part), range(N)
    plant = part != "controller"
    order = [f"leg_{j}" for j in range(5)] + ["gate", "chop"] + [f"t_edge_{j}" for j in range(4)]
    order += ["i_ref", "i_band", "theta_on", "theta_off"]
    order += ["i_lower", "i_centre", "i_upper", "i_runaway"]
    inputs = [] if part == "stage" else ["reference", "enable", "clear"]
    assert unit.names("input") == inputs + ["u_dc", "omega_m"] * plant
    assert unit.count("leg") == N * plant
    if plant:
        head = ["t", "theta_m", "omega_m", "u_dc", "tau_ref", "tau"]
        each = ("i", "i_ref", "leg", "u", "psi", "tau_ph")
        assert unit.names("waveform") == head + [f"{name}_{k}" for name in each for k in phases]
        assert unit.names("leg") == [f"leg_{k}" for k in phases]
        assert unit.names("period")[:5] == ["t", "theta_m", "omega_m", "W_f", "W_dc"]
        assert unit.names("period") == unit.names("last_period")
    else:
        assert not any(unit.count(name) for name in ("waveform", "period", "last_period", "leg"))
    seen = [*(f"i_{k}" for k in phases), "theta_e", "omega_m", "u_dc", "i_source"]
    assert unit.names("measurement") == seen
    given = [f"{name}_{k}" for k in phases for name in order]
    assert unit.names("order") == [*given, "at_once", *["tau_ref"] * (part != "stage")]
    states = ["t", "mode", "status", "phase", "value", "limit"]
    states += ["gate_enable", "precharged", "chopper"]
    if part == "stage":
        assert unit.count("states") == 0
    else:
        assert unit.names("states") == states
    names = unit.names("parameter")
    assert len({*names}) == len(names)
    for name in (
        *("plant.R", "plant.machine.N_r", "t_dead", "sampling.T_s", "reference.value_0", "theta_m"),
        *("plant.source.u_dc.t_0", "control.drive.control.control.law.i_band"),
        *("resolution.scale.i", "control.supervision.T_s"),
    ):
        assert name in names
    assert not any(name.startswith(".") or ".." in name or name.endswith(".") for name in names)
    unit.free()


@of_each_part
def test_each_entry_is_found_read_and_counted(part):
    unit = Calls(part).start()
    index, value, name = ctypes.c_int32(), ctypes.c_double(), ctypes.c_char_p()
    for n, table in enumerate(TABLES):
        count = unit.count(table)
        row = room(count)
        wrong = PART if not count and table != "input" else None
        assert unit.status("read", n, row.ctypes.data, count) == (wrong or OK)
        for size in (count - 1, count + 1):
            if size >= 0:
                other = room(count + 1)
                told = unit.status("read", n, other.ctypes.data, size)
                assert told == (wrong or SIZE) and (other == -7).all()
        assert unit.status("read", n, None, count) == (wrong or NULL)
        assert unit.status("count", n, None) == (wrong or NULL)
        for j in range(count):
            assert unit.status("name", n, j, ctypes.byref(name)) == OK
            assert unit.status("find", n, name.value, ctypes.byref(index)) == OK
            first = unit.names(table).index(name.value.decode())  # one name stands once
            assert index.value == j == first
            assert unit.status("get", n, j, ctypes.byref(value)) == OK
            assert value.value == row[j] or np.isnan(row[j])
        for j in (-1, count, 1 << 30):
            value.value = -7
            assert unit.status("get", n, j, ctypes.byref(value)) == (wrong or NAME)
            assert unit.status("name", n, j, ctypes.byref(name)) == (wrong or NAME)
            assert unit.status("set", n, j, 1.0) == (wrong or NAME)
            assert value.value == -7
        assert unit.status("find", n, None, ctypes.byref(index)) == (wrong or NULL)
        if count:
            assert unit.status("get", n, 0, None) == unit.status("name", n, 0, None) == NULL
            assert unit.status("find", n, b"R", None) == NULL
            told = unit.told("find", n, b"x" * 300, ctypes.byref(index))
            assert told == (NAME, f"{WORDS[NAME]}: {'x' * 100}")
    for n in (-1, len(TABLES), 1 << 30):
        assert unit.told("count", n, ctypes.byref(index)) == (NAME, f"{WORDS[NAME]}: table")
    unit.free()


def test_every_status_has_words_of_its_own():
    text = small_library.compiled().srm_text
    words = {n: text(n).decode() for n in range(1, -19, -1)}
    assert len({*words.values()}) == len(words) and "unknown status" not in words.values()
    assert all(words[n] == said for n, said in WORDS.items()) and words[0] == "no error"
    assert text(2) == text(-19) == text(1 << 30) == b"unknown status"
    assert small_library.compiled().srm_version() == 1


def test_what_an_error_says_stays_until_the_next_one():
    unit = Calls()
    index = ctypes.c_int32()
    said = unit.told("find", 0, b"y" * 99, ctypes.byref(index))[1]
    assert said == f"{WORDS[NAME]}: {'y' * 99}"
    status, said = unit.told("find", 0, b"", ctypes.byref(index))
    assert (status, said) == (NAME, WORDS[NAME])
    assert unit.status("reset") == OK and unit.lib.srm_last_error().decode() == said  # it stays
    unit.free()


def test_parts_have_numbers_and_no_others():
    lib, content = small_library.compiled(), small_library.content()
    handle = ctypes.c_uint32(9)
    for part in (-1, 3):
        assert lib.srm_create(content, len(content), part, ctypes.byref(handle)) == PART
        assert handle.value == 0
    for part in range(3):
        assert lib.srm_create(content, len(content), part, ctypes.byref(handle)) == OK
        assert handle.value != 0 and lib.srm_free(handle) == OK
        assert lib.srm_free(handle) == NO_UNIT


def checksummed(content):
    """By FNV-1a over all other bytes."""
    value = 14695981039346656037
    for byte in content[:80] + content[88:]:
        value = (value ^ byte) * 1099511628211 % 2**64
    return content[:80] + value.to_bytes(8, "little") + content[88:]


def created(content):
    """The status of a blob, and what is said of it."""
    lib, handle = small_library.compiled(), ctypes.c_uint32()
    status = lib.srm_create(content, len(content), 0, ctypes.byref(handle))
    if status == OK:
        lib.srm_free(handle)
        return status, ""
    return status, lib.srm_last_error().decode()


def test_a_blob_has_as_many_numbers_as_its_fields():
    for wrong in (small_library.content()[:-8], small_library.content() + bytes(8)):
        status, said = created(checksummed(wrong))
        assert status == NOT_A_BLOB and said.endswith("one that is cut off: numbers")


@pytest.mark.parametrize("value", [-1.0, 0.5, 1e15])
def test_a_table_is_as_long_as_what_is_left_can_hold(value):
    """Wherever a length stands, another one is told, and nothing is laid out for it."""
    content, told = small_library.content(), []
    for j in range(88, len(content), 8):
        if content[j : j + 8] == struct.pack("<d", 1.0):  # the length of a constant
            wrong = content[:j] + struct.pack("<d", value) + content[j + 8 :]
            told.append(created(checksummed(wrong)))
    assert {status for status, _ in told} <= {OK, NOT_A_BLOB, OF_ANOTHER, PARAMETER}
    assert sum(said.endswith("numbers") for _, said in told) >= 8


@of_each_part
def test_before_the_start_there_are_parameters_and_inputs_alone(part):
    unit = Calls(part)
    value, size, reached = ctypes.c_double(-7), ctypes.c_size_t(9), ctypes.c_double(-7)
    plant = part != "controller"
    for n, table in enumerate(TABLES):
        if count := unit.count(table):
            early = ORDER if n > 1 else OK
            assert unit.status("read", n, room(count).ctypes.data, count) == early
            assert unit.status("get", n, 0, ctypes.byref(value)) == early
            taken = table in ("waveform", "period", "states")
            told = unit.status("take", n, room(9000).ctypes.data, 100, ctypes.byref(size))
            assert told == (ORDER if taken else PART) and size.value == 0
    state = room(100_000)
    assert unit.status("state_size", ctypes.byref(size)) == OK
    assert unit.status("state_size", None) == NULL
    assert unit.status("save", state.ctypes.data, size) == ORDER and (state == -7).all()
    assert unit.status("restore", state.ctypes.data, size) == ORDER
    assert unit.status("advance", 1.0, ctypes.byref(reached)) == (ORDER if plant else PART)
    assert unit.status("sample") == (PART if part == "drive" else ORDER)
    assert reached.value == -7
    assert unit.status("start") == OK
    assert unit.status("start") == ORDER
    R = unit.names("parameter").index("plant.R")
    assert unit.told("set", 0, R, 1.0) == (ORDER, f"{WORDS[ORDER]}: parameters, after srm_start")
    assert unit.status("reset") == OK and unit.status("set", 0, R, 1.0) == OK
    assert unit.get("parameter", "plant.R") == 1.0
    unit.free()


def test_time_goes_forward_and_is_told_where_it_moved():
    unit = Calls().start()
    reached = ctypes.c_double(-7)
    for t in (np.nan, np.inf):
        assert unit.told("advance", t, ctypes.byref(reached)) == (
            FINITE,
            f"{WORDS[FINITE]}: t_stop",
        )
    assert reached.value == -7
    assert unit.status("advance", 1e-3, None) == OK
    assert unit.status("advance", 1e-3, ctypes.byref(reached)) == OK and reached.value == 1e-3
    told = unit.told("advance", 0.9e-3, ctypes.byref(reached))
    assert told == (PARAMETER, f"{WORDS[PARAMETER]}: t_stop is in the past")
    assert reached.value == 1e-3 and unit.get("waveform", "t") == 1e-3
    unit.free()


def test_rows_wait_until_there_is_room_for_all_of_them():
    """The start of the first period, and each end: 10 ms at 1500 rpm with four rotor poles."""
    unit = Calls(record=0.0).start()
    count, n = ctypes.c_size_t(9), TABLES.index("period")
    unit.check(unit.lib.srm_advance(unit.handle, 0.025, None))
    rows = room(5 * unit.count("period"))
    where = unit.names("period").index("t")
    for given, capacity, status in (
        *((rows.ctypes.data, 2, SIZE), (None, 0, SIZE), (None, 1, NULL)),
        *((rows.ctypes.data, 3, OK), (None, 0, OK)),
    ):
        told, said = unit.told("take", n, given, capacity, ctypes.byref(count))
        assert told == status
        assert status != SIZE or said == f"{WORDS[SIZE]}: rows that wait"
        assert count.value == (3 if given and status == OK else count.value)
        assert status == NULL or count.value == (3 if given and status == OK else 0)
    t = rows[: 3 * unit.count("period")].reshape(3, -1)[:, where]
    assert t == pytest.approx([0, 0.01, 0.02], abs=1e-6)
    assert unit.get("last_period", "t") == t[2] and unit.get("period", "t") == 0.025
    assert unit.status("take", n, rows.ctypes.data, 5, None) == NULL
    unit.free()


@pytest.mark.parametrize(("record", "rows"), [(None, 0), (-1e-9, 0), (0.0, 50), (1e-4, 10)])
def test_waveforms_are_recorded_as_the_parameter_says(record, rows):
    unit = Calls()
    if record is not None:
        unit.set("parameter", "resolution.record_every", record)
    unit.start().check(unit.lib.srm_advance(unit.handle, 1e-3, None))
    taken = unit.take("waveform")
    assert len(taken) >= rows if rows == 50 else len(taken) in (rows, rows + 1)
    unit.free()


@of_each_part
def test_each_table_is_written_by_the_part_that_reads_it(part):
    unit = Calls(part).start()
    writable = {"input": True, "measurement": part == "controller"}
    writable |= dict.fromkeys(("order", "leg"), part == "stage")
    for n, table in enumerate(TABLES):
        if not (count := unit.count(table)):
            continue
        row = unit.read(table)
        told = unit.status("write", n, row.ctypes.data, count)
        expected = ORDER if table == "parameter" else OK if writable.get(table) else WRITABLE
        assert told == unit.status("set", n, 0, row[0]) == expected
        assert unit.status("write", n, None, count) == NULL
        assert unit.status("write", n, row.ctypes.data, count - 1) == SIZE
        row[-1] = np.nan
        name = unit.names(table)[-1]
        for call in (("write", n, row.ctypes.data, count), ("set", n, count - 1, np.inf)):
            assert unit.told(*call) == (FINITE, f"{WORDS[FINITE]}: {name}")
    unit.free()


@pytest.mark.parametrize(
    ("table", "name", "good", "bad"),
    [
        ("leg", "leg_1", (-1, 0, 1), (-2, 2, 0.5)),
        ("order", "leg_4_2", (-1, 0, 1), (-2, 2, 0.5, 2147483648.0, 1e300)),
        ("order", "gate_0", (0, 1, 2, 3), (-1, 4, 1.5)),
        ("order", "at_once", (0, 1), (-1, 2, 0.5)),
        ("order", "i_band_1", (0, 1e-300, 5), (-1e-300,)),
    ],
)
def test_an_order_is_one_of_what_it_can_be(table, name, good, bad):
    stage = Calls("stage").start()
    n, j = TABLES.index(table), stage.names(table).index(name)
    for value in good:
        assert stage.status("set", n, j, value) == OK and stage.get(table, name) == value
    last = stage.read("order")
    for value in bad:
        told = "i_band" if name.startswith("i_band") else name
        assert stage.told("set", n, j, value) == (PARAMETER, f"{WORDS[PARAMETER]}: {told}")
        assert (stage.read("order") == last).all()
    stage.free()


def test_edges_of_an_order_do_not_fall():
    stage = Calls("stage").start()
    order = stage.read("order")
    at = [stage.names("order").index(f"t_edge_{j}_1") for j in range(4)]
    n = TABLES.index("order")
    for edges, fine in (
        *(((0, 0, 1e-6, 1e-6), True), ((1e-6, 2e-6, 3e-6, 4e-6), True)),
        *(((-1e-9, 0, 0, 0), False), ((2e-6, 1e-6, 3e-6, 4e-6), False)),
        ((1e-6, 2e-6, 3e-6, 2.9e-6), False),
    ):
        order[at] = edges
        told = stage.told("write", n, order.ctypes.data, len(order))
        fault = f"{WORDS[PARAMETER]}: t_edge: need edges that do not fall"
        assert told == ((OK, "") if fine else (PARAMETER, fault))
    assert stage.read("order")[at].tolist() == [1e-6, 2e-6, 3e-6, 4e-6]
    assert stage.status("set", n, at[0], 5e-6) == OK  # who sets one by one passes through these
    assert stage.told("sample") == (PARAMETER, fault)
    for j, edge in zip(at[1:], (6e-6, 7e-6, 8e-6), strict=True):
        assert stage.status("set", n, j, edge) == OK
    assert stage.status("sample") == OK
    stage.free()


@pytest.mark.parametrize(
    ("name", "good", "bad"),
    [
        ("plant.machine.N_r", (1, 6), (4.5, 2147483648.0, -2147483648.0 * 2)),
        ("sampling.adc_bits", (0, 12), (0.5,)),
        ("plant.shaft.rotation", (0, 1), (-1.5, 0.5, 9)),
    ],
)
def test_a_parameter_that_cannot_be_keeps_its_value(name, good, bad):
    unit = Calls()
    j = unit.names("parameter").index(name)
    for value in good:
        assert unit.status("set", 0, j, value) == OK and unit.read("parameter")[j] == value
    for value in bad:
        assert unit.told("set", 0, j, value) == (PARAMETER, f"{WORDS[PARAMETER]}: {name}")
        assert unit.read("parameter")[j] == good[-1]
    unit.free()


@of_each_part
def test_a_state_is_of_its_size_its_part_and_its_drive(part):
    unit = Calls(part).start()
    size, more = ctypes.c_size_t(), ctypes.c_size_t()
    unit.status("state_size", ctypes.byref(size))
    state = np.zeros(size.value + 1, np.uint8)
    at = state.ctypes.data
    for less in (size.value - 1, size.value + 1):
        assert unit.status("save", at, less) == unit.status("restore", at, less) == SIZE
    assert unit.status("save", None, size) == unit.status("restore", None, size) == NULL
    assert unit.status("save", at, size) == OK and state[-1] == 0
    for other in {*PARTS} - {part}:
        of = Calls(other).start()
        of.status("state_size", ctypes.byref(more))
        told = of.status("restore", at, size)
        assert told == (WRONG_STATE if more.value == size.value else SIZE)
        of.free()
    for j in (8, size.value // 2, size.value - 1):
        state[j] ^= 1
        assert unit.status("restore", at, size) == CHECKSUM
        state[j] ^= 1
    assert unit.status("restore", at, size) == OK
    unit.free()


@pytest.mark.parametrize("u", [0.0, -0.0, -5.0])
def test_a_link_that_is_held_at_no_voltage_is_refused(u):
    """A run would never end there, whether it is an input or a parameter from before the start."""
    unit = Calls()
    place = unit.names("parameter").index("plant.source.u_dc.value_0")
    assert unit.status("set", TABLES.index("parameter"), place, u) == OK
    told = f"{WORDS[PARAMETER]}: u_dc of the source"
    assert unit.told("start") == (PARAMETER, told)
    unit.free()
    unit = Calls().start()
    n, j = TABLES.index("input"), unit.names("input").index("u_dc")
    before = unit.read("input").copy()
    assert unit.told("set", n, j, u) == (PARAMETER, told)
    assert (unit.read("input") == before).all()
    assert unit.status("set", n, j, 1e-3) == unit.status("advance", 1e-4, None) == OK
    unit.free()


def test_a_voltage_without_meaning_ends_a_run():
    """From 1e9 V on, and not below."""
    for u, status in ((0.9e9, OK), (1e9, DIVERGED), (1.1e9, DIVERGED)):
        stage = Calls("stage")
        stage.set("input", "u_dc", u)
        stage.start()
        assert stage.status("advance", 1e-6, None) == status
        stage.free()
