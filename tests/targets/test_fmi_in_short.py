"""The functions of FMI 2.0 and 3.0, called as an importer that makes mistakes calls them: one small
library of both versions, with what each call answers and what it tells the log."""

import ctypes
from pathlib import Path

import pytest
import small_library
from c_library import PARTS, TABLES, Unit
from small_library import T_S

from reluctance import ParameterError
from reluctance.targets.export.fmu_variables import RENAMED, variables

OK, DISCARD, ERROR = 0, 2, 3  # of both versions
LOG = {
    2: ctypes.CFUNCTYPE(
        None, *[ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int], *[ctypes.c_char_p] * 3
    ),
    3: ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int, *[ctypes.c_char_p] * 2),
}
POINTER, SIZE, INT, DOUBLE = ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int, ctypes.c_double
each_version = pytest.mark.parametrize("version", [2, 3])


class Callbacks(ctypes.Structure):
    _fields_ = (("logger", LOG[2]), *((name, POINTER) for name in ("a", "b", "c", "environment")))


@pytest.fixture(scope="module")
def lib():
    return small_library.compiled()


class Instance:
    """Of one version, by hand; `told` is its log."""

    def __init__(self, lib, version, part="drive", content=None, token=b"this drive", kind=1):
        self.lib, self.version, self.told = lib, version, []
        self.content = small_library.content() if content is None else content
        lib.use(self.content, SIZE(len(self.content)), PARTS[part])
        if version == 2:
            self.log = LOG[2](lambda *said: self.told.append((said[1], said[2], said[5].decode())))
            callbacks = Callbacks(logger=self.log)
            made = (b"name", kind, token, b"", ctypes.byref(callbacks), 0, 0)
            make = lib.fmi2Instantiate
        else:
            self.log = LOG[3](lambda *said: self.told.append((b"name", said[1], said[3].decode())))
            made = (b"name", token, b"", *[False] * 4, None, SIZE(0), None, self.log, None)
            make = lib.fmi3InstantiateCoSimulation
        make.restype = POINTER
        self.at = make(*made)
        unit = Unit(lib, small_library.content(), part)
        self.names = {}
        for table in TABLES:
            try:
                self.names[table] = unit.names(table)
            except RuntimeError:  # of another part
                self.names[table] = []
        unit.free()

    def call(self, name, *arguments):
        """A function of this version by its name without the version."""
        return getattr(self.lib, f"fmi{self.version}{name}")(POINTER(self.at), *arguments)

    def start(self, t_start=0.0):
        if self.version == 2:
            status = self.call("SetupExperiment", 0, DOUBLE(0), DOUBLE(t_start), 0, DOUBLE(0))
            assert self.call("EnterInitializationMode") == OK
        else:
            given = (False, DOUBLE(0), DOUBLE(t_start), False, DOUBLE(0))
            status = self.call("EnterInitializationMode", *given)
        return status or self.call("ExitInitializationMode")

    def reference(self, table, name):
        return 65536 * TABLES.index(table) + self.names[table].index(name) + 1

    def _values(self, what, references, values, kind, count=None):
        n = len(references)  # what is behind them is none of theirs
        refs = (ctypes.c_uint32 * (n + 1))(*references, 65536 * TABLES.index("waveform") + 1)
        row = (kind * n)(*values)
        names = {2: {DOUBLE: "Real", INT: "Integer"}, 3: {DOUBLE: "Float64", INT: "Int32"}}
        more = () if self.version == 2 else (SIZE(n if count is None else count),)
        status = self.call(what + names[self.version][kind], refs, SIZE(n), row, *more)
        return status, list(row)

    def get(self, *references, kind=DOUBLE, **given):
        return self._values("Get", references, [-7] * len(references), kind, **given)

    def set(self, references, values, kind=DOUBLE, **given):
        return self._values("Set", references, values, kind, **given)[0]

    def value(self, table, name):
        status, (value,) = self.get(self.reference(table, name))
        assert status == OK, self.told
        return value

    def step(self, t, h):
        if self.version == 2:
            return self.call("DoStep", DOUBLE(t), DOUBLE(h), 1)
        marks, last = (ctypes.c_bool * 3)(True, True, True), DOUBLE(-7)
        at = [ctypes.byref(marks, j) for j in range(3)]
        status = self.call("DoStep", DOUBLE(t), DOUBLE(h), True, *at, ctypes.byref(last))
        self.event, self.terminate, self.early = marks
        self.last = last.value
        return status

    def saved(self):
        state = POINTER()
        assert (
            self.call(f"GetFMU{'s' if self.version == 2 else 'S'}tate", ctypes.byref(state)) == OK
        )
        return state

    def restore(self, state):
        return self.call(f"SetFMU{'s' if self.version == 2 else 'S'}tate", state)

    def serialized(self, state):
        word = "SerializeFMUstate" if self.version == 2 else "SerializeFMUState"
        size = SIZE()
        self.call(word.replace("ze", "zed", 1) + "Size", state, ctypes.byref(size))
        room = ctypes.create_string_buffer(size.value + 1)
        for less in (1, 0):  # too little by one, and enough
            status = self.call(word, state, room, SIZE(size.value - less))
            assert status == (ERROR if less else OK)
            assert not less or self.told[-1][2] == "too little room for a state"
        return room.raw[: size.value]

    def deserialized(self, content):
        word = "DeSerializeFMUstate" if self.version == 2 else "DeserializeFMUState"
        state = POINTER()
        assert self.call(word, content, SIZE(len(content)), ctypes.byref(state)) == OK
        return state

    def free(self, *states):
        for state in states:
            word = "FreeFMUstate" if self.version == 2 else "FreeFMUState"
            assert self.call(word, ctypes.byref(state)) == OK and state.value is None
        self.call("FreeInstance")


@each_version
@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"token": b"that drive"}, {2: "another GUID", 3: "another token"}),
        ({"token": None}, {2: "another GUID", 3: "another token"}),
        (
            {"content": small_library.content()[:-8]},
            dict.fromkeys((2, 3), "the parameters of the unit are damaged"),
        ),
        ({"kind": 0}, {2: "only co-simulation"}),
    ],
)
def test_what_is_not_of_this_unit_is_not_made(lib, version, given, told):
    if version in told:
        unit = Instance(lib, version, **given)
        assert unit.at is None and unit.told == [(b"name", ERROR, told[version])]
        assert unit.step(0.0, T_S) == unit.get(0)[0] == unit.call("Reset") == ERROR
        if version == 3:
            assert (unit.event, unit.terminate, unit.early, unit.last) == (False, False, False, -7)


@each_version
@pytest.mark.parametrize("part", PARTS)
def test_a_reference_names_an_entry_of_a_table_or_is_refused(lib, version, part):
    """The last entry of each table is there, and the one after it is not; nothing is read past a
    wrong one."""
    unit = Instance(lib, version, part)
    assert unit.start() == OK
    known = unit.reference("parameter", "plant.R")
    for j, table in enumerate(TABLES):
        end = 65536 * j + len(unit.names[table])
        if unit.names[table]:
            assert unit.get(end)[0] == OK
            assert unit.get(end - len(unit.names[table]) + 1)[0] == OK
        assert unit.get(end + 1, known) == (ERROR, [-7, -7])
        assert unit.told[-1][2] == "no variable has this reference"
        assert unit.get(known, end + 1, known)[1] == [0.72, -7, -7]
        assert unit.set([end + 1], [1.0]) == ERROR
        assert unit.told[-1][2] == "no variable has this reference"
    for wrong in (65536 * len(TABLES) + 1, 2**32 - 1):
        assert unit.get(wrong)[0] == unit.set([wrong], [1.0]) == ERROR
    assert unit.set([0], [1.0]) == ERROR
    count = len(unit.told)
    if version == 3:  # as many values as references
        assert unit.get(known, count=2)[0] == unit.set([known], [1.0], count=0) == ERROR
        assert len(unit.told) == count + 2
    unit.free()


@each_version
def test_values_of_both_types_are_read_in_any_order(lib, version):
    unit = Instance(lib, version)
    assert unit.start() == OK
    R, u, N_r = (
        unit.reference(*of)
        for of in (("parameter", "plant.R"), ("input", "u_dc"), ("parameter", "plant.machine.N_r"))
    )
    assert unit.get(R, u, R, 0, N_r, u) == (OK, [0.72, 240, 0.72, 0, 4, 240])
    assert unit.get(N_r, 0, u, kind=INT) == (OK, [4, 0, 240])
    assert unit.set([u], [250], kind=INT) == OK and unit.get(u) == (OK, [250])
    assert unit.set([R], [0.8]) == ERROR  # fixed once it is started
    assert unit.told[-1][2].endswith("parameters, after srm_start")
    unit.free()


@each_version
def test_before_the_start_parameters_may_be_anything_and_outputs_are_those_of_the_start(
    lib, version
):
    """What comes from the state needs numbers that can run; time, parameters and inputs do not. A
    look at the outputs is no start: the parameters can still be set."""
    unit = Instance(lib, version)
    R, u = unit.reference("parameter", "plant.R"), unit.reference("input", "u_dc")
    assert unit.set([R, u], [-1.0, 200.0]) == OK
    assert unit.get(0, u, R) == (OK, [0, 200, -1])
    seen = unit.reference("waveform", "u_dc")
    assert unit.get(0, seen) == (ERROR, [-7, -7]) and unit.told[-1][2].endswith(": R")
    assert unit.start() == ERROR
    assert unit.step(0.0, T_S) == ERROR
    assert unit.told[-1][2] == "step before the end of initialisation"
    assert unit.set([R], [0.5]) == OK and unit.value("waveform", "u_dc") == 200
    assert unit.set([R], [0.6]) == OK and unit.start() == OK
    assert unit.value("parameter", "plant.R") == 0.6
    assert unit.call("ExitInitializationMode") == OK  # it is started already
    assert unit.call("Reset") == OK  # to the values of the file
    assert (unit.value("parameter", "plant.R"), unit.value("input", "u_dc")) == (0.72, 240)
    assert unit.step(0.0, T_S) == ERROR
    unit.free()


@each_version
@pytest.mark.parametrize("part", PARTS)
def test_time_is_the_importers_and_a_step_goes_forward(lib, version, part):
    unit = Instance(lib, version, part)
    assert unit.start(float("inf")) == ERROR
    assert unit.told[-1][2] == "the start time is not finite"
    assert unit.start(3.0) == OK
    for t, h in ((3.0, 0.0), (3.0, -T_S), (3.0, float("nan")), (float("inf"), T_S)):
        assert unit.step(t, h) == ERROR
        assert unit.told[-1][2] == "a step needs a positive length"
    assert unit.step(3.0, 10 * T_S) == OK
    assert unit.get(0)[1] == pytest.approx([3 + 10 * T_S])
    if part != "controller":
        assert unit.value("waveform", "t") == pytest.approx(10 * T_S)
    for wrong, told in ((3.0, "3"), (3.0 + 10.01 * T_S, f"{3 + 10.01 * T_S:.9g}")):
        assert unit.step(wrong, T_S) == ERROR
        at = f"{3 + 10 * T_S:.9g}"
        assert unit.told[-1][2] == f"a step from {told} s, the unit is at {at} s"
    assert unit.step((3.0 + 10 * T_S) * (1 - 1e-12), T_S) == OK
    if version == 3:
        assert unit.last == pytest.approx(3 + 11 * T_S)
        assert (unit.event, unit.terminate, unit.early) == (False, False, False)
    else:
        real, flag = DOUBLE(), INT(7)
        assert unit.call("GetRealStatus", 2, ctypes.byref(real)) == OK
        assert real.value == pytest.approx(3 + 11 * T_S)
        assert unit.call("GetBooleanStatus", 3, ctypes.byref(flag)) == OK and flag.value == 0
        assert unit.call("GetRealStatus", 3, ctypes.byref(real)) == ERROR
        assert unit.call("GetBooleanStatus", 2, ctypes.byref(flag)) == ERROR
    unit.free()


@each_version
def test_a_controller_samples_once_in_each_period_whatever_the_steps(lib, version):
    """Its time is that of its last sample: at 0, T_s, 2 T_s, ... before the end of a step."""
    unit = Instance(lib, version, "controller")
    assert unit.start() == OK
    for steps in (0.4, 0.4, 0.4, 2.5, 0.3, 2.0, 5.0, 0.5, 0.5):  # up to 1.2, 3.7, 4, 6, 11, 12
        before = unit.get(0)[1][0]
        assert unit.step(before, steps * T_S) == OK
        end = unit.get(0)[1][0] / T_S
        assert end == pytest.approx(before / T_S + steps)
        last = -(-round(end, 6) // 1) - 1  # the last multiple before the end
        assert unit.value("states", "t") == pytest.approx(last * T_S, abs=1e-12)
    unit.free()


@each_version
def test_orders_act_on_a_stage_at_its_next_sample(lib, version):
    """Also where rounding leaves the importer a little before it."""
    for early in (0.0, 1e-7):
        unit = Instance(lib, version, "stage")
        assert unit.start() == OK
        leg = unit.reference("leg", "leg_0")
        assert unit.step(0.0, 0.5 * T_S) == OK
        assert unit.set([leg], [1], kind=INT) == OK
        assert unit.step(0.5 * T_S, (0.5 - early) * T_S) == OK
        assert unit.value("waveform", "i_0") == 0
        assert unit.step((1 - early) * T_S, T_S) == OK
        rise = unit.value("waveform", "i_0")
        assert rise == pytest.approx(240 * T_S / 0.67e-3, rel=0.1)  # u t/L_u, less R i
        unit.free()


@each_version
def test_a_stage_that_refused_an_order_samples_in_the_next_step(lib, version):
    """The refused sample is not lost."""
    unit = Instance(lib, version, "stage")
    assert unit.start() == OK
    edges = [unit.reference("order", f"t_edge_{j}_0") for j in range(4)]
    legs = [unit.reference("order", f"leg_{j}_0") for j in range(5)]
    assert unit.set(legs, [1] * 5, kind=INT) == OK
    assert unit.set(edges[3:], [0.5 * T_S]) == OK  # before the others
    assert unit.step(0.0, T_S) == ERROR and "edges that do not fall" in unit.told[-1][2]
    assert unit.set(edges, [0.1 * T_S] * 4) == OK
    assert unit.step(0.0, T_S) == OK
    assert unit.value("waveform", "i_0") == pytest.approx(240 * T_S / 0.67e-3, rel=0.1)
    unit.free()


@each_version
def test_a_step_may_span_many_periods_of_the_machine(lib, version):
    """Of 10 ms each. Rows that nobody takes do not stop it."""
    unit = Instance(lib, version)
    assert unit.start() == OK and unit.step(0.0, 0.035) == OK
    assert unit.value("waveform", "t") == 0.035
    assert unit.value("waveform", "theta_m") == pytest.approx(0.035 * 157.08, rel=1e-3)
    unit.free()


@each_version
def test_a_diverged_unit_asks_for_the_end_until_it_is_reset(lib, version):
    unit = Instance(lib, version, "stage")
    assert unit.start() == OK
    assert unit.step(0.0, -1.0) == ERROR  # a mistake is no end
    assert version == 2 or (unit.terminate, unit.early) == (False, False)
    assert unit.set([unit.reference("input", "u_dc")], [1e12]) == OK
    assert unit.set([unit.reference("leg", "leg_0")], [1], kind=INT) == OK
    assert unit.step(0.0, 50 * T_S) == DISCARD
    assert unit.told[-1][2].startswith("the state has no meaningful numbers any more")
    assert unit.step(50 * T_S, T_S) == DISCARD
    assert unit.told[-1][2] == "the unit has diverged; reset it"
    if version == 3:
        assert (unit.event, unit.terminate, unit.early) == (False, True, True)
    else:
        flag = INT()
        assert unit.call("GetBooleanStatus", 3, ctypes.byref(flag)) == OK and flag.value == 1
    assert unit.call("Reset") == OK and unit.start() == OK and unit.step(0.0, T_S) == OK
    unit.free()


@each_version
@pytest.mark.parametrize("part", PARTS)
def test_a_state_goes_on_as_bytes_in_another_instance(lib, version, part):
    """With its parameters, inputs and time; before its start as well, and of no other unit."""
    unit, other = Instance(lib, version, part), Instance(lib, version, part)
    R = unit.reference("parameter", "plant.R")
    unit.set([R], [0.5])
    new = unit.saved()
    assert unit.start(2.0) == OK
    names = [("order", n) for n in unit.names["order"]] + [("parameter", "plant.R")]
    names += [("waveform", n) for n in unit.names["waveform"]]
    if part == "stage":
        unit.set([unit.reference("leg", "leg_0")], [1], kind=INT)
    assert unit.step(2.0, 3.5 * T_S) == OK
    state = unit.saved()

    def go_on(of):
        assert of.step(2.0 + 3.5 * T_S, 2.7 * T_S) == OK
        return of.get(0, *(of.reference(*name) for name in names))[1]

    expected, content = go_on(unit), unit.serialized(state)
    copied = other.deserialized(content)
    assert other.restore(copied) == OK and other.get(0)[1] == [2.0 + 3.5 * T_S]
    assert go_on(other) == expected
    assert unit.restore(state) == OK and go_on(unit) == expected
    assert unit.restore(new) == OK and unit.get(R)[1] == [0.5]
    assert unit.step(2.0, T_S) == ERROR  # not started any more
    assert unit.restore(POINTER()) == ERROR and unit.told[-1][2] == "no state"
    for wrong, told in (
        (content[:-8], "a state of another unit"),
        (content + bytes(8), "a state of another unit"),
        (bytes([1 - content[0]]) + content[1:], "a damaged state"),
        (content[:-1] + bytes([content[-1] ^ 1]), "the checksum is wrong: the bytes are damaged"),
    ):
        damaged = other.deserialized(wrong)
        assert other.restore(damaged) == ERROR and other.told[-1][2] == told
        other.call("FreeFMUstate" if version == 2 else "FreeFMUState", ctypes.byref(damaged))
    unit.free(new, state)
    other.free(copied)


@pytest.mark.parametrize("part", PARTS)
def test_the_variables_of_a_unit_have_the_names_and_values_of_its_tables(lib, part):
    content, library = small_library.content(), Path(lib._name)
    unit = Unit(lib, content, part).start()
    floats = {*unit.names("parameter")[:3], unit.names("parameter")[-1]}
    found = variables(library, part, content, floats, "torque")
    places = [divmod(variable.reference - 1, 65536) for variable in found]
    assert len({*places}) == len({variable.name for variable in found}) == len(found)
    of_parameters = set()
    for (code, index), variable in zip(places, found, strict=True):
        table = TABLES[code]
        name = unit.names(table)[index]
        assert variable.name.endswith(RENAMED.get((table, name), name))
        if table == "parameter":
            of_parameters.add(name)
        start = None if variable.causality == "output" else unit.read(table)[index]
        assert variable.start == start
    assert of_parameters == floats
    with pytest.raises(ParameterError, match=r"the unit cannot be made: .+"):
        variables(library, part, b"no drive", floats, "torque")
