"""Parameters of a firmware package at run time: ranges, image, and the same bits as a drive file
that has the value."""

import ctypes
import zlib

import numpy as np
import pytest
from firmware_tools import Native, drive
from hypothesis import given as any_given
from hypothesis import settings
from hypothesis import strategies as st

from reluctance import _core
from reluctance.base.units import to_si
from reluctance.targets.export.package import described
from reluctance.targets.export.recording import record
from reluctance.targets.export.run_time import run_time_parameters

OK, UNKNOWN, OUT_OF_RANGE, DAMAGED, OTHER_DRIVE = range(5)
TORQUE, SPEED = "deadbeat", "paper_mpc_speed_loop"


class Parameter(ctypes.Structure):
    """reluctance_parameter."""

    _fields_ = (
        ("name", ctypes.c_char_p),
        ("unit", ctypes.c_char_p),
        *((n, ctypes.c_float) for n in ("least", "most", "built")),
    )


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    """A drive's package on the desk, compiled once."""
    made = {}

    def package(name, **changed):
        key = (name, *sorted(changed.items()))
        if key not in made:
            given = drive(name).with_values({k.replace("__", "."): v for k, v in changed.items()})
            made[key] = Native(given, tmp_path_factory.mktemp("parameters"))
        return made[key].again()

    return package


def parameters(name):
    given = drive(name)
    return run_time_parameters(given, described(given))


@pytest.mark.parametrize("name", [TORQUE, SPEED, "angles", "sun_cloud"])
def test_the_package_tells_the_parameters_of_the_drive_file(compiled, name):
    library, listed = compiled(name).library, parameters(name)
    assert library.reluctance_parameter_count() == len(listed) == len({p.name for p in listed})
    for number, wanted in enumerate(listed):
        told = Parameter()
        assert library.reluctance_parameter_describe(number, ctypes.byref(told)) == OK
        assert (told.name.decode(), told.unit.decode()) == (wanted.name, wanted.unit)
        for field in ("least", "most", "built"):
            assert getattr(told, field) == np.float32(getattr(wanted, field))
        assert told.least <= told.built <= told.most
        assert library.reluctance_parameter_find(told.name) == number
        assert compiled(name).get(wanted.name) == told.built
    for number in (-1, len(listed)):
        assert library.reluctance_parameter_describe(number, ctypes.byref(told)) == UNKNOWN
    assert library.reluctance_parameter_find(b"torque") == -1


def test_a_value_out_of_range_is_refused_and_the_old_one_stays(compiled):
    package = compiled(TORQUE)
    for p in parameters(TORQUE):
        least, most = np.float32(p.least), np.float32(p.most)
        for value in (np.nextafter(least, -np.inf), np.nextafter(most, np.inf), np.nan, np.inf):
            assert package.set(p.name, value) == OUT_OF_RANGE
            assert package.get(p.name) == np.float32(p.built)
        for value in (least, most):
            assert package.set(p.name, value) == OK
            assert package.get(p.name) == value
    assert package.set("no_such", 1.0) == UNKNOWN


def test_reset_leaves_the_parameters_and_init_gives_those_of_the_drive_file(compiled):
    package = compiled(TORQUE)
    assert package.set("torque_limit", 12.5) == OK
    state = ctypes.c_void_p(package.state.ctypes.data)
    package.library.reluctance_reset(state)
    assert package.get("torque_limit") == 12.5
    package.library.reluctance_init(state)
    assert package.get("torque_limit") == np.float32(drive(TORQUE).tau_max)


def image_of(package):
    image = np.zeros(len(parameters(TORQUE)) + 4, np.uint32)
    call(package.library.reluctance_parameter_save, package, image)
    return image


def call(function, package, image):
    return function(*(ctypes.c_void_p(a.ctypes.data) for a in (package.state, image)))


def with_crc(image):
    image[-1] = zlib.crc32(image[:-1].tobytes())
    return image


def test_an_image_keeps_the_set_and_carries_fingerprint_and_crc(compiled):
    package = compiled(TORQUE)
    assert package.set("torque_limit", 12.5) == package.set("current_limit", 55.0) == OK
    image = image_of(package)
    package.library.reluctance_fingerprint.restype = ctypes.c_uint32
    assert image[1] == package.library.reluctance_fingerprint()
    assert image[-1] == zlib.crc32(image[:-1].tobytes())
    package.again()
    assert call(package.library.reluctance_parameter_load, package, image) == OK
    assert (package.get("torque_limit"), package.get("current_limit")) == (12.5, 55.0)


@settings(max_examples=50)
@any_given(bit=st.integers(0, 32 * (len(parameters(TORQUE)) + 4) - 1))
def test_one_wrong_bit_of_an_image_is_refused_and_nothing_changes(compiled, bit):
    package = compiled(TORQUE)
    package.set("torque_limit", 12.5)
    image = image_of(package)
    image[bit // 32] ^= np.uint32(1 << bit % 32)
    before = image_of(package.again())
    assert call(package.library.reluctance_parameter_load, package, image) == DAMAGED
    assert np.array_equal(image_of(package), before)


def test_an_image_of_other_parameters_or_with_a_value_out_of_range_is_refused(compiled):
    package = compiled(TORQUE)
    load = package.library.reluctance_parameter_load
    before = image_of(package)
    for word in (0, 1, 2):
        image = before.copy()
        image[word] += 1
        assert call(load, package, with_crc(image)) == OTHER_DRIVE
    image = before.copy()
    image[3] = np.float32(1e6).view(np.uint32)
    assert call(load, package, with_crc(image)) == OUT_OF_RANGE
    assert np.array_equal(image_of(package), before)


def test_the_image_of_another_drive_with_the_same_parameters_is_refused(compiled):
    """Its values would be in range: gains of a pump in a fan."""
    package, other = compiled(TORQUE), compiled(TORQUE, control__torque_limit_Nm=30.0)
    image = image_of(other)
    assert len(image) == len(image_of(package))
    assert call(package.library.reluctance_parameter_load, package, image) == OTHER_DRIVE
    assert package.get("torque_limit") == np.float32(drive(TORQUE).tau_max)


# Parameter, value in SI, and the drive file that says the same.
IN_THE_STEP = [
    (TORQUE, "torque_limit", 20.0, "control.torque_limit_Nm", 20.0),
    (TORQUE, "current_limit", 60.0, "control.current_limit_A", 60.0),
    ("paper_mpc", "current_limit", 60.0, "control.current_limit_A", 60.0),
    ("edge_mpc_late", "current_limit", 70.0, "control.current_limit_A", 70.0),
    (SPEED, "torque_limit", 25.0, "control.torque_limit_Nm", 25.0),
    (SPEED, "speed_gain", 1.25, "control.K_p_Nms", 1.25),
    (SPEED, "speed_rate", to_si(1500.0, "rpmps"), "control.speed_rate_rpmps", 1500.0),
]


@pytest.mark.parametrize("name, parameter, value, key, in_file", IN_THE_STEP)
def test_the_step_gives_the_bits_of_a_simulation_that_has_the_value(
    compiled, name, parameter, value, key, in_file
):
    changed = record(drive(name).with_values({key: in_file}), steps=3000)
    package = compiled(name)
    assert package.set(parameter, value) == OK
    assert_same_bits(package, changed)
    built = record(drive(name), steps=3000)
    assert not np.array_equal(built.commands, changed.commands)


def assert_same_bits(package, recording):
    for sample, wanted in zip(recording.samples, recording.commands, strict=True):
        *i, theta_e, omega_m, u_dc, i_source, reference = sample.tolist()
        y = _core.Measurement(i=i, theta_e=theta_e, omega_m=omega_m, u_dc=u_dc, i_source=i_source)
        row = package.step(y, reference)
        assert np.array(row, np.float32).tobytes() == wanted.tobytes()


# Of the states and the protection: readings that show the value, from a healthy run on.
AROUND_THE_STEP = [
    ("speed_limit", to_si(1600.0, "rpm"), "protection__speed_limit_rpm", 1600.0),
    ("command_timeout", 0.004, "protection__command_timeout_ms", 4.0),
    ("precharge_time", 0.01, "protection__precharge_max_s", 0.01),
    ("ready_voltage", 200.0, "protection__u_ready_V", 200.0),
    ("current_trip", 160.0, "protection__i_trip_A", 160.0),
    ("under_voltage", 150.0, "protection__u_dc_min_V", 150.0),
    ("over_voltage", 270.0, "protection__u_dc_max_V", 270.0),
    ("over_speed", to_si(1700.0, "rpm"), "protection__speed_max_rpm", 1700.0),
    ("angle_slack", to_si(25.0, "deg"), "protection__angle_slack_deg", 25.0),
]


def scene(parameter):
    """Readings and requests: the dc link rises, the drive runs, then what the parameter is for."""
    T_s, N_r = drive(TORQUE).control.T_s, drive(TORQUE).machine.N_r
    theta_e, sequence = 0.0, 0
    for n in range(4900):
        late = n > 4400
        omega_m = to_si(1300.0 + (0.8 * (n - 4100) if n > 4100 else 0.0), "rpm")
        u_dc = min(1.0 * n, 240.0)
        i = 0.0
        sequence += 0 if late and parameter == "command_timeout" else 1
        if late and parameter == "current_trip":
            i = 170.0
        if late and parameter == "under_voltage":
            u_dc = 140.0
        if late and parameter == "over_voltage":
            u_dc = 280.0
        if not (late and parameter == "angle_slack"):
            theta_e = (theta_e + N_r * omega_m * T_s) % (2 * np.pi)
        reference = 20.0 if late and parameter == "speed_limit" else 0.0
        yield ([i, 0.0, 0.0], theta_e, omega_m, u_dc, 0.0), (1, 0, 0, sequence, reference)


@pytest.mark.parametrize(
    "parameter, value, key, in_file",
    [
        *AROUND_THE_STEP[:3],
        *(pytest.param(*case, marks=pytest.mark.long) for case in AROUND_THE_STEP[3:]),
    ],
)
def test_the_states_go_as_those_of_a_drive_file_that_has_the_value(
    compiled, parameter, value, key, in_file
):
    def story(package):
        rows = []
        for sample, request in scene(parameter):
            package.run(sample, request)
            fault = package.fault()
            rows.append((package.outputs["mode"][0], fault.status, package.command.tobytes()))
        return rows

    package = compiled(TORQUE)
    as_built = story(package)
    package.again()
    assert package.set(parameter, value) == OK
    at_run_time = story(package)
    in_the_file = story(compiled(TORQUE, **{key: in_file}))
    assert at_run_time == in_the_file
    assert at_run_time != as_built
