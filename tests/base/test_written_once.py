"""What the program says of itself in several places is the same everywhere."""

import re
from pathlib import Path

import pytest

from reluctance import _core
from reluctance.targets.export.fmu_variables import MEANINGS

ROOT = Path(__file__).parents[2]
SOURCES = [
    path
    for folder in ("include", "bindings", "python", "firmware", "web")
    for path in (ROOT / folder).rglob("*")
    if path.suffix in {".hpp", ".cpp", ".h", ".c", ".py", ".js"}
]
BANNED = ("what makes up for", "beside its own")  # docs/nomenclature.md has the terms of the field


def test_a_unit_numbers_the_gates_as_the_core_does() -> None:
    _, text = MEANINGS["gate"]
    numbers = dict(re.findall(r"(\d) (\w+)", text))
    assert numbers == {str(gate.value): gate.name for gate in _core.Gate}


def test_the_header_of_the_firmware_numbers_them_so_too() -> None:
    header = (ROOT / "firmware" / "package" / "reluctance_controller.h").read_text()
    for gate in _core.Gate:
        assert re.search(rf"RELUCTANCE_{gate.name.upper()} = {gate.value}\b", header)


@pytest.mark.parametrize("phrase", BANNED)
def test_no_source_has_a_phrase_that_the_style_page_bans(phrase: str) -> None:
    assert not [path for path in SOURCES if phrase in path.read_text()]


@pytest.mark.parametrize("folder", ["package", "ports/stm32g474"])
def test_a_function_of_c_without_a_prototype_in_a_header_does_not_compile(folder: str) -> None:
    makefile = (ROOT / "firmware" / folder / "Makefile").read_text()
    assert "-Wmissing-prototypes" in makefile and "-Werror" in makefile


def test_the_layout_of_every_c_and_cpp_file_is_checked() -> None:
    found = re.search(r"^C_FOLDERS := (.+)$", (ROOT / "Makefile").read_text(), re.M)
    assert found
    checked = set(found[1].split())
    suffixes = {".c", ".h", ".cpp", ".hpp"}
    for path in ROOT.glob("*/**/*"):
        folder = path.relative_to(ROOT).parts[0]
        made = folder in {"build", "out", "dist"} or "generated" in path.parts  # docs/generated
        if path.suffix in suffixes and not made:
            assert folder in checked or folder.startswith("."), path
