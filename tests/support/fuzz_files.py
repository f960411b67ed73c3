"""Files of every format, changed at random under the eye of the coverage they reach.

    python tests/support/fuzz_files.py [FORMATS] [--seconds 120] [--seed N] [--out FILE.csv]

A reader may take a file or refuse it on one line, within 10 s and 1 GB. Whatever else happens is
made small and kept in out/fuzz; copied to tests/fuzz it is a case of
tests/base/test_damaged_files.py. Atheris (libFuzzer) steers by the branches of our own code. The
formats `c_interface` and `firmware` are the borders of C: random calls, samples and parameters
under the sanitizers for addresses and undefined behaviour.
"""

import argparse
import csv
import os
import re
import secrets
import subprocess
import sys
import tempfile
import time
import traceback
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
OUT = ROOT / "out" / "fuzz"
HANG, MEMORY = 10, 1024  # of a file [s, MB]
SMALLER = 20.0  # for making a find small [s]
HERE = Path("/dev/shm") if Path("/dev/shm").is_dir() else None
ENDS = {70: "hang", 71: "memory", 77: "crash"}  # of a process of libFuzzer
WORDS = ("nan", "inf", "1e999", "1e308", "-", "--", "0", "9" * 30, "[", "{", '"', "\\xff", "\\x00")
COUNTS = 2  # inputs and accepted ones, in a file that outlives the process


def judged(form, data: bytes, path: Path) -> tuple[str, bool]:
    """What is wrong, as the name of a find, "" where nothing is; and whether the file was taken."""
    from file_formats import finite, read_quietly

    from reluctance.base.errors import ParameterError

    path.write_bytes(form.wrap(data))
    try:
        found = read_quietly(form, path)
    except ParameterError as fault:
        text = str(fault)
        return ("" if text and "\n" not in text else "not_one_line"), False
    except Exception as fault:
        frames = traceback.extract_tb(fault.__traceback__)
        ours = [f for f in frames if "/reluctance/" in f.filename] or frames
        return f"{type(fault).__name__}_{Path(ours[-1].filename).stem}_{ours[-1].lineno}", False
    return ("" if not form.finite or finite(found) else "accepted_not_finite"), True


def child(name: str, seconds: float, seed: int, folder: Path) -> None:
    """Fuzzes one format in this process, which libFuzzer ends."""
    import atheris

    with atheris.instrument_imports(include=["reluctance"]):
        form = import_module("file_formats").FORMATS[name]
        path = folder / f"input{form.suffix}"
        for data in form.seeds():  # and what is imported on the way
            wrong, taken = judged(form, data, path)
            if wrong or taken != form.taken:
                form.read(path)  # says why
                raise RuntimeError(f"{name}: a seed is not right: {wrong}")
    counts = np.memmap(folder / "counts", np.int64, "r+", shape=(COUNTS,))

    def one(data: bytes) -> None:
        wrong, taken = judged(form, data, path)
        counts[:] += (1, taken)
        kept = folder / "finds" / wrong
        if wrong and not kept.exists():
            kept.write_bytes(data)

    options = [f"-max_total_time={max(1, int(seconds))}", f"-seed={seed}", f"-timeout={HANG}"]
    options += [f"-rss_limit_mb={MEMORY}", f"-artifact_prefix={folder}/ended_", "-max_len=40000"]
    options += [f"-dict={folder / 'words'}", str(folder / "corpus")]
    atheris.Setup([sys.argv[0], *options], one, enable_python_coverage=True)
    atheris.Fuzz()


def fuzzed(name: str, seconds: float, seed: int) -> tuple[int, int, int, dict[str, bytes]]:
    """Inputs, accepted ones, greatest memory [MB] and finds of a format."""
    from file_formats import FORMATS, beside

    form = FORMATS[name]
    finds: dict[str, bytes] = {}
    with tempfile.TemporaryDirectory(dir=HERE) as text:
        folder = Path(text)
        beside(folder)
        for inner in ("corpus", "finds"):
            (folder / inner).mkdir()
        for n, data in enumerate(form.seeds()):
            (folder / "corpus" / f"{n}").write_bytes(data)
        known = set(re.findall(rb"[A-Za-z_]\w{2,30}", b" ".join(form.seeds())))
        words = [*WORDS, *sorted(word.decode() for word in known)[:500]]
        quoted = [f'"{word}"' if word != '"' else '"\\""' for word in words]
        (folder / "words").write_text("\n".join(quoted))
        counts = np.memmap(folder / "counts", np.int64, "w+", shape=(COUNTS,))
        end, memory = time.monotonic() + seconds, 0
        while (left := end - time.monotonic()) > 1:
            command = [sys.executable, __file__, "--child", name, "--seconds", str(left)]
            done = subprocess.run(
                [*command, "--seed", str(seed), "--folder", text], capture_output=True, text=True
            )
            for peak in re.findall(r"rss: (\d+)Mb", done.stderr):
                memory = max(memory, int(peak))
            if done.returncode == 0:
                break
            kept = sorted(folder.glob("ended_*"))
            if done.returncode not in ENDS or not kept:
                raise RuntimeError(f"{name}, seed {seed}: {done.stderr[-2000:]}")
            finds[ENDS[done.returncode]] = kept[0].read_bytes()
            for path in kept:
                path.unlink()
            seed += 1
        for path in (folder / "finds").iterdir():
            finds[path.name] = smaller(form, path.read_bytes(), path.name, folder)
        return int(counts[0]), int(counts[1]), memory, finds


def smaller(form, data: bytes, wrong: str, folder: Path) -> bytes:
    """Less of an input with the same fault: parts are left out as long as there is time."""
    path, end, size = folder / f"less{form.suffix}", time.monotonic() + SMALLER, len(data)
    while size > 0 and time.monotonic() < end:
        size, at, before = max(1, size // 2), 0, len(data)
        while at < len(data) and time.monotonic() < end:
            less = data[:at] + data[at + size :]
            if judged(form, less, path)[0] == wrong:
                data = less
            else:
                at += size
        if size == 1 and len(data) == before:
            break
    return data


def c_interface(seconds: float, seed: int) -> int:
    """Calls of the C interface; RuntimeError with what a sanitizer says."""
    import c_fuzz

    calls = 0
    with tempfile.TemporaryDirectory() as place:
        files = c_fuzz.program(Path(place))
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            calls, seed = calls + c_fuzz.fuzzed(files, 1000, seed)["calls"], seed + 1
    return calls


def firmware(seconds: float, seed: int) -> int:
    """Steps of an exported package with random samples and parameters."""
    import firmware_tools
    from firmware_fuzz import built, ran

    steps = 0
    with tempfile.TemporaryDirectory() as place:
        program = built(firmware_tools.drive("deadbeat"), Path(place))
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            wrong = ran(program, 100_000, seed)
            if wrong:
                raise RuntimeError(f"firmware, seed {seed}: {wrong}")
            steps, seed = steps + 200_000, seed + 1
    return steps


BORDERS = {"c_interface": c_interface, "firmware": firmware}


def kept(name: str, wrong: str, data: bytes) -> str:
    """Keeps a find, and says how it becomes a test."""
    form = import_module("file_formats").FORMATS[name]
    folder = OUT / f"{name}_{wrong}"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"input{form.suffix}").write_bytes(form.wrap(data))
    shown = folder.relative_to(ROOT)
    return f"{name}: {wrong}, {len(data)} bytes {data[:80]!r}; as a test: cp -r {shown} tests/fuzz/"


def main() -> None:
    ask = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    ask.add_argument("formats", nargs="*", help="by default all, and the borders of C")
    ask.add_argument("--seconds", type=float, default=120.0, help="for each format")
    ask.add_argument("--seed", type=int, default=secrets.randbelow(10**6))
    ask.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    ask.add_argument("--out", type=Path, help="counts of each format, as CSV")
    ask.add_argument("--child", help=argparse.SUPPRESS)
    ask.add_argument("--folder", type=Path, help=argparse.SUPPRESS)
    given = ask.parse_args()
    if given.child:
        child(given.child, given.seconds, given.seed, given.folder)
    names = given.formats or [*import_module("file_formats").FORMATS, *BORDERS]
    print(f"seed {given.seed}", flush=True)
    rows, found = [], 0

    def one(name: str) -> tuple[int, int, int, dict[str, bytes]]:
        if name in BORDERS:
            return BORDERS[name](given.seconds, given.seed), 0, 0, {}
        return fuzzed(name, given.seconds, given.seed)

    with ThreadPoolExecutor(given.jobs) as pool:
        for name, (inputs, accepted, memory, finds) in zip(
            names, pool.map(one, names), strict=True
        ):
            print(f"{name}: {inputs} inputs, {accepted} accepted, {len(finds)} finds", flush=True)
            rows.append((name, given.seed, inputs, accepted, len(finds), memory or ""))
            found += len(finds)
            for wrong, data in finds.items():
                print(kept(name, wrong, data), flush=True)
    if given.out:
        with given.out.open("w", newline="") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(("format", "seed", "inputs", "accepted", "finds", "memory_MB"))
            table.writerows([*rows, ("all", given.seed, sum(r[2] for r in rows), "", found, "")])
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
