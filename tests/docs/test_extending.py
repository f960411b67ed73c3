"""docs/extending.md: every patch applies and does what it says, every program is the tested one."""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import nanobind
import pytest
from needs import needs

import reluctance
from reluctance.base.toolchain import EXACT, STANDARD, build
from reluctance.base.units import UNITS

FLAGS = ("-O1", "-fvisibility=hidden", "-Iinclude")
ROOT = Path(__file__).parents[2]
OWN = ROOT / "examples" / "own_law"
PAGE = (ROOT / "docs" / "extending.md").read_text()
SECTIONS = dict(part.split("\n", 1) for part in PAGE.split("\n## ")[1:])
QUICK = ("A load", "A key figure", "A table of a drive file")  # the others are proofs
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
from reluctance.drive.laws.torque_sharing import TorqueSharing
table = TorqueSharing(law="torque_sharing", T_s_us=20.0, i_least_A=2.0)
assert table.si["i_least"] == 2.0
""",
    "A key of the frame": """
import pytest
import reluctance as rl
drive = rl.load("examples/paper_rated.toml", ["converter.u_low_V=200"])
with pytest.raises(TypeError, match="u_low"):  # the core as it is does not have it
    drive.controller()
""",
    "A law": """
from reluctance.explore.comparison import CONTENDERS
from reluctance.explore.comparison.figure import style
from reluctance.drive.laws import table_of
from reluctance.targets.studio.starts import STARTS
assert table_of("one_phase").title == "one phase at a time"
assert CONTENDERS["one_phase"].law == "one_phase"
assert style("one_phase")["ls"] == ":"
assert "one_phase" in {start.law for start in STARTS}
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
    "A table of a drive file": """
import pytest
import reluctance as rl
from reluctance.cli.schema import json_schema
drive = rl.load("examples/paper_rated.toml", ["cooling.R_th_KpW=0.5", "cooling.temp_air_degC=30"])
assert drive.cooling.temp_w(100.0) == 80.0
drive.save("paper_rated.toml")
assert rl.load("paper_rated.toml") == drive != rl.load("examples/paper_rated.toml")
assert drive.with_values({"cooling.R_th_KpW": None}).cooling.temp_w(100.0) == 30.0
with pytest.raises(rl.ParameterError, match="unknown key `R_th` in .cooling.; did you mean"):
    rl.load("examples/paper_rated.toml", ["cooling.R_th=0.5"])
assert "R_th_KpW" in json_schema()["$defs"]["Cooling"]["properties"]
""",
    "A sensor error": """
import pytest
import reluctance as rl
with pytest.raises(TypeError, match="u_gain"):  # the core as it is does not have it
    rl.Sensing(u_dc_gain=1.1).core(T_s=2e-5, N_r=4)
""",
    "A key figure": """
import reluctance as rl
kpis = rl.simulate(rl.load("examples/paper_rated.toml"), until=0.03).kpis
assert kpis.with_units()["crest"] == kpis.crest == kpis.i_peak / kpis.i_rms
""",
    "A source": """
import pytest
import reluctance as rl
with pytest.raises(AttributeError, match="CurrentSource"):  # the core as it is does not have it
    rl.Source(kind="current", I_A=20.0, C_uF=2200.0).core(240.0)
""",
    "A machine model": """
import pytest
from reluctance.machine.library import model_class
with pytest.raises(AttributeError, match="Linear"):  # the core as it is does not have it
    model_class("linear")
""",
    "A bridge": """
import pytest
import reluctance as rl
with pytest.raises(AttributeError, match="OneGateBridge"):  # the core as it is does not have it
    rl.Converter(u_dc_V=240.0, bridge="one_gate").core()
""",
}
CORE = {  # the translation unit that the patched headers must compile in
    "A key of a law": "law_torque_sharing.cpp",
    "A key of the frame": "frame.cpp",
    "A law": "law_one_phase.cpp",
    "A sensor error": "plant.cpp",
    "A source": "plant.cpp",
    "A machine model": "machine.cpp",
    "A bridge": "plant.cpp",
}
CHECKED = {  # by a part of addition_check.cpp, on the patched core
    "A key of a law": "LAW_KEY",
    "A key of the frame": "FRAME",
    "A sensor error": "SENSOR",
    "A source": "SOURCE",
    "A machine model": "MACHINE",
    "A bridge": "BRIDGE",
}
MOST = {  # files that an addition may cost
    **{"A machine model": 5, "A table of a drive file": 2, "A load": 1, "A bridge": 2},
    **{"A source": 3, "A law": 5, "A key of the frame": 3, "A key of a law": 2},
}


def files(patch: str) -> list[str]:
    return re.findall(r"^\+\+\+ b/(\S+)", patch, re.M)


def test_the_page_lists_every_suffix_of_a_unit() -> None:
    converted, _, kept = PAGE.partition("converted to SI are ")[2].partition("The suffixes ")
    for text, ours in (
        (converted, {unit for unit, (a, b) in UNITS.items() if (a, b) != (1, 1)}),
        (kept.partition(" leave ")[0], {unit for unit, ab in UNITS.items() if ab == (1, 1)}),
    ):
        assert set(re.findall(r"`(\w+)`", text)) == ours


def test_every_addition_is_shown() -> None:
    assert set(PATCHES) == set(PYTHON) <= set(STATED)


@pytest.mark.parametrize("name", PATCHES)
def test_an_addition_costs_the_stated_files(name: str) -> None:
    assert len(files(PATCHES[name])) == STATED[name] <= MOST.get(name, 2)


@needs("patch")
@pytest.mark.parametrize(
    "name",
    [n if n in QUICK else pytest.param(n, marks=pytest.mark.long) for n in PATCHES],
)
def test_the_patch_does_what_it_says(name: str, tmp_path: Path) -> None:
    patch(name, tmp_path)
    run(PYTHON[name], tmp_path)
    if name in CORE:
        compiles(tmp_path, CORE[name])


@needs("patch")
@pytest.mark.long
@pytest.mark.parametrize("name", CHECKED)
def test_the_patched_core_does_what_it_says(name: str, tmp_path: Path) -> None:
    patch(name, tmp_path)
    program = tmp_path / "check"
    check = [f"-D{CHECKED[name]}", Path(__file__).with_name("addition_check.cpp"), "-o", program]
    subprocess.run(["g++", "-std=c++20", f"-I{tmp_path / 'include'}", *check], check=True)
    assert subprocess.run([program]).returncode == 0


LAW = """
import sys
from pathlib import Path

import _one_phase  # the function of the law that a whole build would have in _core
from reluctance import _core
_core.one_phase = _one_phase.one_phase

import reluctance as rl
from c_library import Unit, library
from reluctance.explore.comparison import compare
from reluctance.targets.export.blob import blob
from reluctance.targets.export.fmu import fmu
from reluctance.targets.export.on_desk import DeskPackage
from reluctance.targets.export.package import firmware
from reluctance.targets.studio.starts import STARTS

place = Path(sys.argv[1])
drive = rl.load("examples/sharing_cubic.toml", ["control.law=one_phase"])
run = rl.simulate(drive, until=0.03)
assert run.kpis.tau_mean > 0.3 * drive.tau_max
(entry,) = compare(drive, ["one_phase"], octaves=(), processes=1).entries
assert entry.runs > 0
package = firmware(drive, place / "package")
assert "OnePhase" in package.law
DeskPackage(package.folder, 3)
assert fmu(drive, place / "drive.fmu").file.is_file()
core = library(place / "library.so")  # the C interface, which the studio is too
for start in STARTS:
    if start.law == "one_phase":
        for content in (blob(drive), blob(start.drive())):
            unit = Unit(core, content)
            unit.start()
            unit.free()
"""


@needs("patch")
@pytest.mark.long
def test_a_built_in_law_is_everywhere(tmp_path: Path) -> None:
    """In run, compare, export, C interface, mock-up unit and studio, from the five files."""
    tree = tmp_path / "tree"
    patch("A law", tree)
    shutil.copytree(ROOT / "web", tree / "web", ignore=shutil.ignore_patterns("*.wasm", "data"))
    shutil.copytree(ROOT / "firmware", tree / "firmware")
    for data in ("firmware", "web"):
        (tree / "python" / "reluctance" / data).symlink_to(tree / data)
    module(
        *(tree, "_one_phase", ["law_one_phase.cpp"]),
        '#include "srm/control/laws.hpp"',
        'nanobind::module_::import_("reluctance._core");',
        "bound::bind_built_in<srm::laws::OnePhase>(m);",
    )
    flags = [*FLAGS, "-DSRM_PHASES=3", "-DSRM_PRECISIONS=double", "-DSRM_MACHINES=LeHuy"]
    build(["web/reluctance.cpp"], "library.so", flags, folder=tree, what="the patched tree")
    run(LAW, tree, str(tree), paths=(tree, ROOT / "tests" / "support"))


MACHINE = """
import _machines  # the bindings of the patched tree, instead of those in _core
from reluctance import _core
_core.Linear, _core.magnetics = _machines.Linear, _machines.magnetics

import casadi as ca
import numpy as np
from reluctance.cli.schema import json_schema
from reluctance.machine.library import machine_from, machine_table
from reluctance.machine.mismatch import Mismatch, as_known
from reluctance.machine.optimum import phase_magnetics
from reluctance.machine.optimum.magnetics import content

kept = "name source licence N_s N_r n_phases R_ohm i_max_A J_kgm2".split()
paper = machine_table("paper_6_4", __import__("pathlib").Path())
table = {key: paper[key] for key in kept} | {"model": "linear", "L_u_H": 7e-4, "L_rise_H": 2e-2}
machine = machine_from(table)
assert content(machine.magnetics) == ["linear", 4, 7e-4, 2e-2]
assert "L_rise_H" in json_schema()["$defs"]["LinearMachine"]["properties"]
rng = np.random.default_rng(1)
i, theta_e = rng.uniform(0, 100, 200), rng.uniform(0, 2 * np.pi, 200)
psi, tau = phase_magnetics(machine.magnetics)(ca.DM(i), theta_e)
np.testing.assert_allclose(np.ravel(psi), machine.psi(i, theta_e), rtol=1e-12)
np.testing.assert_allclose(np.ravel(tau), machine.tau(i, theta_e), rtol=1e-9, atol=1e-12)
believed = as_known(machine, Mismatch(flux_factor=1.1))
np.testing.assert_allclose(believed.psi(i, theta_e), 1.1 * machine.psi(i, theta_e), rtol=1e-12)
assert machine.model_copy(update={"R_ohm": 1.0}).R == 1.0 and machine.greatest_torque > 0
"""


@needs("patch")
@pytest.mark.long
def test_a_machine_model_is_everywhere(tmp_path: Path) -> None:
    """In a machine file, as believed, in the limit, in the laws and in the C interface."""
    tree = tmp_path / "tree"
    patch("A machine model", tree)
    shutil.copytree(ROOT / "web", tree / "web", ignore=shutil.ignore_patterns("*.wasm", "data"))
    module(tree, "_machines", ["machine.cpp"], "", "bound::bind_machine(m);", domain="patched")
    kinds = ["-DSRM_PHASES=3", "-DSRM_PRECISIONS=double", "-DSRM_MACHINES=Linear"]
    flags = [*STANDARD[".cpp"], *EXACT, *FLAGS, *kinds]
    command = ["g++", *flags, "-fsyntax-only", "web/reluctance.cpp"]
    subprocess.run(command, cwd=tree, check=True)
    run(MACHINE, tree, paths=(tree,))


def module(
    tree: Path, name: str, sources: list[str], include: str, *body: str, domain: str = ""
) -> None:
    """An extension module of files of the bindings. domain: nanobind's, of types of its own."""
    lines = (f'#include "bindings.hpp"\n{include}', f"NB_MODULE({name}, m) {{", *body, "}\n")
    (tree / f"{name}.cpp").write_text("\n".join(lines))
    folders = (tree / "bindings", nanobind.include_dir(), sysconfig.get_path("include"))
    robin = f"-I{nanobind.include_dir()}/../ext/robin_map/include"
    files = [f"{name}.cpp", *(f"bindings/{source}" for source in sources)]
    nb = f"{nanobind.source_dir()}/nb_combined.cpp"
    python = [*(f"-I{folder}" for folder in folders), robin]
    python += [f"-DNB_DOMAIN={domain}"] if domain else []
    flags = [*FLAGS, *python]
    build([*files, nb], f"{name}.so", flags, folder=tree, what="the patched tree")


def patch(name: str, tree: Path) -> None:
    """The sources with a patch of the page, and the core as it is."""
    for folder in ("include", "bindings", "python", "examples"):
        shutil.copytree(ROOT / folder, tree / folder)
    command = ["patch", "-p1", "--no-backup-if-mismatch"]
    subprocess.run(command, cwd=tree, input=PATCHES[name], text=True, check=True)
    package = tree / "python" / "reluctance"
    for library in Path(reluctance.__file__).parent.glob("_core.*.so"):
        if not (package / library.name).exists():
            shutil.copy(library, package)
    for data in ("machines", "include", "bindings"):
        source = tree if (tree / data).is_dir() else ROOT
        (package / data).symlink_to(source / data)


def run(script: str, tree: Path, *arguments: str, paths: tuple[Path, ...] = ()) -> None:
    """A Python program in the patched tree."""
    done = subprocess.run(
        [sys.executable, "-c", script, *arguments],
        cwd=tree,
        env={
            "PYTHONPATH": ":".join(map(str, (tree / "python", *paths))),
            "PATH": os.environ["PATH"] if paths else "",
            "RELUCTANCE_CACHE": str(tree / "cache"),
        },
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr


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


@pytest.mark.parametrize("name", ["A law", "A machine model"])
def test_the_files_of_a_law_and_of_a_machine_model_exist(name: str) -> None:
    steps = re.findall(r"^\d\. .*", SECTIONS[name], re.M)
    assert len(steps) == STATED[name]
    for path in re.findall(r"`((?:include|bindings|python)/\S+?)`", "\n".join(steps)):
        assert (ROOT / path).exists(), path
