"""How a command ends: its exit code, and one line for what a user can mend."""

import os
import re
import signal
import sys
import warnings
from collections.abc import Callable
from io import TextIOWrapper
from types import FrameType
from typing import Any

from reluctance.base.errors import Note, ParameterError, Unsolved, one_line
from reluctance.base.files import kept, puts_off, remove_unfinished
from reluctance.cli.lines import wrapped

SIGNALS = (signal.SIGINT, signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM))
UNITS = {"SECONDS": "s", "VOLTS": "V", "AMPERE": "A", "MICROSECONDS": "us"}  # of what options take
CLOSED_PIPE = 128 + 13  # SIGPIPE, as of other commands in a shell: 141


def exit_code(command: Callable[[], object]) -> int:
    """Runs a command: 0, or the code that it asks for; 2 for what a user can mend, told on one
    line."""
    try:
        code = command()
        sys.stdout.flush()
        return code if isinstance(code, int) else 0
    except (ParameterError, Unsolved) as fault:
        _tell(f"error: {one_line(fault)}")
    except MemoryError:
        _tell("error: not enough memory; run shorter, or record on a grid with --record-us")
    except Exception as fault:
        if not hasattr(fault, "format_message"):  # what the command line library raises has it
            raise
        _tell(
            f"error: {one_line(_wrong_value(fault) or fault.format_message())}{_who_has_it(fault)}"
        )
    return 2


def _wrong_value(fault: Any) -> str:
    """Of an option whose value is not what it needs; else nothing."""
    cause, option = fault.__cause__, getattr(fault, "param", None)
    if option is None or not hasattr(cause, "errors"):
        return ""
    from reluctance.base.schema import of_option  # for mistakes only

    name = next((opt for opt in option.opts if opt.startswith("--")), option.opts[0])
    return of_option(cause, name, UNITS.get(option.metavar, ""))


def _who_has_it(fault: Any) -> str:
    """The other commands that know an option, where this one neither does nor has one like it; or
    how `--set` is written, where spaces have torn it apart."""
    torn = re.search(r"extra argument\(s\) \((=.*)\)", fault.format_message())
    if torn and fault.ctx is not None and fault.ctx.params.get("overrides"):
        name, value = fault.ctx.params["overrides"][-1], torn[1].lstrip("= ")
        return f"; write --set {name.rstrip('= ')}={value} without spaces"
    option = getattr(fault, "option_name", None)
    if option is None or fault.ctx is None or getattr(fault, "possibilities", True):
        return ""
    commands = getattr(fault.ctx.find_root().command, "commands", {})
    having = [
        f"`reluctance {name}`"
        for name, command in commands.items()
        if any(option in parameter.opts for parameter in command.params)
    ]
    return f"; it is an option of {', '.join(having)}" if having else ""


class Output(TextIOWrapper):
    """Standard output whose faults end a command: a closed pipe, as of `| head`, without a word,
    since nobody listens; a full disk as an error that a user can mend.

    Neither Rich nor Click then ends the process in its own way.
    """

    def write(self, text: str) -> int:
        try:
            return super().write(text)
        except OSError as fault:
            raise self._closed(fault) from None

    def flush(self) -> None:
        try:
            super().flush()
        except OSError as fault:
            raise self._closed(fault) from None

    def _closed(self, fault: OSError) -> BaseException:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, self.fileno())  # what is left in buffers fails no second time at the exit
        if isinstance(fault, BrokenPipeError):
            return SystemExit(CLOSED_PIPE)
        return ParameterError(f"cannot write to standard output: {fault.strerror}")


def watch_output() -> None:
    """Puts `Output` in the place of standard output."""
    if sys.stdout is None:  # closed by the shell: >&-
        sys.stdout = open(os.devnull, "w", encoding="utf-8")
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w", encoding="utf-8")
    plain = sys.stdout
    if isinstance(plain, TextIOWrapper) and not isinstance(plain, Output):
        kind = plain.encoding, plain.errors, plain.newlines, plain.line_buffering
        plain.flush()
        sys.stdout = Output(plain.detach(), kind[0], kind[1], None, kind[3])


def tell_notes() -> None:
    """A Note is one line on standard error, once, without the place in the code."""
    usual, before = warnings.formatwarning, set[str]()

    def told(message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> str:
        if issubclass(category, Note):
            line = wrapped(f"note: {one_line(message)}", sys.stderr) + "\n"
            if line in before:
                return ""
            before.add(line)
            return line
        return usual(message, category, *place, **more)

    warnings.formatwarning = told


def watch_signals() -> None:
    """Ctrl-C and requests to end: no half-written file stays, and one line says so."""
    for number in SIGNALS:
        signal.signal(number, _end)


def _end(number: int, frame: FrameType | None) -> None:
    """Ends the process here and now. Not by an exception: the optimiser's wrapper prints it and
    goes on."""
    if puts_off(number):
        return
    if "multiprocessing" in sys.modules:
        for child in sys.modules["multiprocessing"].active_children():
            child.kill()
    remove_unfinished()
    shown = "\r\x1b[K\x1b[?25h" if sys.stderr.isatty() else ""  # the bar off, the cursor back
    try:
        os.write(2, f"{shown}interrupted; no file is left half-written{_stays()}\n".encode())
    finally:
        os._exit(128 + number)


def _stays() -> str:
    """What the stores have of the work of this command."""
    return "".join(
        f"; {count} runs are kept in {path}: the same command goes on from there"
        for path, count in kept.items()
    )


def _tell(line: str) -> None:
    try:
        print(wrapped(line, sys.stderr), file=sys.stderr)
    except OSError:
        pass  # nobody listens
