"""A wrong drive file gives one clear line: what, the value, the need."""

import tomllib
from pathlib import Path

import pytest

import reluctance as rl
from reluctance.drive.drive import drive_from
from reluctance.machine.library import machine_table

EXAMPLES = Path(__file__).parents[2] / "examples"
REMOVED = object()


def tables(**changes):
    """The tables of the rated drive with `section__key=value` replaced or REMOVED."""
    data = tomllib.loads((EXAMPLES / "paper_rated.toml").read_text())
    data["machine"] = dict(machine_table(data["machine"], EXAMPLES))
    for name, value in changes.items():
        section, key = name.split("__")
        table = data.setdefault(section, {})
        if value is REMOVED:
            table.pop(key, None)
        else:
            table[key] = value
    return data


DRIVES = sorted(p for p in EXAMPLES.glob("*.toml") if "[site]" not in p.read_text())


@pytest.mark.parametrize("path", DRIVES, ids=lambda p: p.stem)
def test_every_example_loads(path):
    assert rl.load(path).name == path.stem


SPEED = {
    **{"reference__kind": "speed", "reference__tau_Nm": REMOVED, "load__speed_rpm": REMOVED},
    **{"load__kind": "pump", "load__k_pump_Nms2": 0.0015},
}
PUMP = {"load__kind": "pump", "load__k_pump_Nms2": 0.0015}
FAN = {"load__kind": "fan", "load__k_fan_Nms2": 0.001}
OF_LIBRARY = {
    **{"load__kind": "pump", "load__pump": "synthetic_70_25"},
    **{"load__D_mm": 80.0, "load__H_static_m": 5.0},
}
TRIPS = {
    f"supervision__{key}": value
    for key, value in {"enable_s": 0.0, "fault": "over_current", "fault_s": 0.1}.items()
}
LAW = {f"control__{key}": REMOVED for key in ("N_p", "N_c", "r_w", "w_i", "i_band_A")}
FAULTS = [
    (
        {"converter__u_dc_kV": 0.24},
        "unknown key `u_dc_kV` in [converter]; did you mean `u_dc_V = 240`",
    ),
    ({"control__T_s_s": 2e-5}, "did you mean `T_s_us = 20`"),
    ({"control__T_s_Hz": 50e3}, "did you mean `T_s_us`?"),  # no length of time
    ({"load__T_s_us": 20}, "unknown key `T_s_us` in [load]; remove it, [control] has it"),
    ({"converter__kind": "locked"}, "unknown key `kind` in [converter]; it belongs in [source]"),
    ({"machine__n_r": 4}, "unknown key `n_r` in [machine]"),
    ({"machine__R": 0.7}, "unknown key `R` in [machine]"),
    ({"converter__u_dc": 240.0}, "unknown key `u_dc` in [converter]"),
    ({"converter__u_dc": 240.0, "converter__u_dc_V": REMOVED}, "did you mean `u_dc_V`?"),
    ({"machine__R_ohm": REMOVED}, "missing key `R_ohm` in [machine]"),
    ({"machine__R_ohm": -0.1}, "[machine] R_ohm = -0.1, need >= 0"),
    ({"machine__R_ohm": "0.72"}, "[machine] R_ohm = '0.72', need a number"),
    ({"machine__R_ohm": float("nan")}, "[machine] R_ohm = nan, need"),
    ({"machine__L_a_H": float("inf")}, "[machine] L_a_H = inf, need a finite number"),
    ({"machine__N_r": 0}, "[machine] N_r = 0, need > 0"),
    ({"machine__N_r": 4.5}, "[machine] N_r = 4.5, need a whole number"),
    ({"machine__n_phases": 4}, "6/4 poles make 3 phases"),
    ({"machine__N_r": 6}, "6/6 poles make 1 phases"),
    ({"machine__i_max_A": 0}, "[machine] i_max_A = 0, need > 0"),
    ({"machine__psi_m_Wb": 0.05}, "psi_m_Wb = 0.05, need more than"),
    ({"machine__L_a_H": 0.5e-3}, "L_a_H = 0.0005, need more than L_u_H"),
    # One value in milliunits, or all inductances: each is refused, and the unit is a suspect.
    ({"machine__L_a_H": 23.62}, "L_a_H = 23.62 reaches psi_m_Wb = 0.468 at 0.02 A, need at least"),
    ({"machine__L_u_H": 0.67}, "check the units of all three: inductances are in henry"),
    ({"machine__L_sat_H": 0.15}, "and the units: inductances are in henry, 0.15 for 150 mH"),
    ({"machine__psi_m_Wb": 468}, "psi_m_Wb = 468, need at most L_a_H i_m_A = 10.629"),
    (
        {"machine__L_u_H": 0.67, "machine__L_a_H": 23.62, "machine__L_sat_H": 0.15},
        "and the units: inductances are in henry, 0.15 for 150 mH",
    ),
    ({"converter__u_dc_V": 0}, "[converter] u_dc_V = 0, need > 0"),
    ({"converter__u_dc_V": True}, "[converter] u_dc_V = True, need a number"),
    ({"control__T_s_us": 0}, "[control] T_s_us = 0, need > 0"),
    ({"control__T_s_us": -20}, "[control] T_s_us = -20, need > 0"),
    (
        {"control__T_s_us": 2e-5},
        "a run to 0.2 s takes 1.0e+10 steps of [control] T_s_us = 2e-05, need at most 1e+09",
    ),
    ({"simulation__dt_max_us": 1e-5}, "2.0e+10 steps of [simulation] dt_max_us = 1e-05"),
    ({"control__N_c": 4}, "N_c = 4, need <= N_p = 3"),
    ({"control__N_p": 0}, "[control] N_p = 0, need >= 1"),
    ({"control__r_w": 0}, "[control] r_w = 0, need > 0"),
    ({"control__law": "papper_mpc"}, "did you mean `paper_mpc`?"),
    ({"control__law": REMOVED}, "[control] law = None is unknown"),
    ({"control__i_band_A": 200.0}, "i_band_A = 200"),
    ({"load__kind": "lock"}, "[load] kind = 'lock', need 'locked', 'pump', 'fan' or 'torque'"),
    ({"load__k_pump_Nms2": 0.001}, "k_pump_Nms2 has no effect with kind = 'locked'"),
    ({"load__kind": "pump"}, "kind = 'pump' needs k_pump_Nms2 > 0"),
    ({"reference__kind": "speed"}, "kind = 'speed' takes speed_rpm"),
    ({"reference__tau_Nm": REMOVED}, "need either tau_Nm or t_s and values"),
    ({"reference__tau_Nm": 4000.0}, "out of reach"),
    ({"simulation__until_s": 0}, "[simulation] until_s = 0, need > 0"),
    ({"sensing__adc_bits": 12}, "adc_bits = 12 needs i_range_A > 0"),
    ({"sensing__adc_bits": 12, "sensing__i_range_A": 100.0}, "i_range_A = 100, need at least"),
    (
        {"sensing__encoder_counts": 1024, "sensing__tracker_bandwidth_Hz": 1e6},
        "tracker_bandwidth_Hz = 1e+06, need at most",
    ),
    ({"converter__dead_time_us": 20.0}, "dead_time_us = 20, need less than [control] T_s_us = 20"),
    ({"sensing__delay_samples": 2}, "[sensing] delay_samples = 2, need <= 1"),
    ({"sensing__encoder_counts": 2**31}, "[sensing] encoder_counts = 2147483648, need <="),
    (
        {"source__kind": "battery", "source__R_ohm": 2e-8, "source__C_uF": 4700.0},
        "equalise in less than 0.5 us, need R_ohm >= 0.000106",
    ),
    ({"pumps__k": 1}, "unknown table `pumps`"),
    (
        {"reference__kind": "none", "reference__tau_Nm": REMOVED},
        "needs a torque or speed to follow",
    ),
    ({**SPEED, "reference__speed_rpm": 1500.0}, "missing key `tau_max_Nm`"),
    ({**SPEED, "reference__kind": "pv", "reference__speed_rpm": 1500.0}, "no array to follow"),
    ({"control__tau_max_Nm": 30.0}, "torque 41.339 N m is above [control] tau_max_Nm = 30"),
    ({"reference__tau_Nm": 0.0}, "torque is 0 throughout; set [control] tau_max_Nm"),
    ({"protection__i_trip_A": -1.0}, "[protection] i_trip_A = -1.0, need > 0"),
    ({"sensing__i_gain": [1.0, 1.0]}, "i_gain = [1.0, 1.0] has 2 values, need 3"),
    ({"sensing__i_offset_A": [0.1]}, "i_offset_A = [0.1] has 1 values, need 3"),
    ({"sensing__blank_us": 10.5}, "[sensing] blank_us = 10.5, need at most half of"),
    ({"converter__min_pulse_us": 10.5}, "the dead time added, = 10.5, need at most half"),
    ({"load__t_s": [0.0, 1.0, 0.5], "load__values": [1.0, 2.0, 3.0]}, "need rising times"),
    ({"load__t_s": [0.0, 1.0], "load__values": [1.0]}, "t_s has 2 points, values 1"),
    ({"load__t_s": [0.0], "load__values": [9.0]}, "need either speed_rpm or t_s and values"),
    ({"load__tau_Nm": 1.0}, "tau_Nm has no effect with kind = 'locked'"),
    ({"load__D_mm": 80.0}, "D_mm has no effect with kind = 'locked'"),
    ({**PUMP, "load__D_mm": 80.0}, "D_mm has no effect without `pump`"),
    ({**FAN, "load__t_s": [0.0], "load__values": [9.0]}, "values have no effect with kind = 'fan'"),
    ({**FAN, "load__k_pump_Nms2": 0.1}, "k_pump_Nms2 has no effect with kind = 'fan'"),
    ({**OF_LIBRARY, "load__k_pump_Nms2": 0.1}, "need either k_pump_Nms2 or pump"),
    ({**OF_LIBRARY, "load__D_mm": REMOVED}, "pump needs D_mm"),
    ({**OF_LIBRARY, "load__H_static_m": REMOVED}, "pump needs H_static_m, or t_s and values"),
    (
        {**OF_LIBRARY, "load__H_static_m": REMOVED, "load__t_s": [0.0], "load__values": [-1.0]},
        "need static heads >= 0",
    ),
    ({"source__t_s": [0.0], "source__values": [-240.0]}, "need voltages > 0"),
    ({"source__kind": "battery"}, "kind = 'battery' needs"),
    ({"source__R_ohm": 0.1}, "R_ohm has no effect with kind = 'stiff'"),
    ({**TRIPS, "supervision__fault_phase": "d"}, "need one of the 3 phases"),
    ({"simulation__until_s": 22000.0}, "1.1e+09 steps of [control] T_s_us = 20"),
    ({"converter__u_dc_V": 9.0}, "need at most 10 times [converter] u_dc_V = 9"),
    ({"converter__u_dc_V": 4e6}, "[converter] u_dc_V = 4e+06, need at most"),
    ({"load__speed_rpm": 9e5}, "[load] speed 900000 rpm, need at most"),
    (
        {"control__T_s_us": 9000.0, "load__speed_rpm": 3000.0},
        "[control] T_s_us = 9000, need at most",
    ),
    (
        {**LAW, "control__law": "torque_sharing", "control__theta_on_deg": 30.0},
        "needs both theta_on",
    ),
    (
        {
            **LAW,
            **{"control__law": "torque_sharing", "control__sharing": "optimal"},
            **{"control__theta_on_deg": 30.0, "control__theta_ov_deg": 20.0},
        },
        "sharing = 'optimal' finds its angles itself",
    ),
    (
        {**LAW, "control__law": "angles", "control__i_ref_A": 50.0},
        "without a torque reference needs theta_on_deg",
    ),
    (
        {
            **LAW,
            **{"control__law": "angles", "control__i_ref_A": 151.0},
            **{"control__theta_on_deg": 0.0, "control__theta_off_deg": 150.0},
        },
        "i_ref_A = 151, need <= [machine] i_max_A = 150",
    ),
    (
        {
            **LAW,
            "control__law": "deadbeat",
            "control__learn": True,
            "control__current_limit_A": 99.0,
        },
        "learn = true with current_limit_A = 99",
    ),
]


@pytest.mark.parametrize(("changes", "says"), FAULTS, ids=[" ".join(c) for c, _ in FAULTS])
def test_a_fault_is_named_on_one_line(changes, says):
    with pytest.raises(rl.ParameterError) as fault:
        drive_from(tables(**changes))
    assert says in str(fault.value)
    assert "\n" not in str(fault.value)


@pytest.mark.parametrize("value", ["[]", "{}", "3", "true"])
def test_a_law_that_is_no_text_is_one_line(value):
    with pytest.raises(rl.ParameterError, match="law"):
        rl.load(EXAMPLES / "paper_rated.toml", [f"control.law={value}"])


def test_a_missing_table_is_named():
    data = tables()
    del data["converter"]
    with pytest.raises(rl.ParameterError, match=r"missing table \[converter\]"):
        drive_from(data)


def test_a_table_that_is_a_number_is_named():
    data = tables()
    data["converter"] = 240
    with pytest.raises(rl.ParameterError, match=r"\[converter\] = 240, need a table"):
        drive_from(data)


@pytest.mark.parametrize(
    ("content", "says"),
    [("a = = 1", "not valid TOML"), ("machine = 'nowhere'", "neither a file nor in the library")],
)
def test_an_unusable_file_is_named(tmp_path, content, says):
    path = tmp_path / "drive.toml"
    path.write_text(content)
    with pytest.raises(rl.ParameterError, match=says):
        rl.load(path)


def test_a_system_is_no_drive_file_and_a_torque_far_beyond_the_machine_is_not_meant():
    with pytest.raises(
        rl.ParameterError, match="a pumping system, not a drive file; `reluctance pump"
    ):
        rl.load(EXAMPLES / "sun_day.toml")
    path, given = EXAMPLES / "paper_pump.toml", ["load.kind=torque", "load.k_pump_Nms2="]
    most = 1e4 * rl.load(path).machine.greatest_torque
    assert rl.load(path, [*given, f"load.tau_Nm={0.999 * most!r}"])
    for tau in (1.001 * most, -1.001 * most):
        with pytest.raises(rl.ParameterError, match=r"\[load\] torque .* N m, need at most"):
            rl.load(path, [*given, f"load.tau_Nm={tau!r}"])


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(rl.ParameterError, match="No such file"):
        rl.load(tmp_path / "none.toml")


@pytest.mark.parametrize(
    ("override", "says"),
    [
        ("control.T_s_us", "need section.key=value"),
        ("T_s_us=3", "need section.key=value"),
        ("control.T_us=3", "unknown key `T_us`"),
        ("control.law.x=3", "`law` is not a table"),
        ("control.i_band=", "no such key to remove; did you mean `i_band_A`"),
        ("control.law=", "law = None is unknown"),
        ("control.T_s_us=", "missing key `T_s_us`"),
        ("machine=", "need section.key=value"),
    ],
)
def test_a_wrong_override_is_named(override, says):
    with pytest.raises(rl.ParameterError) as fault:
        rl.load(EXAMPLES / "paper_rated.toml", [override])
    assert says in str(fault.value)


def test_an_override_replaces_a_value():
    drive = rl.load(
        EXAMPLES / "paper_rated.toml",
        ["control.T_s_us=25", "machine.R_ohm=0.5", "control.precision=float"],
    )
    assert drive.control.T_s == pytest.approx(25e-6)
    assert drive.machine.R == 0.5
    assert drive.control.precision == "float"


def test_an_override_sets_a_number_of_a_list_or_adds_the_next():
    rated = EXAMPLES / "paper_rated.toml"
    one = rl.load(rated, [f"sensing.i_offset_A.{k}={k}.5" for k in range(3)])
    assert one.sensing.i_offset_A == [0.5, 1.5, 2.5]
    assert one.with_values({"sensing.i_offset_A.1": -4}).sensing.i_offset_A == [0.5, -4.0, 2.5]
    for key, need in (("4", "`4`, need a number from 0 to 3"), ("b", "`b`, need a number")):
        with pytest.raises(rl.ParameterError, match=need):
            one.with_values({f"sensing.i_offset_A.{key}": 1.0})
    with pytest.raises(rl.ParameterError, match="no number of a list is removed; give all of"):
        one.with_values({"sensing.i_offset_A.1": None})
    with pytest.raises(rl.ParameterError, match="`1`, need 0, the first"):
        rl.load(rated, ["sensing.i_offset_A.1=2"])
    with pytest.raises(rl.ParameterError, match=r"adc_bits = \[1\], need a whole number"):
        rl.load(rated, ["sensing.adc_bits.0=1"])


@pytest.mark.parametrize("empty", ["", " "])
def test_an_override_without_a_value_removes_the_key(empty):
    path = EXAMPLES / "paper_rated.toml"
    given = rl.load(path, ["control.i_band_A=3"])
    removed = rl.load(path, ["control.i_band_A=3", f"control.i_band_A={empty}"])
    assert given.control.i_band_A == 3
    assert removed.control.i_band_A is None
    assert rl.load(path, ['machine.assumed=""']).machine.assumed == ""


def test_resistance_follows_the_winding_temperature():
    drive = drive_from(tables(machine__temp_w_degC=120.0))
    assert pytest.approx(0.72 * 1.393) == drive.machine.R


@pytest.mark.parametrize(
    ("known_at", "run_at"), [(80.0, 20.0), (120.0, 20.0), (20.0, 120.0), (80.0, 80.0), (0.0, 95.0)]
)
def test_a_resistance_known_warm_and_one_known_cold_are_of_one_winding(known_at, run_at):
    """IEC 60028: 0.393 % per kelvin, of the resistance at 20 degC wherever the value is known."""
    drive = drive_from(tables(machine__temp_R_degC=known_at, machine__temp_w_degC=run_at))
    at_20 = 0.72 / (1 + 0.00393 * (known_at - 20.0))
    assert drive.machine.R == pytest.approx(at_20 * (1 + 0.00393 * (run_at - 20.0)), rel=1e-12)


def test_a_resistance_holds_at_its_own_temperature():
    """To the last bit: the tables of the docs hang on it."""
    same = {"machine__temp_R_degC": 100.0, "machine__temp_w_degC": 100.0}
    assert drive_from(tables(**same)).machine.R == 0.72
