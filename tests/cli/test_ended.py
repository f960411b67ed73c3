"""How commands end: their codes, their lines, and an output that nobody reads."""

import io
import multiprocessing
import os
import signal
import subprocess
import sys
import warnings
from types import SimpleNamespace

import click
import pytest

import reluctance as rl
from reluctance.base.errors import Note
from reluctance.cli import ended
from reluctance.cli.tune import at_the_end


@pytest.mark.parametrize("ends", [(2.0, 12.0), (12.0, 2.0)])
@pytest.mark.parametrize(
    ("value", "noted"),
    [(2.0, True), (2.19, True), (2.21, False), (7.0, False), (11.79, False), (11.81, True)],
)
def test_a_value_within_a_fiftieth_of_an_end_of_its_range_is_noted(ends, value, noted):
    found = at_the_end({"a.b": value, "a.c": 5.0}, {"a.b": ends})
    assert bool(found) == noted
    if noted:
        (line,) = found
        assert f"a.b = {value:g} is at the end of its range 2:12; " in line
    assert not at_the_end({"a.b": 2.0}, {"a.b": ("low", "high")})
    assert not at_the_end({"a.b": 2.0}, {"a.b": (2.0, 4.0, 6.0)})


def test_the_program_itself_tells_a_mistake_in_one_line():
    """Of ours, and of the options."""
    for words, need in ((["run", "nowhere.toml"], "nowhere.toml"), (["run", "--pot"], "--pot")):
        done = subprocess.run(
            [sys.executable, "-m", "reluctance", *words], capture_output=True, text=True
        )
        (line,) = done.stderr.splitlines()
        assert (done.returncode, done.stdout) == (2, "") and need in line


class Full(io.RawIOBase):
    """A file that takes nothing."""

    def __init__(self, fault):
        self.fault, self.file = fault, open(os.devnull, "wb")

    def writable(self):
        return True

    def write(self, text):
        raise self.fault

    def fileno(self):
        return self.file.fileno()


@pytest.mark.parametrize("ending", [ended.Output.flush, lambda out: out.write("y" * 10**6)])
def test_a_closed_pipe_ends_a_command_without_a_word_and_a_full_disk_is_told(ending):
    for fault, how in (
        (BrokenPipeError(32, "Broken pipe"), SystemExit),
        (OSError(28, "No space left on device"), rl.ParameterError),
    ):
        raw = Full(fault)
        out = ended.Output(io.BufferedWriter(raw, 16), "utf-8")
        with pytest.raises(how) as told:
            out.write("x" * 100)
            ending(out)
        code = getattr(told.value, "code", str(told.value))
        assert code in (128 + 13, "cannot write to standard output: No space left on device")
        raw.fault = None
        raw.write = lambda text: len(text)
        out.close()
        raw.file.close()


def test_standard_output_is_watched_once_and_one_that_is_closed_goes_nowhere(monkeypatch):
    with open(os.devnull, "wb") as nowhere:
        monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(nowhere, "utf-8"))
        ended.watch_output()
        watched = sys.stdout
        assert isinstance(watched, ended.Output) and watched.encoding == "utf-8"
        ended.watch_output()
        assert sys.stdout is watched
        kept = sys.stderr
        monkeypatch.setattr(sys, "stdout", None)
        monkeypatch.setattr(sys, "stderr", None)
        ended.watch_output()
        assert sys.stdout.name == sys.stderr.name == os.devnull
        sys.stdout.close(), sys.stderr.close()
        monkeypatch.setattr(sys, "stderr", kept)
        watched.close()


@pytest.mark.parametrize(
    ("result", "code", "told"),
    [
        (None, 0, ""),
        (3, 3, ""),
        (rl.ParameterError("mend it"), 2, "error: mend it"),
        (MemoryError(), 2, "error: not enough memory; run shorter"),
        (click.UsageError("no such\n thing"), 2, "error: no such thing"),
    ],
)
def test_a_command_ends_with_its_code_or_with_2_and_one_line(result, code, told, capsys):
    def run():
        if isinstance(result, BaseException):
            raise result
        return result

    assert ended.exit_code(run) == code
    err = capsys.readouterr().err
    assert err.startswith(told) and bool(err) == bool(told)


def test_what_is_no_fault_of_a_user_is_not_caught():
    def run():
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        ended.exit_code(run)


def test_a_note_is_one_line_and_another_warning_stays_as_it_is(monkeypatch):
    usual = warnings.formatwarning
    monkeypatch.setattr(warnings, "formatwarning", usual)
    ended.tell_notes()
    shown = warnings.formatwarning
    assert shown(Note("one\n two"), Note, "file.py", 7) == "note: one two\n"
    other = UserWarning("a"), UserWarning, "file.py", 7
    assert shown(*other) == usual(*other)


@pytest.mark.parametrize("terminal", [False, True])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_process_with_its_children_and_says_what_is_kept(
    monkeypatch, terminal, number
):
    did = []
    child = SimpleNamespace(kill=lambda: did.append("child"))
    monkeypatch.setattr(ended, "puts_off", lambda number: False)
    monkeypatch.setattr(ended, "remove_unfinished", lambda: did.append("files"))
    monkeypatch.setattr(ended, "kept", {"a.db": 12})
    monkeypatch.setattr(multiprocessing, "active_children", lambda: [child])
    monkeypatch.setattr(sys, "stderr", SimpleNamespace(isatty=lambda: terminal))
    monkeypatch.setattr(os, "write", lambda file, text: did.append((file, text.decode())))
    monkeypatch.setattr(os, "_exit", did.append)
    ended._end(number, None)
    *before, (file, text), code = did
    assert before == ["child", "files"] and (file, code) == (2, 128 + number)
    line = "interrupted; no file is left half-written; 12 runs are kept in a.db: the same command"
    assert text.removeprefix("\r\x1b[K\x1b[?25h") == f"{line} goes on from there\n"
    assert text.startswith("\r") == terminal
    monkeypatch.setattr(ended, "puts_off", lambda number: True)
    did.clear()
    ended._end(number, None)
    assert did == []
