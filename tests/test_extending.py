"""docs/extending.md: every patch applies and does what it says, every program is the tested one."""

import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import nanobind
import pytest

import reluctance

ROOT = Path(__file__).parents[1]
OWN = ROOT / "examples" / "own_law"
PAGE = (ROOT / "docs" / "extending.md").read_text()
SECTIONS = dict(part.split("\n", 1) for part in PAGE.split("\n## ")[1:])
PATCHES = {
    name: text.partition("```diff\n")[2].partition("```")[0]
    for name, text in SECTIONS.items()
    if "```diff" in text
}
STATED = {
    name.capitalize(): int(files)
    for name, files in re.findall(r"^\| \[(.+?)\]\(#.+?\) \| (\d) \|", PAGE, re.M)
}
PYTHON = {  # what the patched Python part does; where the core changes too, with the core as it is
    "A key of a law": """
from reluctance.laws.torque_sharing import TorqueSharing
table = TorqueSharing(law="torque_sharing", T_s_us=20.0, i_least_A=2.0)
assert table.si["i_least"] == 2.0
""",
    "A load": """
import reluctance as rl
coast = ["reference.kind='torque'", "reference.speed_rpm=", "reference.tau_Nm=1",
         "load.k_pump_Nms2=", "load.speed_rpm=1000"]
speeds = []
for more in (["load.kind=torque"], ["load.kind=brake", "load.B_Nms=0.5"]):
    drive = rl.load("examples/paper_pump.toml", coast + more)
    speeds.append(rl.simulate(drive, until=0.005).omega_m[-1])
assert speeds[1] < 0.9 * speeds[0], speeds
""",
    "A sensor error": """
from reluctance.drive.tables import Sensing
assert Sensing(u_dc_gain=1.1).sampling(4)["u_gain"] == 1.1
""",
    "A key figure": """
import reluctance as rl
kpis = rl.simulate(rl.load("examples/paper_rated.toml"), until=0.03).kpis
assert kpis.with_units()["crest"] == kpis.crest == kpis.i_peak / kpis.i_rms
""",
    "A source": """
from reluctance.drive.tables import Source
assert Source.model_fields["kind"] and "I_A" in Source.model_fields
""",
    "A bridge": """
from reluctance.drive.tables import Converter
assert Converter(u_dc_V=240.0, bridge="one_gate").bridge == "one_gate"
""",
}
CORE = {  # the translation unit that the patched headers must compile in
    "A key of a law": "law_torque_sharing.cpp",
    "A sensor error": "plant.cpp",
    "A source": "plant.cpp",
    "A bridge": "plant.cpp",
}


def files(patch: str) -> list[str]:
    return re.findall(r"^\+\+\+ b/(\S+)", patch, re.M)


def test_every_addition_is_shown() -> None:
    assert set(PATCHES) == set(PYTHON) <= set(STATED)


@pytest.mark.parametrize("name", PATCHES)
def test_an_addition_costs_the_stated_files(name: str) -> None:
    assert len(files(PATCHES[name])) == STATED[name]


@pytest.mark.parametrize("name", PATCHES)
def test_the_patch_does_what_it_says(name: str, tmp_path: Path) -> None:
    for folder in ("include", "bindings", "python", "examples"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    command = ["patch", "-p1", "--no-backup-if-mismatch"]
    subprocess.run(command, cwd=tmp_path, input=PATCHES[name], text=True, check=True)
    package = tmp_path / "python" / "reluctance"
    for library in Path(reluctance.__file__).parent.glob("_core.*.so"):
        shutil.copy(library, package)
    for data in ("machines", "include", "bindings"):
        source = tmp_path if (tmp_path / data).is_dir() else ROOT
        (package / data).symlink_to(source / data)
    done = subprocess.run(
        [sys.executable, "-c", PYTHON[name]],
        cwd=tmp_path,
        env={"PYTHONPATH": str(tmp_path / "python"), "PATH": ""},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    if name in CORE:
        compiles(tmp_path, CORE[name])


def compiles(tree: Path, unit: str) -> None:
    folders = (
        *(tree / "include", tree / "bindings", nanobind.include_dir()),
        sysconfig.get_path("include"),
    )
    done = subprocess.run(
        [
            "g++",
            "-std=c++20",
            "-fsyntax-only",
            *(f"-I{f}" for f in folders),
            tree / "bindings" / unit,
        ],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("file", ["own_law.py", "own_law.hpp"])
def test_laws_of_the_page_are_the_tested_ones(file: str) -> None:
    assert (OWN / file).read_text().rstrip() in PAGE


@pytest.mark.parametrize("file", ["own_law.toml", "own_law_cpp.toml"])
def test_tables_of_the_page_are_those_of_the_examples(file: str) -> None:
    text = (OWN / file).read_text()
    assert text[text.index("[control]") : text.index("[simulation]")].rstrip() in PAGE


def test_the_files_of_a_law_exist() -> None:
    steps = re.findall(r"^\d\. .*", PAGE, re.M)
    assert len(steps) == STATED["A law"]
    for path in re.findall(r"`((?:include|bindings|python)/\S+?)`", "\n".join(steps)):
        assert (ROOT / path).exists(), path
