"""The self-test of a package at boot, on the emulated target: it passes as exported, and not with a
word of a table or an answer that differs."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from firmware_tools import drive, needs_target

from reluctance.targets.export import firmware
from reluctance.targets.export.target import _emulator

pytestmark = needs_target
PASSES, TABLES, ORDERS = 0, 1, 2


def built(folder: Path, *arguments: str) -> Path:
    command = ["make", "-s", "all", "self_test", "CPU=cortex-m7", *arguments]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    return folder / "build" / "cortex-m7" / "self_test.elf"


def ends_with(program: Path) -> int:
    command = _emulator(program.name, "cortex-m7")
    return subprocess.run(command, cwd=program.parent, timeout=60).returncode


@pytest.mark.parametrize("name", ["angles", "paper_mpc_map"])
def test_it_passes_as_exported(name: str, tmp_path: Path) -> None:
    folder = firmware(drive(name), tmp_path / "package", prefix="left", self_test=True).folder
    assert ends_with(built(folder)) == PASSES


def test_cmake_compiles_it_too(tmp_path: Path) -> None:
    folder = firmware(drive("angles"), tmp_path / "package", prefix="left", self_test=True).folder
    tools = os.environ | {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    for line in (
        ["-S", str(folder), "-B", str(tmp_path / "out")],
        ["--build", str(tmp_path / "out")],
    ):
        subprocess.run(["cmake", *line], check=True, env=tools, stdout=subprocess.DEVNULL)
    library = (tmp_path / "out" / "libleft_controller.a").read_bytes()
    assert b"left_self_test" in library and b"left_tables_crc" in library


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("self_test") / "package"
    return firmware(drive("edge_mpc_late"), place, self_test=True).folder


def table(package: Path) -> np.ndarray:
    text = (package / "parameters.hpp").read_text()
    found = re.search(r"constexpr float table_0\[\] = \{\n(.*?)\};", text, re.DOTALL)
    assert found is not None
    words = found[1].replace("\n", " ").split(",")
    return np.array([float(word.strip().rstrip("F")) for word in words if word.strip()], "<f4")


@pytest.mark.parametrize("part", [0.0, 0.37, 0.999])
def test_a_corrupted_word_of_a_table_fails(part: float, package: Path) -> None:
    """One bit, anywhere in the table, whether or not the stored samples read it."""
    program, values = built(package), table(package)
    image = bytearray(program.read_bytes())
    places = [m.start() for m in re.finditer(re.escape(values.tobytes()), image)]
    assert len(places) == 1
    image[places[0] + 4 * int(part * len(values))] ^= 1
    bad = program.with_name("bad.elf")
    bad.write_bytes(image)
    assert ends_with(bad) & TABLES


def test_the_commands_of_the_readme_run_it_and_its_table_tells_the_exit_codes(
    package: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "package"
    shutil.copytree(package, folder, ignore=shutil.ignore_patterns("build"))
    readme = (folder / "README.md").read_text()
    section = readme.split("\n## Self-test\n")[1]
    subprocess.run(["sh", "-c", shown(section, r"`(make self_test)`")], cwd=folder, check=True)
    emulator = shown(section, r"((?: {4}.*\n)+)")
    codes = dict(re.findall(r"^\| (\d+) \| (.*) \|$", section, re.M))

    def told() -> str:
        return codes[str(subprocess.run(["sh", "-c", emulator], cwd=folder, timeout=60).returncode)]

    assert told() == "tables and orders are those of the export"
    data = folder / "self_test_data.hpp"
    data.write_text(data.read_text().replace("orders_crc = 0x", "orders_crc = 1 ^ 0x"))
    subprocess.run(["make", "-s", "self_test"], cwd=folder, check=True)
    assert told() == "the orders differ"
    for name in shown(readme, r"^\| (`reluctance_self_test.h`.*) \| self-test").split(", "):
        assert (folder / name.strip("`")).is_file()


def shown(text: str, pattern: str) -> str:
    found = re.search(pattern, text, re.M)
    assert found is not None, pattern
    return found[1]


def test_another_answer_fails(tmp_path: Path) -> None:
    folder = firmware(drive("angles"), tmp_path / "package", self_test=True).folder
    data = folder / "self_test_data.hpp"
    text = data.read_text()
    crc = int(re.findall(r"orders_crc = (0x[0-9A-F]+)", text)[0], 16)
    data.write_text(text.replace(f"0x{crc:08X}", f"0x{crc ^ 1:08X}"))
    assert ends_with(built(folder)) == ORDERS


def test_tables_lie_where_the_macro_says(package: Path, tmp_path: Path) -> None:
    out = tmp_path / "placed"
    place = "-DRELUCTANCE_TABLE='__attribute__((section(\".fast_tables\")))'"
    target = f"TARGET=-mcpu=cortex-m7 -mthumb -mfpu=fpv5-sp-d16 -mfloat-abi=hard {place}"
    done = subprocess.run(
        ["make", "-s", "all", f"OUT={out}", target], cwd=package, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr[-2000:]
    sizes = subprocess.check_output(["arm-none-eabi-size", "-A", out / "controller.o"], text=True)
    placed = re.search(r"\.fast_tables\s+(\d+)", sizes)
    assert placed is not None and int(placed[1]) >= 4 * len(table(package))


def test_a_package_without_it_has_none(tmp_path: Path) -> None:
    folder = firmware(drive("angles"), tmp_path / "package").folder
    assert not [path for path in folder.rglob("*self_test*")]
    assert "self-test" not in (folder / "README.md").read_text().lower()
