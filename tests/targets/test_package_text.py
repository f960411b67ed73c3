"""Text of a firmware package: its constants, its README and the ranges of its parameters have the
numbers of the drive file. Nothing is compiled."""

import re
from pathlib import Path

import numpy as np
import pytest

import reluctance as rl
from reluctance.drive.guard.trip_levels import protection
from reluctance.targets.export import firmware
from reluctance.targets.export.constants import Tables, constant, literal
from reluctance.targets.export.cost import Cost
from reluctance.targets.export.package import described, renamed
from reluctance.targets.export.package_text import gates_of
from reluctance.targets.export.run_time import marks, run_time_parameters, shown
from reluctance.targets.export.verdict import MCUS, mcu, verdict

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"


def drive(name: str, *given: str) -> rl.Drive:
    return rl.load(EXAMPLES / f"{name}.toml", list(given))


def test_words_of_c_read_back_as_what_they_were() -> None:
    assert [literal(v, "x") for v in (True, False, 3, -7, 0.5, 1.0)] == [
        "true", "false", "3", "-7", "0.5F", "1.0F",
    ]  # fmt: skip


def test_a_tree_is_printed_field_by_field_and_a_table_once() -> None:
    tables = Tables()
    numbers = [n / 8 for n in range(50)]
    table = {"table": "float", "values": numbers}
    tree = {
        "fields": {
            "gain": 0.25,
            "kind": {"type": "srm::Leg", "value": 2},
            "axis": [1.0, 2.0],
            "map": table,
            "again": table,
            "none": {"table": "float", "values": []},
            "bytes": {"table": "std::uint8_t", "values": [1, 2, 3]},
            "inner": {"fields": {"on": True}},
        }
    }
    text = constant(tree, tables, "law")
    for line in (
        ".gain = 0.25F,",
        ".kind = static_cast<srm::Leg>(2),",
        ".axis = {{1.0F, 2.0F}},",
        ".map = {table_0, 50},",
        ".again = {table_0, 50},",
        ".none = {nullptr, 0},",
        ".bytes = {table_1, 3},",
        ".on = true,",
    ):
        assert line in text, line
    assert tables.size == 4 * 50 + 3 and len(tables.text) == 2
    printed = tables.text[0]
    assert printed.startswith("// law.map: 50 values.\nRELUCTANCE_TABLE constexpr float table_0[]")
    words = printed.partition("{")[2].rpartition("}")[0].replace("\n", " ").split(",")
    assert [float(word.strip(" F")) for word in words if word.strip()] == numbers
    assert max(map(len, printed.splitlines())) <= 100 and printed.count("\n") < 12
    assert np.frombuffer(tables.data["table_0"], "<f4").tolist() == numbers
    assert tables.data["table_1"] == bytes([1, 2, 3])


@pytest.mark.parametrize(
    ("text", "prefix", "expected"),
    [
        ("reluctance_run(RELUCTANCE_OK)", "left", "left_run(LEFT_OK)"),
        ("namespace reluctance {", "left", "namespace left_ {"),
        ("namespace reluctance {", "for", "namespace for_ {"),
        ("namespace reluctance {", "reluctance", "namespace reluctance {"),
        ("reluctance::x", "left", "left_::x"),
        ("`reluctance run`, a_reluctance_b, MY_RELUCTANCE_X", "left",
         "`reluctance run`, a_reluctance_b, MY_RELUCTANCE_X"),
    ],
)  # fmt: skip
def test_another_prefix_renames_symbols_and_nothing_else(
    text: str, prefix: str, expected: str
) -> None:
    assert renamed(text, prefix) == expected


TORQUE, SPEED = "deadbeat", "paper_pump"


def ranges(name: str) -> dict[str, tuple[float, float, float]]:
    given = drive(name)
    return {
        p.name: (p.least, p.built, p.most) for p in run_time_parameters(given, described(given))
    }


def test_parameters_move_from_none_to_what_was_built_and_gains_to_ten_times_that() -> None:
    given, found = drive(SPEED), ranges(SPEED)
    guard = protection(given)
    for name in ("torque_limit", "speed_limit", "current_trip", "over_speed"):
        least, built, most = found[name]
        assert least == 0 and built == most, name
    least, built, most = found["speed_gain"]
    assert least == 0 < built and most == pytest.approx(10 * built)
    assert "speed_integral_gain" not in found  # ten times none leaves nothing to choose
    assert found["current_trip"][1] == pytest.approx(guard.levels.i_trip)
    u_dc = given.converter.u_dc_V
    assert found["under_voltage"] == pytest.approx((0, guard.levels.u_dc_min, u_dc))
    assert found["over_voltage"] == pytest.approx(
        (u_dc, guard.levels.u_dc_max, guard.levels.u_dc_max)
    )
    assert found["ready_voltage"] == pytest.approx((0.05 * u_dc, 0.7 * u_dc, u_dc))
    T_s = given.control.T_s
    assert found["command_timeout"] == pytest.approx((2 * T_s, 0.1, 60))
    assert found["precharge_time"] == pytest.approx((2 * T_s, 5, 60))
    slack = guard.levels.angle_slack
    assert found["angle_slack"] == pytest.approx((0, slack, np.radians(170)))
    rate = found.get("speed_rate")
    assert rate is None or rate == pytest.approx((1, rate[1], rate[1]))
    assert "speed_gain" not in ranges(TORQUE) and "torque_limit" in ranges(TORQUE)


@pytest.mark.parametrize(
    ("key", "value", "told"),
    [
        ("command_timeout_ms", 0.01, "command_timeout_ms = 0.01, need at least 0.04 ms"),
        ("precharge_max_s", 1e-5, "precharge_max_s = 1e-05, need at least 4e-05 s"),
    ],
)
def test_a_time_out_below_its_own_range_is_refused(
    key: str, value: float, told: str, tmp_path: Path
) -> None:
    given = drive(SPEED, "control.T_s_us=20", f"protection.{key}={value}")
    with pytest.raises(rl.ParameterError, match=re.escape(told)):
        firmware(given, tmp_path / "package")
    assert not (tmp_path / "package").exists()
    least = 4 * value  # as the message says
    assert described(drive(SPEED, "control.T_s_us=20", f"protection.{key}={least}"))


@pytest.mark.parametrize("value", [1e-6, 1e-3, 0.05, 0.5, 7.0, 90.0, 300.0, 2000.0, 1e5])
def test_every_parameter_is_built_within_its_range_or_refused(value: float) -> None:
    for key in rl.Protection.model_fields:
        if rl.Protection.model_fields[key].annotation is bool:
            continue
        try:
            given = drive(SPEED, f"protection.{key}={value}")
            entries = run_time_parameters(given, described(given))
        except rl.ParameterError:
            continue
        for entry in entries:
            assert entry.least <= entry.built <= entry.most, (key, entry)


def test_the_readme_has_a_row_for_each_parameter_and_none_for_no_limit() -> None:
    given = drive(TORQUE)
    entries = run_time_parameters(given, described(given))
    told = marks(entries)
    assert told["n_run_time"] == str(len(entries))
    rows = [
        [c.strip() for c in row.strip("|").split("|")] for row in told["run_time_table"].split("\n")
    ]
    for row, entry in zip(rows, entries, strict=True):
        assert row[:3] == [f"`{entry.name}`", entry.unit, f"{entry.least:.6g}"]
        assert row[3:] == [shown(entry.most), shown(entry.built)]
    assert "RELUCTANCE_PARAMETER_TORQUE_LIMIT = 0" in told["run_time_numbers"]
    assert shown(1e30) == "none" and shown(9e29) == "9e+29" and shown(41.25) == "41.25"


@pytest.fixture(scope="module")
def readme(tmp_path_factory: pytest.TempPathFactory) -> str:
    given = ["protection.command_timeout_ms=80", "sensing.adc_bits=12", "sensing.i_range_A=400"]
    given += ["sensing.i_noise_LSB=2", "sensing.encoder_counts=4096", "converter.dead_time_us=1"]
    folder = firmware(drive("deadbeat", *given), tmp_path_factory.mktemp("p") / "package").folder
    return (folder / "README.md").read_text()


@pytest.mark.parametrize(
    "words",
    [
        "every 20 us",
        "full scale above 180 A",  # 1.2 times 150 A
        "a current above 180 A (the law's own limit is 150 A)",
        "dc link above 300 V",
        "dc link below 60 V",
        "above 1950 rpm, either direction",
        "From 1852.5 rpm on there is no motoring torque",
        "nominal 240 V",
        "the dc link stays above 168 V",
        "80 ms without a new command",
        "current converter 12 bits over 400 A, angle sensor 4096 counts per revolution",
        "the converter was given as 1 us late at turn-on",
        "--R_ohm 0.72 --N_r 4",
        "--N_s 6",
        "swapped",
        "2 pi for each of the 4 rotor poles",
    ],
)
def test_the_readme_of_a_package_has_the_numbers_of_the_drive(readme: str, words: str) -> None:
    if words != "swapped":
        assert words in readme
        return
    for line in (
        "phase = [0, 2, 1]",
        "sensor = [1, 0, 2]",
        "sign = [1, -1, 1]",
    ):
        assert line in readme
    assert not re.search(r"@\w+@", readme)


def test_every_answer_of_a_verdict_turns_at_its_limit() -> None:
    """Three legs; a stack beside 2 KiB of state; code and tables in flash."""
    given = drive("edge_mpc_mcu", "control.T_s_us=200")
    part = mcu("stm32g474")
    step = Cost("", "", "cortex-m4", 1, True, 3000.0, 4000, 20_000, 30_000, 0, 1000, ())

    def answers(**changes: object) -> dict[str, bool]:
        cost = Cost(**vars(step) | changes)  # type: ignore[arg-type]
        return {why.partition(":")[0]: yes for yes, why in verdict(given, part, cost, {1})}

    assert all(answers().values()) and "comparators" not in answers()
    flash, ram = part.flash_KiB * 1024, part.ram_KiB * 1024
    assert answers(text=100, rodata=flash - 100)["flash"]
    assert not answers(text=100, rodata=flash - 99)["flash"]
    assert answers(stack=ram - 2048)["RAM"] and not answers(stack=ram - 2047)["RAM"]
    rows = dict((why.partition(":")[0], why) for _, why in verdict(given, part, step, {2}))
    assert rows["timers"] == "timers: 3 legs of 6 units with four compare values"
    assert rows["flash"] == "flash: 48.8 KiB of 512"
    assert rows["RAM"].startswith("RAM: 1000 B of stack and 2 KiB of state and orders, of 128 KiB")
    assert "9 with DACs for the orders, of 7" in rows["comparators"]
    assert "allows 160 us with delay_samples = 1" in rows["step"]


@pytest.mark.parametrize(
    ("name", "core", "MHz", "flash", "ram"),
    [  # of the product pages: STM32G474 (DS12288), STM32H743 (DS12110)
        ("stm32g474", "cortex-m4", 170, 512, 128),
        ("stm32h743", "cortex-m7", 480, 2048, 1024),
    ],
)
def test_microcontrollers_have_the_numbers_of_their_data_sheets(
    name: str, core: str, MHz: float, flash: int, ram: int
) -> None:
    part = MCUS[name]
    assert (part.name, part.core, part.clock_MHz) == (name, core, MHz)
    assert (part.flash_KiB, part.ram_KiB) == (flash, ram)
    fast = sum(size for _, size in (part.code, part.tables))
    assert fast <= ram and 1 <= part.cpi[0] < part.cpi[1]


def test_gates_are_those_that_the_law_orders() -> None:
    assert gates_of(drive("deadbeat")) == {1}  # timers
    assert gates_of(drive("sharing_cubic")) == {2}  # comparators
    assert gates_of(drive("sharing_cubic", "protection.diagnosis=true")) == {1, 2}


def test_every_status_of_the_core_has_its_name_in_the_header_of_a_package() -> None:
    core = (ROOT / "include/srm/control/guard/fault.hpp").read_text()
    header = (ROOT / "firmware/package/reluctance_controller.h").read_text()
    header = header.partition("reluctance_status;")[2].partition("};")[0]
    named = {int(n): name.upper() for name, n in re.findall(r"^  (\w+) = (\d+)", core, re.M)}
    listed = {int(n): name for name, n in re.findall(r"^  RELUCTANCE_(\w+) = (\d+)", header, re.M)}
    assert listed == named and len(named) == 21


@pytest.mark.parametrize("diagnosis", [False, True])
def test_a_readme_tells_of_the_protection_that_its_package_has(
    tmp_path: Path, diagnosis: bool
) -> None:
    on = ["protection.diagnosis=true"] if diagnosis else []
    made = drive("deadbeat", "sensing.delay_samples=1", *on)
    text = (firmware(made, tmp_path / "p").folder / "README.md").read_text()
    words = " ".join(text.split())
    assert (
        ("`_PHASE_UNLIKE`" in words)
        == ("begins with a trial of the diagnosis" in words)
        == diagnosis
    )
    assert (
        ("With a reference above zero `run` ends" in words)
        == ("+-25 %" in words)
        == (not diagnosis)
    )
    if diagnosis:
        assert f"up to {made.machine.i_max_A / 3:.3g} A" in words
