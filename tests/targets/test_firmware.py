"""The exported firmware package on the desk: what it is, and what is refused."""

import json
import re
import subprocess
import sys
import tomllib

import numpy as np
import pytest
from command import refused
from firmware_tools import DRIVES, ROOT, drive, each_drive
from hypothesis import given
from hypothesis import strategies as st

import reluctance as rl
from reluctance import _core
from reluctance.base.toolchain import build
from reluctance.drive.laws import LAWS
from reluctance.targets.export import firmware
from reluctance.targets.export.constants import Tables, constant, literal
from reluctance.targets.export.package import MARK, described, headers, parameters


def contents(folder):
    return {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


@given(st.floats(width=32, allow_nan=False, allow_infinity=False))
def test_a_printed_float_reads_back_as_the_same_float(value):
    text = literal(value, "x")
    assert text.endswith("F")
    assert np.float32(text[:-1]).tobytes() == np.float32(value).tobytes()


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf"), 1e39])
def test_a_number_that_is_no_finite_float_is_refused_with_its_place(value):
    with pytest.raises(rl.ParameterError, match=r"^control\.law\.R = .*need a finite float$"):
        constant({"type": "S", "fields": {"R": value}}, Tables(), "control.law")


@each_drive
def test_a_compiled_package_has_the_numbers_that_the_drive_simulates_with(name, tmp_path):
    """Description to controller to description: every float, table, enumerator, in its order."""
    made = firmware(drive(name), tmp_path / "package")
    program = tmp_path / "leaves"
    source = ROOT / "tests" / "core" / "leaves.cpp"
    nodes = described(drive(name))
    flags = ["-I.", "-Iinclude", *(["-DFLUX_ANGLE"] if "flux_angle" in nodes else [])]
    build([str(source)], program, flags, folder=made.folder, what="the package", link=())
    printed = subprocess.run([program], capture_output=True, text=True, check=True).stdout
    compiled = np.array(printed.split(), dtype=np.float32)
    wanted = [v for node in nodes.values() for v in leaves(node)]
    assert np.array_equal(compiled, np.array(wanted, dtype=np.float32))
    text = (made.folder / "parameters.hpp").read_text()
    assert f"fingerprint = 0x{made.fingerprint:08X}" in text
    assert made.law in text


def leaves(node):
    """The numbers of a described controller, in the order of its fields, tables in place."""
    if isinstance(node, list):
        yield from node
    elif isinstance(node, dict) and "table" in node:
        yield from node["values"]
    elif isinstance(node, dict) and "value" in node:
        yield node["value"]
    elif isinstance(node, dict):
        for value in node["fields"].values():
            yield from leaves(value)
    else:
        yield node


def test_every_law_of_the_suite_can_be_exported():
    exported = {drive(name).control.law for name in DRIVES}
    assert exported == set(LAWS)


def test_the_export_is_a_pure_function_of_the_drive(tmp_path):
    first, second = (firmware(drive("paper_mpc"), tmp_path / n).folder for n in ("a", "b"))
    assert contents(first) == contents(second)
    assert str(tmp_path).encode() not in b"".join(contents(first).values())


def test_the_fingerprint_follows_the_parameters_and_nothing_else():
    prints = [
        parameters(described(rl.load(ROOT / "examples" / "sharing_cubic.toml", overrides)))[1]
        for overrides in ([], ["simulation.until_s=0.2"], ["control.i_band_A=1.5"])
    ]
    assert prints[0] == prints[1] != prints[2]


def test_the_package_holds_exactly_the_headers_that_it_includes(tmp_path):
    folder = firmware(drive("ditc"), tmp_path / "package").folder
    held = {str(p.relative_to(folder / "include")) for p in (folder / "include").rglob("*.hpp")}
    sources = [p.read_text() for p in folder.glob("*.[ch]pp")]
    assert held == set(headers(sources))
    assert "srm/control/law/ditc.hpp" in held
    assert not any("sim/" in h or "plant/" in h for h in held)


def test_no_mark_of_a_template_is_left(tmp_path):
    folder = firmware(drive("finite_set_1"), tmp_path / "package").folder
    for path, data in contents(folder).items():
        assert not MARK.search(data.decode()), path


@pytest.mark.parametrize("limit, passes", [(26.8, True), (27372 / 1024, True), (26.7, False)])
def test_tables_above_the_flash_limit_are_refused_and_nothing_is_left(tmp_path, limit, passes):
    tables = (2 * 19 * 180 + 3) * 4 / 1024  # 26.73 KiB
    assert 26.7 < tables < 26.8
    out = tmp_path / "package"
    if passes:
        assert firmware(drive("finite_set_1"), out, flash_limit_KiB=limit).table_bytes == 27372
        return
    with pytest.raises(rl.ParameterError, match=r"need <= 26\.7 KiB \(--flash-limit\)"):
        firmware(drive("finite_set_1"), out, flash_limit_KiB=limit)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_with_files_in_it_is_left_alone(tmp_path):
    (tmp_path / "mine").write_text("x")
    with pytest.raises(rl.ParameterError, match="not an empty folder"):
        firmware(drive("ditc"), tmp_path)
    assert contents(tmp_path) == {(tmp_path / "mine").relative_to(tmp_path): b"x"}


@pytest.mark.parametrize(
    "override, message",
    [
        ("protection.u_dc_max_V=200", r"u_dc_max_V = 200, need \[converter\] u_dc_V = 240"),
        ("protection.speed_max_rpm=1000", r"speed_max_rpm = 1000, need more than the 1500 rpm"),
        ("protection.i_trip_A=150", r"i_trip_A = 150, need more than \[machine\] i_max_A = 150"),
        ("protection.angle_slack_deg=171", "angle_slack_deg = 171, need at most 170"),
        ("protection.i_zero_A=50", r"i_zero_A = 50, need less than 50, a third of"),
        ("sensing.encoder_counts=360", None),
    ],
)
def test_trip_levels_that_would_trip_in_normal_work_are_refused(override, message, tmp_path):
    built = rl.load(ROOT / "examples" / "ditc.toml", [override])
    if message is None:
        assert firmware(built, tmp_path / "package").folder.is_dir()
        return
    with pytest.raises(rl.ParameterError, match=message):
        firmware(built, tmp_path / "package")


def test_over_current_that_the_converter_cannot_show_is_refused(tmp_path):
    sensing = ["sensing.adc_bits=12", "sensing.i_range_A=160.0"]
    with pytest.raises(rl.ParameterError, match=r"i_trip_A = 180, need < \[sensing\] i_range_A"):
        firmware(rl.load(ROOT / "examples" / "ditc.toml", sensing), tmp_path / "package")


def test_the_command_line_exports_and_tells_the_fingerprint(tmp_path):
    arguments = ["export", "firmware", str(ROOT / "examples" / "ditc.toml"), "--json"]
    done = subprocess.run(
        [sys.executable, "-m", "reluctance", *arguments, "--out", str(tmp_path / "package")],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert (done.returncode, done.stderr) == (0, "")
    told = json.loads(done.stdout)
    assert told["fingerprint"] in (tmp_path / "package" / "README.md").read_text()


def test_a_controller_of_a_function_drives_the_simulation_as_the_law_does():
    torque = drive("ditc")
    law = torque.controller()

    def step(y, reference):
        return _core.step(law, y, reference)

    wrapped = _core.controller_from(3, step)
    a = rl.simulate(torque, until=0.01, record=None, controller=wrapped)
    b = rl.simulate(torque, until=0.01, record=None)
    assert np.array_equal(a.periods.values, b.periods.values)


def test_budget_and_drives_name_the_same_controllers():
    budget = tomllib.loads((ROOT / "firmware" / "budget.toml").read_text())
    assert set(budget) == set(DRIVES)


def test_no_c_file_of_the_firmware_declares_a_function_of_another():
    """A header does: a changed signature must not link silently."""
    declared = re.compile(r"^(?!static|typedef|return)\w[\w ]*[ *](\w+)\([^;{]*\);", re.M)
    for path in (ROOT / "firmware").rglob("*.c"):
        text = path.read_text()
        for name in declared.findall(text):
            assert re.search(rf"\b{name}\([^;{{]*\) {{", text), f"{path}: {name} is not its own"


def test_a_port_refuses_the_package_of_another_drive_file(tmp_path):
    """Of the same phases and period."""
    file = ROOT / "examples" / "deadbeat_g474.toml"
    made = [
        firmware(rl.load(file, overrides), tmp_path / f"p{n}", port="stm32g474").folder
        for n, overrides in enumerate(([], ["sensing.i_range_A=240"]))
    ]
    for package, port in ((made[0], made[0]), (made[1], made[0])):
        command = ["gcc", "-fsyntax-only", f"-I{package}", "-include", "port.h", "-xc", "/dev/null"]
        done = subprocess.run(command, cwd=port / "stm32g474", capture_output=True, text=True)
        assert (done.returncode == 0) == (package == port)
        assert package == port or "of different drive files; export both again" in done.stderr


def test_without_the_emulator_or_the_compiler_one_line_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    file = ROOT / "examples" / "ditc.toml"
    line = refused("export", "parity", file, "--steps", "10")
    assert "`arm-none-eabi-g++` is not installed; on Debian: apt install" in line
