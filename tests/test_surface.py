"""The public surface is checked in, so that every change of it shows in review.

After an intended change: `python tests/test_surface.py` writes both references anew.
"""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
STUB = ROOT / "python" / "reluctance" / "_core.pyi"
HELP = ROOT / "tests" / "golden" / "cli_help.txt"
COMMANDS = (
    "",
    "run",
    "paper",
    "machines",
    "map",
    "map check",
    "map fit",
    "map plot",
    "limit",
    "compare",
    "pump",
    "size",
    "export",
    "export firmware",
)


def stub(path: Path) -> str:
    """The stub of the extension module as nanobind writes it."""
    command = [sys.executable, "-m", "nanobind.stubgen", "-q", "-m", "reluctance._core", "-o", path]
    subprocess.run(command, check=True)
    return path.read_text()


def cli_help() -> str:
    """The help of every command, 100 columns wide."""
    environment = {**os.environ, "COLUMNS": "100", "TERMINAL_WIDTH": "100", "NO_COLOR": "1"}
    pages = []
    for command in COMMANDS:
        arguments = [sys.executable, "-m", "reluctance.cli", *command.split(), "--help"]
        done = subprocess.run(arguments, capture_output=True, text=True, env=environment)
        assert done.returncode == 0, done.stderr
        text = done.stdout.replace("python -m reluctance.cli", "reluctance")
        pages.append(f"$ reluctance {command} --help\n{text.strip()}\n")
    return "\n".join(line.rstrip() for line in "\n".join(pages).splitlines()) + "\n"


def test_stub_is_that_of_the_module(tmp_path):
    assert stub(tmp_path / "_core.pyi") == STUB.read_text()


def test_help_of_the_command_line_is_the_one_checked_in():
    assert cli_help() == HELP.read_text()


if __name__ == "__main__":
    stub(STUB)
    HELP.write_text(cli_help())
