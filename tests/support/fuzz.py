"""Random drive files and command lines: none may end in a traceback, hang, or leave another exit
code than 0 or 2.

    python tests/support/fuzz.py 100000            # command lines in this process; --seed N
    python tests/support/fuzz.py 200 --real        # each as a process of its own
    python tests/support/fuzz.py 1000000 --tables  # drive files only, read and not run

A drive file starts as an example or is made from the JSON schema; then values, keys, tables and
bytes are changed. A case is a pure function of its seed, so that a failure is found again by it.
"""

import argparse
import contextlib
import io
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from functools import partial
from pathlib import Path

import typer.main
from fuzz_drives import damaged, drive_data, toml
from fuzz_lines import case

from reluctance.base.errors import ParameterError
from reluctance.cli import app
from reluctance.cli.ended import exit_code
from reluctance.drive.drive import drive_from
from reluctance.drive.load import load

HANG = 20.0  # [s] of processor time: a loaded machine is no fault
ALLOWED = {0, 2}

COMMAND = typer.main.get_command(app)


class Hang(BaseException):
    """A case took too long."""


def _hangs(*_):
    raise Hang


def in_process(given):
    """Exit code, and what was printed on standard error."""
    out, error = io.StringIO(), io.StringIO()
    signal.signal(signal.SIGPROF, _hangs)
    signal.setitimer(signal.ITIMER_PROF, HANG)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
            return exit_code(lambda: COMMAND.main(given, standalone_mode=False)), error.getvalue()
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)


def as_process(given):
    line = [sys.executable, "-m", "reluctance", *given]
    done = subprocess.run(line, capture_output=True, timeout=10 * HANG)
    return done.returncode, done.stderr.decode("utf-8", "replace")


def judged(seed, run=in_process):
    """None, or what is wrong with a case."""
    folder = Path(tempfile.mkdtemp(prefix="fuzz"))
    here = os.getcwd()
    os.chdir(folder)
    given = []
    try:
        given = case(seed, folder)
        if run is as_process and any("\x00" in word for word in given):
            return None  # no process can be given this
        code, error = run(given)
        if code not in ALLOWED and not (code == 1 and given[:2] == ["map", "check"]):
            return f"exit code {code}: {error[-2000:]}"
        if "Traceback" in error:
            return error[-2000:]
        if code == 2 and (not error.startswith(("error: ", "note: ")) or error.count("\n") > 2):
            return f"not one line: {error[:1000]!r}"
        if left := [p.name for p in folder.rglob("tmp*")]:
            return f"left behind: {left}"
        return None
    except (Hang, subprocess.TimeoutExpired):
        return f"hangs for {HANG} s"
    except Exception:
        return traceback.format_exc()[-3000:]
    finally:
        os.chdir(here)
        shutil.rmtree(folder, ignore_errors=True)


def judged_tables(seed):
    """None, or what is wrong with the answer to a drive file: it gives a drive, which its own
    tables give again, or one line. One file in ten is read as bytes, with some of them damaged."""
    r = random.Random(seed)
    data = drive_data(r)
    signal.signal(signal.SIGPROF, _hangs)
    signal.setitimer(signal.ITIMER_PROF, HANG)
    try:
        if r.random() < 0.1:
            with tempfile.NamedTemporaryFile(suffix=".toml") as file:
                file.write(damaged(r, toml(data).encode("utf-8", "surrogatepass")))
                file.flush()
                drive = load(file.name)
        else:
            drive = drive_from(data)
        again = drive_from(drive.tables(), name=drive.name)
        return None if again == drive else "another drive from its own tables"
    except ParameterError as fault:
        text = str(fault)
        return None if text and "\n" not in text else f"not one line: {text!r}"
    except Hang:
        return f"hangs for {HANG} s"
    except Exception:
        return traceback.format_exc()[-3000:]
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)


def fuzz(seeds, judge=judged, told=None):
    """The failures among some seeds: {seed: what is wrong}."""
    failures = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for n, seed in enumerate(seeds, 1):
            if wrong := judge(seed):
                failures[seed] = wrong
            if told is not None:
                told(n, failures)
    return failures


def main():
    ask = argparse.ArgumentParser()
    ask.add_argument("cases", type=int)
    ask.add_argument("--seed", type=int, default=0)
    ask.add_argument("--real", action="store_true")
    ask.add_argument("--tables", action="store_true")
    ask.add_argument("--show", action="store_true", help="print the case of --seed and its files")
    ask.add_argument("--log", type=Path, default=Path("fuzz.log"))
    given = ask.parse_args()
    os.environ.setdefault("RELUCTANCE_CACHE", tempfile.mkdtemp(prefix="cache"))
    if given.show:
        folder = Path(tempfile.mkdtemp(prefix="shown"))
        print(case(given.seed, folder))
        for path in folder.iterdir():
            print(path, path.read_bytes().decode("utf-8", "replace"), sep="\n")
        return
    start, seen = time.time(), set()

    def told(n, failures):
        for seed in failures.keys() - seen:
            seen.add(seed)
            with given.log.open("a") as log:
                log.write(f"==== seed {seed}\n{failures[seed]}\n")
        if n % 1000 == 0:
            print(f"{n} cases, {len(failures)} failures, {time.time() - start:.0f} s", flush=True)

    judge = judged_tables if given.tables else judged
    if given.real:
        judge = partial(judged, run=as_process)
    failures = fuzz(range(given.seed, given.seed + given.cases), judge, told)
    kinds = Counter(text.strip().splitlines()[-1][:150] for text in failures.values())
    print(f"{given.cases} cases, {len(failures)} failures, {time.time() - start:.0f} s")
    for kind, count in kinds.most_common(40):
        print(count, kind)
    sys.exit(bool(failures))


if __name__ == "__main__":
    main()
