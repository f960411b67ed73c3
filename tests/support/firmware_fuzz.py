"""An exported controller under the sanitizers, with random samples and parameters."""

import subprocess
from pathlib import Path

from firmware_tools import ROOT

from reluctance.base.toolchain import build
from reluctance.drive.drive import Drive
from reluctance.targets.export import firmware
from reluctance.targets.export.package import described

SOURCE = ROOT / "tests" / "firmware" / "fuzz.cpp"
SANITIZE = ["-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all"]
FLAGS = ["-O0", "-I.", "-Iinclude", *SANITIZE]


def floats(node, path):
    """Where the floats of a tree are, those of tables left out."""
    if isinstance(node, float):
        yield path
    elif isinstance(node, list):
        for j, element in enumerate(node):
            yield from floats(element, f"{path}[{j}]")
    elif isinstance(node, dict):
        for name, field in node.get("fields", {}).items():
            yield from floats(field, f"{path}.{name}")


def corrupt_header(tree):
    """A function that hands every float parameter to a visitor."""
    names = ("control", "machine", "protection")
    body = "\n".join(f"  visit({path});" for name in names for path in floats(tree[name], name))
    return (
        "template <class Control, class Machine, class Protection, class Visit>\n"
        "void corrupt(Control& control, Machine& machine, Protection& protection, Visit visit) "
        f"{{\n{body}\n}}\n"
    )


def built(drive: Drive, place: Path) -> Path:
    """The program that fuzzes the exported controller of a drive."""
    folder = firmware(drive, place / "package").folder
    (folder / "corrupt.hpp").write_text(corrupt_header(described(drive)))
    program = place / "fuzz"
    sources = [str(SOURCE), "controller.cpp"]
    build(sources, program, FLAGS, folder=folder, what="the package", link=SANITIZE)
    return program


def ran(program: Path, steps: int, seed: int = 0) -> str:
    """What is wrong after so many steps through the interface, and as many of the law behind it;
    nothing is where this is empty."""
    command = [str(program), str(steps), str(seed)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    good = done.returncode == 0 and done.stdout == "ok\n"
    return "" if good else f"{done.stdout}{done.stderr[-2000:]}"
