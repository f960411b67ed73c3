"""No undefined behaviour for any bit pattern: the exported controller under the sanitizers."""

import subprocess

import pytest
from firmware_tools import ROOT, drive

from reluctance.base.toolchain import build
from reluctance.targets.export import firmware
from reluctance.targets.export.package import described
from reluctance.targets.export.tree import walk

EACH_LAW = ["angles", "sharing", "ditc", "paper_mpc_map", "finite_set_2", "edge_mpc"]
EACH_LAW += ["deadbeat", "pwm_current", "sun_cloud", "sun_cloud_no_sensor"]
SOURCE = ROOT / "tests" / "firmware" / "fuzz.cpp"
SANITIZE = ["-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all"]
FLAGS = ["-O0", "-I.", "-Iinclude", *SANITIZE]


def corrupt_header(tree):
    """A function that hands every float parameter to a visitor."""
    lines = [
        f"  visit({path}[{j}]);" if mark == "{}" else f"  visit({path});"
        for name in ("control", "machine", "protection")
        for path, mark, numbers in walk(tree[name], name)
        for j, number in enumerate(numbers)
        if mark in ("", "{}") and isinstance(number, float)
    ]
    body = "\n".join(lines)
    return (
        "template <class Control, class Machine, class Protection, class Visit>\n"
        "void corrupt(Control& control, Machine& machine, Protection& protection, Visit visit) "
        f"{{\n{body}\n}}\n"
    )


@pytest.mark.parametrize("name", EACH_LAW)
def test_no_bit_pattern_of_samples_or_parameters_is_undefined_behaviour(name, tmp_path):
    built = drive(name)
    folder = firmware(built, tmp_path / "package").folder
    (folder / "corrupt.hpp").write_text(corrupt_header(described(built)))
    program = tmp_path / "fuzz"
    sources = [str(SOURCE), "controller.cpp"]
    build(sources, program, FLAGS, folder=folder, what="the package", link=SANITIZE)
    done = subprocess.run([str(program), "10000"], capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stdout) == (0, "ok\n"), done.stderr[-2000:]


def test_the_comparator_in_software_follows_the_gate_drive_of_the_simulation(tmp_path):
    program = tmp_path / "comparator_check"
    source = ROOT / "tests" / "firmware" / "comparator_check.cpp"
    build([str(source)], program, ["-O1", "-Iinclude"], folder=ROOT, what="the check", link=())
    done = subprocess.run([str(program)], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout) == (0, "0\n")
