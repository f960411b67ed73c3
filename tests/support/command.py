"""A command in this process, with the exit code and the one line that a user would see."""

import contextlib
import io
import os
import re
import shlex
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

from reluctance.cli import app, progress
from reluctance.cli.ended import exit_code

progress.AFTER_S = progress.EVERY_S = 1e6  # no clock decides what a test sees
ESCAPE = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")  # what moves the cursor of a terminal


@dataclass(frozen=True)
class Done:
    code: int
    out: str
    error: str


def command(*arguments: object) -> Done:
    """What `reluctance ARGUMENTS` does; any other exception than a user's fault comes through."""
    out, error = io.StringIO(), io.StringIO()
    given = [str(a) for a in arguments]
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
        code = exit_code(lambda: app(given, standalone_mode=False))
    return Done(code, out.getvalue(), error.getvalue())


class Terminal(io.StringIO):
    """It says that it is one."""

    def isatty(self) -> bool:
        return True


def on_terminal(*arguments: object, errors: bool = False) -> list[str]:
    """The lines of `reluctance ARGUMENTS`, or those of its errors, on a terminal of 80 columns."""
    screen, other, usual = Terminal(), io.StringIO(), os.environ.get("COLUMNS")
    os.environ["COLUMNS"] = "80"
    out, error = (other, screen) if errors else (screen, other)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
            exit_code(lambda: app([str(a) for a in arguments], standalone_mode=False))
    finally:
        os.environ.pop("COLUMNS")
        if usual is not None:
            os.environ["COLUMNS"] = usual
    return ESCAPE.sub("", screen.getvalue()).splitlines()


def refused(*arguments: object) -> str:
    """The line of a command that a user can mend: exit code 2, one line, nothing printed."""
    done = command(*arguments)
    what = shlex.join(map(str, arguments))
    assert done.code == 2, f"{what}: exit code {done.code}\n{done.out}{done.error}"
    assert done.error.startswith("error: ") and done.error.count("\n") == 1, done.error
    return done.error


def words(text: str) -> str:
    """A text as one line, wherever it was wrapped."""
    return " ".join(text.split())


def wait_until_at_work(running: subprocess.Popen[str]) -> None:
    """Until a command and the processes of its pool have used 2 s of processor time: the imports
    are over then."""
    while running.poll() is None and processor_time(running.pid) < 2:
        time.sleep(0.02)


def processor_time(pid: int) -> float:
    """Of a process and of those that it started [s]; 0 of one that has ended."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        tasks = Path(f"/proc/{pid}/task").glob("*/children")
        children = [int(child) for task in tasks for child in task.read_text().split()]
    except OSError:
        return 0.0
    own = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return own + sum(map(processor_time, children))
