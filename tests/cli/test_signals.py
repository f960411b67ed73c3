"""Signals at random instants, as tests/support/signals.py sends them by the hundred."""

import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from signals import LONG, ended

ENDED = """
import sys
from reluctance.base.toolchain import build
from reluctance.cli.ended import watch_signals
watch_signals()
command = ["sh", "-c", "sleep 99 & echo $! > pid; wait"]
build(["x.cpp"], "x.so", folder=sys.argv[1], what="x", command=command)
"""


def test_a_compiler_ends_with_the_command(tmp_path: Path) -> None:
    running = subprocess.Popen([sys.executable, "-c", ENDED, tmp_path], stderr=subprocess.PIPE)
    pid = tmp_path / "pid"
    while running.poll() is None and not (pid.exists() and pid.read_text()):
        time.sleep(0.01)
    running.send_signal(signal.SIGTERM)
    assert b"interrupted" in running.communicate()[1]
    state = Path(f"/proc/{pid.read_text().strip()}/stat")
    end = time.monotonic() + 30  # the compiler takes 99 s by itself
    while state.exists() and state.read_text().split()[2] != "Z" and time.monotonic() < end:
        time.sleep(0.01)
    assert time.monotonic() < end


@pytest.mark.long
@pytest.mark.parametrize("name", LONG)
def test_a_signal_at_any_instant_is_one_line_and_leaves_nothing(name: str) -> None:
    draw = random.Random(name)
    found = [ended(name, draw) for _ in range(3)]
    assert [wrong for _, wrong in found] == ["", "", ""]
