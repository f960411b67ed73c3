"""Processor time and memory of the build: each file of the extension module, compiled by itself.

The commands are those of CMake for a release; nothing is taken from a compiler cache.

    python bench/build.py                      what `make run` compiles, into bench/build.csv
    python bench/build.py other_forms         prints the files with `other_forms` in their name
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

import nanobind

ROOT = Path(__file__).parents[1]
HEADER = ("file", "processor_s", "memory_MB")


def configured(build: Path, other_forms: str) -> list[dict[str, str]]:
    """The commands of the compiler, as CMake makes them."""
    command = ["cmake", "-S", str(ROOT), "-B", str(build), "-G", "Ninja"]
    command += ["-DCMAKE_BUILD_TYPE=Release", f"-DRELUCTANCE_OTHER_FORMS={other_forms}"]
    command += [f"-DPython_EXECUTABLE={sys.executable}", "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON"]
    command += [f"-Dnanobind_DIR={nanobind.cmake_dir()}", "-DCMAKE_CXX_COMPILER_LAUNCHER="]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    found: list[dict[str, str]] = json.loads((build / "compile_commands.json").read_text())
    return found


def cost(command: str, folder: str) -> tuple[float, float]:
    """Processor time, user and system [s], and greatest memory [MB] of a command."""
    process = subprocess.Popen(
        shlex.split(command), cwd=folder, env={**os.environ, "CCACHE_DISABLE": "1"}
    )
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        raise SystemExit(f"error: {command}")
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def short(file: Path, build: Path) -> str:
    """The path within the sources or the build, as `bindings/frame.cpp`."""
    for folder in (build, ROOT):
        if folder in file.parents and not {".venv", "CMakeFiles"} & set(file.parts):
            return str(file.relative_to(folder))
    return file.name


def measured(part: str) -> list[tuple[str, float, float]]:
    """A row for each file, the costliest first, and the sum."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        commands = configured(Path(folder), "ON" if part else "OFF")
        for each in sorted(commands, key=lambda c: "cmake_pch" not in c["file"]):  # it comes first
            file = Path(each["file"])
            name = short(file, Path(folder))
            if part in name or "cmake_pch" in name:
                rows.append((name, *cost(each["command"], each["directory"])))
                print(f"{name:40} {rows[-1][1]:6.1f} s {rows[-1][2]:5.0f} MB", flush=True)
    rows.sort(key=lambda row: -row[1])
    return [*rows, ("all", sum(row[1] for row in rows), max(row[2] for row in rows))]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("part", nargs="?", default="", help="only files with this in their name")
    given = parser.parse_args()
    rows = measured(given.part)
    print(f"{rows[-1][0]:40} {rows[-1][1]:6.1f} s {rows[-1][2]:5.0f} MB")
    if not given.part:
        with (ROOT / "bench" / "build.csv").open("w", newline="") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(HEADER)
            table.writerows((name, f"{s:.1f}", f"{memory:.0f}") for name, s, memory in rows)


if __name__ == "__main__":
    main()
