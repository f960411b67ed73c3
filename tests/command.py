"""A command in this process, with the exit code and the one line that a user would see."""

import contextlib
import io
import shlex
from dataclasses import dataclass

from reluctance.cli import app
from reluctance.cli.ended import exit_code


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


def refused(*arguments: object) -> str:
    """The line of a command that a user can mend: exit code 2, one line, nothing printed."""
    done = command(*arguments)
    what = shlex.join(map(str, arguments))
    assert done.code == 2, f"{what}: exit code {done.code}\n{done.out}{done.error}"
    assert done.error.startswith("error: ") and done.error.count("\n") == 1, done.error
    return done.error
