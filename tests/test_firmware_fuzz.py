"""No undefined behaviour for any bit pattern: the exported controller under the sanitizers."""

import subprocess

import pytest
from firmware_tools import DRIVES, ROOT, drive

from reluctance.export import firmware
from reluctance.export.constants import float_paths
from reluctance.export.package import described

SANITIZED = ["-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all"]


def corrupt_header(tree):
    """A function that hands every float parameter to a visitor."""
    lines = [
        f"  visit({path});"
        for name in ("control", "protection")
        for path in float_paths(tree[name], name)
    ]
    body = "\n".join(lines)
    return (
        "template <class Control, class Protection, class Visit>\n"
        f"void corrupt(Control& control, Protection& protection, Visit visit) {{\n{body}\n}}\n"
    )


@pytest.mark.parametrize("name", DRIVES)
def test_no_bit_pattern_of_samples_or_parameters_is_undefined_behaviour(name, tmp_path):
    built = drive(name)
    folder = firmware(built, tmp_path / "package").folder
    (folder / "corrupt.hpp").write_text(corrupt_header(described(built)))
    program = tmp_path / "fuzz"
    subprocess.run(
        ["g++", "-std=c++20", "-O1", "-g", *SANITIZED, "-ffp-contract=off", "-I.", "-Iinclude"]
        + [str(ROOT / "tests" / "firmware" / "fuzz.cpp"), "controller.cpp", "-o", str(program)],
        cwd=folder,
        check=True,
    )
    done = subprocess.run([str(program), "20000"], capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stdout) == (0, "ok\n"), done.stderr[-2000:]
