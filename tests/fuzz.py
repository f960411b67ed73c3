"""Random drive files and command lines: none may end in a traceback, hang, or leave another exit
code than 0 or 2.

    python tests/fuzz.py 100000            # cases in this process; --seed N, --processes N
    python tests/fuzz.py 200 --real        # each as a process of its own

A drive file starts as an example or is made from the JSON schema; then values, keys, tables and
bytes are changed. A case is a pure function of its seed, so that a failure is found again by it.
"""

import argparse
import contextlib
import io
import json
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
from pathlib import Path

import typer.main

from reluctance.cli import app
from reluctance.cli.ended import exit_code
from reluctance.cli.examples import example_files
from reluctance.cli.schema import json_schema
from reluctance.drive.library import entries
from reluctance.files import read_toml
from reluctance.resources import resources

HANG = 20.0  # [s] of processor time: a loaded machine is no fault
ALLOWED = {0, 2}
STEPS = 3000  # a run is cut to about so many: its length is no part of the question

NUMBERS = [0, 0.0, -0.0, 1, -1, 2, 7, 0.5, 1e-3, 1e-6, 1e-9, 1e-30, 5e-324, 1e3, 1e6, 1e9, 1e30]
NUMBERS += [1e300, 1.7976931348623157e308, -1e9, -1e300, 2**31, 2**63 - 1, -(2**63), 10**40]
NUMBERS += [float("nan"), float("inf"), float("-inf"), 0.1, 100, 240, 1500, 3.141592653589793]
TEXTS = ["", " ", "a", "none", "lehuy", "map", "[red]x[/]", "[/]", "{x}", "$\\frac$", "%s", "../x"]
TEXTS += ["\x00", "\x1b[31m", "\n", "ä", "𝛙", "a" * 3000, "/dev/null", "/", ".", "-", "--", "nul"]
TEXTS += ["<script>", "*/ int x; /*", "python:x.py:Y", "python:", "python::", '"', "\\", "'''"]
KEYS = ["x", "until", "T_s", "t_s", "values", "kind", "law", "machine", "", "a.b", "é", "u_dc"]
GUIDED = {"edge_mpc", "paper_mpc", "deadbeat", "torque_sharing", "ditc", "finite_set_mpc"}

COMMAND = typer.main.get_command(app)
EXAMPLES = {name: read_toml(path) for name, path in example_files().items()}
EXAMPLES = {name: data for name, data in EXAMPLES.items() if "control" in data}
MACHINES = [entry.key for entry in entries() if entry.machine.model == "lehuy"]
SCHEMA = json_schema()


def any_value(r, depth=0):
    """A value of any type."""
    kind = r.random()
    if kind < 0.55:
        return r.choice(NUMBERS)
    if kind < 0.75:
        return r.choice(TEXTS)
    if kind < 0.85:
        return r.random() < 0.5
    if depth > 2:
        return 10 ** r.uniform(-6, 6)
    if kind < 0.95:
        return [any_value(r, depth + 1) for _ in range(r.choice([0, 1, 2, 3, 40]))]
    return {r.choice(KEYS): any_value(r, depth + 1) for _ in range(r.randrange(3))}


def of_schema(r, node):
    """A value that a node of the schema allows, more or less."""
    if "$ref" in node:
        node = SCHEMA["$defs"][node["$ref"].rsplit("/", 1)[1]]
    if "anyOf" in node:
        return of_schema(r, r.choice(node["anyOf"]))
    if "const" in node:
        return node["const"]
    if "enum" in node:
        return r.choice(node["enum"])
    kind = node.get("type")
    if kind == "object":
        needed = node.get("required", [])
        return {
            key: of_schema(r, child)
            for key, child in node.get("properties", {}).items()
            if key in needed or r.random() < 0.25
        }
    if kind == "array":
        return sorted(10 ** r.uniform(-3, 3) for _ in range(r.randrange(4)))
    if kind == "number":
        return r.choice([10 ** r.uniform(-5, 4), r.uniform(0, 100), node.get("default", 1.0)])
    if kind == "integer":
        return r.choice([r.randrange(0, 20), node.get("default", 1)])
    if kind == "boolean":
        return r.random() < 0.5
    return None if kind == "null" else r.choice(TEXTS)


def drive_data(r):
    """The tables of a drive file, more or less."""
    if r.random() < 0.25:
        data = of_schema(r, SCHEMA)
        data["machine"] = r.choice([data["machine"], r.choice(MACHINES)])
    else:
        data = json.loads(json.dumps(EXAMPLES[r.choice(list(EXAMPLES))]))
        if r.random() < 0.3:
            data["machine"] = r.choice(MACHINES)
    for _ in range(r.choice([0, 0, 1, 1, 1, 2, 3, 8])):
        change(r, data)
    return data


def change(r, data):
    """One change somewhere in the tables."""
    path = [data]
    while isinstance(path[-1], dict) and path[-1] and (len(path) == 1 or r.random() < 0.7):
        key = r.choice(list(path[-1]))
        if not isinstance(path[-1][key], dict):
            break
        path.append(path[-1][key])
    table = path[-1]
    if not isinstance(table, dict) or not table:
        return
    key, kind = r.choice(list(table)), r.random()
    value = table[key]
    if kind < 0.5 and isinstance(value, int | float) and not isinstance(value, bool):
        factor = r.choice([r.uniform(0.3, 3), 10.0 ** r.randrange(-9, 10), -1, 0])
        table[key] = value * factor
    elif kind < 0.65:
        table[key] = any_value(r)
    elif kind < 0.75:
        del table[key]
    elif kind < 0.85:
        table[r.choice([*KEYS, key + "x", key[:-1], key.upper()])] = any_value(r)
    else:
        section = r.choice(list(SCHEMA["properties"]))
        data[section] = of_schema(r, SCHEMA["properties"][section])


def toml(data):
    """Tables as TOML text."""
    lines, below = [], []
    for key, value in data.items():
        name = json.dumps(str(key), ensure_ascii=False)
        if isinstance(value, dict):
            below.append((name, value))
        elif value is not None:
            lines.append(f"{name} = {inline(value)}")
    for name, table in below:
        lines.append(f"[{name}]")
        lines += [
            f"{json.dumps(str(k), ensure_ascii=False)} = {inline(v)}"
            for k, v in table.items()
            if v is not None
        ]
    return "\n".join(lines) + "\n"


def inline(value):
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        pairs = (f"{json.dumps(str(k))} = {inline(v)}" for k, v in value.items() if v is not None)
        return "{" + ", ".join(pairs) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(inline(v) for v in value if v is not None) + "]"
    return json.dumps(value) if isinstance(value, str) else repr(value)


def damaged(r, content):
    """Bytes with some changed, cut, doubled or put in."""
    content = bytearray(content)
    for _ in range(r.choice([1, 1, 2, 5])):
        place = r.randrange(len(content) + 1)
        kind = r.random()
        if kind < 0.3 and content:
            content[place % len(content)] = r.randrange(256)
        elif kind < 0.5:
            del content[place : place + r.choice([1, 5, 50])]
        elif kind < 0.7:
            content[place:place] = r.choice(
                [b"[", b"]", b"=", b'"', b"\n", b"e9", b"-", b"[[a]]\n"]
            )
        elif kind < 0.85:
            content[place:place] = bytes(r.randrange(256) for _ in range(r.randrange(1, 9)))
        else:
            content = content[:place]
    return bytes(content)


def until(data):
    """An end of the run that keeps it short, or None where its numbers say nothing."""
    steps = []
    for section, key, usual in (("control", "T_s_us", 20.0), ("simulation", "dt_max_us", 10.0)):
        table = data.get(section)
        value = table.get(key, usual) if isinstance(table, dict) else usual
        if isinstance(value, int | float) and 0 < value < 1e9:
            steps.append(value)
    return STEPS * min(steps, default=1.0) * 1e-6


def case(seed, folder):
    """The command line of a case; its files are made in the folder."""
    r = random.Random(seed)
    kind = r.random()
    if kind < 0.06:
        return other_command(r, folder)
    if kind < 0.14:
        return map_command(r, folder)
    data = drive_data(r)
    control = data.get("control")
    guided = isinstance(control, dict) and str(control.get("law")) in GUIDED
    if guided and r.random() < 0.93:  # their tables take seconds to compute
        data["control"] = {"law": "angles", "T_s_us": control.get("T_s_us", 20)}
        if r.random() < 0.5:
            change(r, data)
    content = toml(data).encode("utf-8", "surrogatepass")
    if r.random() < 0.1:
        content = damaged(r, content)
    name = r.choice(
        ["drive.toml"] * 12 + ["[red].toml", "a{b}.toml", "$x$.toml", "x", "é &<b>.toml"]
    )
    (folder / name).write_bytes(content)
    command = "run" if r.random() < 0.97 else r.choice(["limit", "export firmware"])
    given = [*command.split(), str(folder / name)]
    if command == "run":
        given += ["--until", repr(until(data))] if r.random() < 0.97 else []
        given += options(r, folder)
    elif command != "limit":
        given += ["--out", str(folder / "firmware")]
    for _ in range(r.choice([0, 0, 0, 1, 2])):
        given += ["--set", override(r)]
    return mangled(r, given) if r.random() < 0.05 else given


def override(r):
    section = r.choice([*SCHEMA["properties"], *KEYS])
    table = SCHEMA["properties"].get(section, {})
    node = SCHEMA["$defs"].get(table.get("$ref", "").rsplit("/", 1)[-1], {})
    key = r.choice([*node.get("properties", KEYS)])
    value = r.choice(
        [
            any_value(r),
            of_schema(r, node["properties"][key]) if key in node.get("properties", {}) else 1,
        ]
    )
    return r.choice(
        [
            f"{section}.{key}={inline(value) if value is not None else ''}",
            f"{section}={value}",
            f"{section}.{key}",
            "",
            "=",
            ".",
        ]
    )


def options(r, folder):
    """Options of `run`, mostly few."""
    found = []
    if r.random() < 0.15:
        found.append("--json")
    if r.random() < 0.06:
        name = r.choice(
            [
                "w.csv",
                "w.npz",
                "w.mat",
                "w",
                "no/w.csv",
                ".csv",
                "w.xls",
                "a\x00.csv",
                "b" * 300 + ".csv",
            ]
        )
        found += ["--out", str(folder / name)]
    if r.random() < 0.02:
        found += ["--plot", str(folder / r.choice(["p.svg", "p.html", "p.png", "p.txt", "/p.png"]))]
    if r.random() < 0.05:
        found += ["--record-us", str(r.choice(NUMBERS))]
    if r.random() < 0.03:
        found += ["--until", str(r.choice([0, -1, 1e-30, 1e-7, 1e9, 1e300, "nan", "inf", "x", ""]))]
    return found


def mangled(r, given):
    """A command line with a word too many, too few, or wrong."""
    given = list(given)
    place = r.randrange(len(given) + 1)
    kind = r.random()
    if kind < 0.4:
        given.insert(place, r.choice([*TEXTS, "--help", "--json", "--nope", "-x", "--until"]))
    elif kind < 0.7 and given:
        del given[min(place, len(given) - 1)]
    else:
        r.shuffle(given)
    return given


def other_command(r, folder):
    given = r.choice(
        [
            [],
            ["machines", r.choice([*MACHINES, *TEXTS])],
            ["examples", r.choice([*EXAMPLES, *TEXTS])],
            ["examples", "--copy", str(folder / "made")],
            ["schema"],
            ["map"],
            ["export", "firmware", str(folder)],
            [r.choice(["run", "limit", "compare", "map", "paper"]), "--help"],
            ["run", r.choice(TEXTS)],
            ["limit", "/dev/null"],
            ["map", "check", r.choice(TEXTS)],
        ]
    )
    return mangled(r, given) if r.random() < 0.5 else given


def map_command(r, folder):
    """A flux map, read from a library's file with changes, or made up."""
    source = r.choice(sorted(resources("machines").glob("*.csv")))
    if r.random() < 0.7:
        lines = [x for x in source.read_text().splitlines() if not x.startswith("#")]
        content = "\n".join(lines[: r.choice([3, 50, 400])]).encode()
        content = damaged(r, content) if r.random() < 0.8 else content
    else:
        cells = [[str(r.choice(NUMBERS[:12])) for _ in range(5)] for _ in range(6)]
        content = "\n".join(r.choice([",", ";", "\t", " "]).join(row) for row in cells).encode()
    path = (
        folder / f"map.{r.choice(['csv', 'csv', 'csv', 'txt', 'json', 'mat', 'xlsx', 'dat', 'x'])}"
    )
    path.write_bytes(content)
    given = ["map", r.choice(["check", "check", "fit"]), str(path)]
    for option, values in (
        ("--N_r", [4, 6, 0, -1, 10**9]),
        ("--angle_unit", ["deg", "rad", "x"]),
        ("--angle_kind", ["mechanical", "electrical"]),
        ("--zero", ["aligned", "unaligned", "0"]),
        ("--aligned_at", [0, 45, "nan", 1e300, -1e-300]),
        ("--layout", ["currents_down", "angles_down"]),
        ("--turns_factor", [1, 2, 0, "nan", "inf", 1e300]),
        ("--name", ["i=1", "psi=2", "theta=x", "=", "tau="]),
    ):
        if r.random() < (0.9 if option == "--N_r" else 0.12):
            given += [option, str(r.choice(values))]
    return given


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
    line = [sys.executable, "-m", "reluctance.cli", *given]
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


def fuzz(seeds, run=in_process, told=None):
    """The failures among some seeds: {seed: what is wrong}."""
    failures = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for n, seed in enumerate(seeds, 1):
            if wrong := judged(seed, run):
                failures[seed] = wrong
            if told is not None:
                told(n, failures)
    return failures


def main():
    ask = argparse.ArgumentParser()
    ask.add_argument("cases", type=int)
    ask.add_argument("--seed", type=int, default=0)
    ask.add_argument("--real", action="store_true")
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

    run = as_process if given.real else in_process
    failures = fuzz(range(given.seed, given.seed + given.cases), run, told)
    kinds = Counter(text.strip().splitlines()[-1][:150] for text in failures.values())
    print(f"{given.cases} cases, {len(failures)} failures, {time.time() - start:.0f} s")
    for kind, count in kinds.most_common(40):
        print(count, kind)
    sys.exit(bool(failures))


if __name__ == "__main__":
    main()
