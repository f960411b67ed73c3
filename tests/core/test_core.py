"""The core as a target sees it: every warning an error, no exceptions, no library to link."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from reluctance.base.toolchain import EXACT, STANDARD

ROOT = Path(__file__).parents[2]
CHECKS = sorted((ROOT / "tests" / "core").glob("*_check.cpp"))
FREESTANDING = ("base", "machine", "control")
HEADERS = sorted(h for a in FREESTANDING for h in (ROOT / "include/srm" / a).rglob("*.hpp"))
# What a freestanding C++20 implementation or a header without run-time part offers.
ALLOWED = {
    *("array", "bit", "concepts", "cstddef", "cstdint", "limits", "new", "type_traits", "utility")
}
COMPILERS = ["g++", *(["clang++"] if shutil.which("clang++") else [])]
WARNINGS = (
    "-Wall -Wextra -Wpedantic -Wconversion -Wshadow -Wdouble-promotion -Wno-sign-conversion -Werror"
)
TARGET = "-O1 -fno-exceptions -fno-rtti"
INDICES = "-D_GLIBCXX_ASSERTIONS"  # an index past the end of an array ends the program
FLAGS = [*STANDARD[".cpp"], *EXACT, *TARGET.split(), *WARNINGS.split(), f"-I{ROOT / 'include'}"]

every_compiler = pytest.mark.parametrize(
    "compiler", [COMPILERS[0], *(pytest.param(c, marks=pytest.mark.long) for c in COMPILERS[1:])]
)


@every_compiler
@pytest.mark.parametrize("source", CHECKS, ids=lambda p: p.stem)
def test_core_check_holds(source: Path, compiler: str, tmp_path: Path) -> None:
    program, unit = tmp_path / source.stem, tmp_path / f"{source.stem}.o"
    command = [compiler, *FLAGS, INDICES, "-c", str(source), "-o", str(unit)]
    # In two steps: ccache knows the first, where it stands for g++.
    built = subprocess.run(command, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    subprocess.run([compiler, unit, "-o", program], check=True)
    run = subprocess.run([program], capture_output=True, text=True)
    assert run.returncode == 0, run.stdout
    assert run.stdout


@pytest.mark.long
def test_closed_loop_has_the_same_bits_on_every_compiler(tmp_path: Path) -> None:
    """Plant, events and control, at -O0 and -O2."""
    source = ROOT / "tests/core/loop_hash.cpp"
    hashes = {}
    for compiler in COMPILERS:
        for level in ("-O0", "-O2"):
            program = tmp_path / f"hash{level}{compiler}"
            subprocess.run([compiler, *FLAGS, level, source, "-o", program], check=True)
            hashes[compiler, level] = subprocess.check_output([program], text=True)
    assert len(set(hashes.values())) == 1, hashes
    (lines,) = set(hashes.values())
    assert len(set(line.split()[1] for line in lines.splitlines())) == 2


@every_compiler
def test_headers_stand_alone(compiler: str, tmp_path: Path) -> None:
    """Each header in a file of its own, all in one call of the compiler."""
    sources = []
    for header in HEADERS:
        source = tmp_path / f"{header.parent.name}_{header.stem}.cpp"
        source.write_text(f'#include "{header.relative_to(ROOT / "include")}"\n')
        sources.append(str(source))
    built = subprocess.run(
        [compiler, *FLAGS, "-fsyntax-only", *sources], capture_output=True, text=True
    )
    assert built.returncode == 0, built.stderr


@pytest.mark.parametrize("header", HEADERS, ids=lambda p: f"{p.parent.name}/{p.stem}")
def test_headers_include_nothing_that_a_target_lacks(header: Path) -> None:
    text = header.read_text()
    assert set(re.findall(r"#include <(.+?)>", text)) <= ALLOWED
    layers = set(re.findall(r'#include "srm/(\w+)/', text))
    below = {"base": {"base"}, "machine": {"base", "machine"}, "control": set(FREESTANDING)}
    layer = header.relative_to(ROOT / "include/srm").parts[0]
    assert layers <= below[layer]
