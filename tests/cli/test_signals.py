"""Signals at random instants, as tests/support/signals.py sends them by the hundred."""

import os
import random
import re
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import pytest
from command import wait_until_at_work
from signals import KEPT, LONG, TOLD, ended, is_told

ENDED = """
import os, signal, sys
from reluctance.base import toolchain
from reluctance.cli.ended import watch_signals
watch_signals()
command = ["sh", "-c", "sleep 99 & echo $! > pid; wait"]
if sys.argv[1] == "as it begins":
    class Popen(toolchain.Popen):
        def __init__(self, *given, **more):
            super().__init__(*given, **more)
            while not (os.path.exists("pid") and open("pid").read()):
                pass
            os.kill(os.getpid(), signal.SIGTERM)
    toolchain.Popen = Popen
toolchain.build(["x.cpp"], "x.so", folder=".", what="x", command=command)
"""


@pytest.mark.parametrize("when", ["at work", "as it begins"])
def test_a_compiler_ends_with_the_command(when: str, tmp_path: Path) -> None:
    line = [sys.executable, "-c", ENDED, when]
    running = subprocess.Popen(line, stderr=subprocess.PIPE, cwd=tmp_path)
    pid = tmp_path / "pid"
    while running.poll() is None and not (pid.exists() and pid.read_text()):
        time.sleep(0.01)
    if when == "at work":
        running.send_signal(signal.SIGTERM)
    assert b"interrupted" in running.communicate()[1]
    state = Path(f"/proc/{pid.read_text().strip()}/stat")
    end = time.monotonic() + 30  # the compiler takes 99 s by itself
    while state.exists() and state.read_text().split()[2] != "Z" and time.monotonic() < end:
        time.sleep(0.01)
    assert time.monotonic() < end


def test_a_sweep_that_is_ended_says_how_many_runs_are_kept(tmp_path: Path) -> None:
    store = tmp_path / "runs.sqlite"
    line = ("sweep", LONG["sweep"][1], "--vary", "control.i_band_A=0.5:2:9999", "--out", store)
    running = subprocess.Popen(
        [sys.executable, "-m", "reluctance", *map(str, line)],
        **{"cwd": tmp_path, "text": True, "stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE},
    )
    while running.poll() is None and not _runs(store):
        time.sleep(0.02)
    running.send_signal(signal.SIGINT)
    said = re.search(KEPT, running.communicate()[1])
    assert said and (int(said["count"]), said["store"]) == (_runs(store), str(store))


def _runs(store: Path) -> int:
    if not store.exists():
        return 0
    with closing(sqlite3.connect(store)) as base:
        return int(base.execute("SELECT COUNT(*) FROM runs").fetchone()[0])


@pytest.mark.long
@pytest.mark.parametrize("name", LONG)
def test_a_signal_at_any_instant_is_one_line_and_leaves_nothing(name: str) -> None:
    draw = random.Random(name)
    found = [ended(name, draw) for _ in range(3)]
    assert [wrong for _, wrong in found] == ["", "", ""]


EARLY = """
import os, signal, sys

class Signal:
    def find_spec(self, name, path=None, target=None):
        if name == wanted:
            os.kill(os.getpid(), signal.SIGINT)

wanted = sys.argv[1]
sys.meta_path.insert(0, Signal())
from reluctance.cli import main
sys.argv[1:] = ["--version"]
main()
"""


@pytest.mark.parametrize("module", ["typer", "numpy", "reluctance.drive", "reluctance.cli.tune"])
def test_an_end_while_modules_are_imported_is_one_line(module: str) -> None:
    done = subprocess.run([sys.executable, "-c", EARLY, module], capture_output=True, text=True)
    told = f"{TOLD}\n"
    assert (done.returncode, done.stdout, done.stderr) == (130, "", told)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["Ctrl-C", "terminate"])
@pytest.mark.parametrize(
    "name",
    ["run", *(pytest.param(n, marks=pytest.mark.long) for n in ("limit", "sweep", "compare"))],
)
def test_a_signal_ends_it_at_once_and_leaves_nothing(
    name: str, number: int, tmp_path: Path
) -> None:
    """128 and its number, as shells have it: 130 for Ctrl-C; at the first press."""
    done = subprocess.Popen(
        [sys.executable, "-m", "reluctance", *map(str, LONG[name])],
        cwd=tmp_path,
        env={**os.environ, "RELUCTANCE_CACHE": str(tmp_path / "cache")},
        text=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )
    wait_until_at_work(done)
    assert done.poll() is None, "ended before the signal: take longer work"
    done.send_signal(number)
    lines = done.communicate()[1].splitlines()  # the work would take minutes
    assert done.returncode == 128 + number
    # Python 3.11 may add its semaphores
    assert is_told([x for x in lines if "resource_tracker" not in x and "warnings.warn" not in x])
    shutil.rmtree(tmp_path / "cache", ignore_errors=True)
    assert not list(tmp_path.iterdir())
