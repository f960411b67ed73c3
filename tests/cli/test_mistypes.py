"""Two hundred mistypes in drives, systems, geometries and maps: each is answered in one line whose
remedy, followed to the letter, works; none is accepted.

A remedy that proposes a key, a table, a choice or a number is followed with what it proposes. One
that names a key and what it needs is followed with the value that the user had meant.
"""

import copy
import csv
import difflib
import io
import random
import re
import shutil
import time
from pathlib import Path

import numpy as np
import pytest
from fuzz_drives import toml

import reluctance as rl
from reluctance.base.errors import ParameterError
from reluctance.base.toml_file import read_toml
from reluctance.machine.geometry.geometry_machine import geometry_of
from reluctance.machine.geometry.mesh import Grid
from reluctance.machine.geometry.solved import content
from reluctance.machine.library import machine_table
from reluctance.machine.maps import check_map, read_map
from reluctance.pumping.drive_of import drive_of
from reluctance.pumping.system import load_system

ROOT = Path(__file__).parents[2]
SEED = time.time_ns() % 1_000_000
EACH = 50  # of each of the four kinds of file
ROUNDS = 3  # of one file: a second fault may hide behind the first


def load_geometry(path):
    """All but the field, which a machine may take minutes for."""
    geometry = geometry_of(machine_table(path.name, path.parent), "[machine]")
    return geometry.cross_section, content(geometry, Grid())


def load_pumping(path):
    """With the pump on its pipe, as all commands of a system have it."""
    return drive_of(load_system(path))


KINDS = {
    "drive": (rl.load, ["examples/deadbeat", "examples/map_mpc", "examples/fan"]),
    "system": (load_pumping, ["examples/sun_village", "examples/sun_day"]),
    "geometry": (load_geometry, [f"machines/geometry/own_{x}" for x in ("12_8", "10_8")]),
}
# Values of a file that every one needs, and that must be positive.
NEEDED = {
    "drive": ["converter.u_dc_V", "control.T_s_us"],
    "system": ["pump.n_ref_rpm", "array.n_series", "site.latitude_deg", "pipe.H_static_m"],
    "geometry": [
        *("lamination.stack_length_mm", "stator.bore_diameter_mm", "rotor.pole_height_mm"),
        *("air_gap.length_mm", "winding.turns_per_pole", "map.current_max_A"),
    ],
}
POSITIVE = {
    "drive": ["converter.u_dc_V", "control.T_s_us", "simulation.until_s"],
    "system": ["pump.n_ref_rpm", "array.n_series", "tank.volume_m3", "pipe.D_mm"],
    "geometry": [name for name in NEEDED["geometry"]],
}
# Values in another unit than their key says that no machine and no drive has.
SLIPS = {
    "drive": [("control.T_s_us", 1e-6), ("converter.u_dc_V", 1e6)],
    "system": [("pipe.D_mm", 1e-3), ("site.latitude_deg", 60.0)],
    "geometry": [
        *(("stator.bore_diameter_mm", 1e-3), ("air_gap.length_mm", 1e-3)),
        *(("stator.pole_arc_deg", np.pi / 180), ("rotor.pole_arc_deg", np.pi / 180)),
        *(("rotor.shaft_diameter_mm", 10.0), ("stator.outer_diameter_mm", 0.1)),
    ],
}


UNITS = {  # of keys, and another one with its part of the first
    **{"V": ("kV", 1e-3), "us": ("ms", 1e-3), "s": ("ms", 1e3), "mm": ("m", 1e-3)},
    **{"m": ("mm", 1e3), "A": ("mA", 1e3), "Nm": ("mNm", 1e3), "kHz": ("Hz", 1e3)},
    **{"rpm": ("radps", np.pi / 30), "deg": ("rad", np.pi / 180), "ohm": ("mohm", 1e3)},
}


def misspelt(r, word):
    """A word with one letter too many, too few, in the wrong place, or a missing unit."""
    if len(word) == 1:
        return 2 * word
    letters = [n for n, c in enumerate(word) if c.isalpha()]
    n = r.choice(letters[:-1])
    ways = [
        word[:n] + word[n] + word[n:],
        word[:n] + word[n + 1 :],
        word[:n] + word[n + 1] + word[n] + word[n + 2 :],
        word.rpartition("_")[0] or word[:-1],
        word.swapcase(),
    ]
    return r.choice([way for way in ways if way and way != word])


def places(data):
    """All keys of tables, as (table, key)."""
    return [(t, key) for t, table in data.items() if isinstance(table, dict) for key in table]


def choices(data):
    """Those whose value is one of few words."""
    words = ("kind", "law", "steel", "module", "timezone")
    return [(t, k) for t, k in places(data) if k in words and isinstance(data[t][k], str)]


def having(data, names):
    """Those of these names, TABLE.KEY, that the file has."""
    return [place for place in places(data) if ".".join(place) in names]


def mistyped(r, kind, data, text):
    """The file with one mistake, and what it is."""
    data = copy.deepcopy(data)
    ways = ["key", "table", "text", "comma", "list", "slip", "moved", "truth"]
    ways += ["pen", "pen", "unit"]
    ways += ["word"] if (words := choices(data)) else []
    ways += ["missing", "sign"] if kind != "drive" or "u_dc_V" in data["converter"] else []
    choice = r.choice(ways)
    table, key = r.choice(places(data))
    if choice == "pen":
        return slip_of_the_pen(r, text)
    if choice == "unit":
        numbers = [(t, k) for t, k in places(data) if type(data[t][k]) in (int, float)]
        table, key = r.choice([(t, k) for t, k in numbers if k.rpartition("_")[2] in UNITS])
        name, _, unit = key.rpartition("_")
        other, part = UNITS[unit]
        new, value = f"{name}_{other}", data[table][key] * part
        data[table] = {
            new if k == key else k: value if k == key else v for k, v in data[table].items()
        }
    elif choice == "key":
        new = misspelt(r, key)
        data[table] = {new if k == key else k: v for k, v in data[table].items()}
    elif choice == "table":
        new = misspelt(r, table)
        data = {new if k == table else k: v for k, v in data.items()}
    elif choice == "word":
        table, key = r.choice(words)
        data[table][key] = misspelt(r, data[table][key])
    elif choice == "moved":
        others = [t for t, x in data.items() if isinstance(x, dict) and key not in x]
        data[r.choice(others)][key] = data[table].pop(key)
    elif choice in ("text", "comma", "list", "truth"):
        numbers = [(t, k) for t, k in places(data) if type(data[t][k]) in (int, float)]
        table, key = r.choice(numbers)
        value = data[table][key]
        wrong = {"text": str(value), "comma": f"{float(value)}".replace(".", ","), "list": [value]}
        wrong |= {"truth": True}
        data[table][key] = wrong[choice]
    elif choice == "missing":
        table, key = r.choice(having(data, NEEDED[kind]))
        del data[table][key]
    elif choice == "sign":
        table, key = r.choice(having(data, POSITIVE[kind]))
        data[table][key] = -data[table][key]
    else:
        factors = dict(SLIPS[kind])
        table, key = r.choice(having(data, factors))
        data[table][key] *= factors[f"{table}.{key}"]
    return data, f"{choice} of {table}.{key}"


PENS = {  # what a line of TOML before its comment is, and what is written instead of it
    "no equals sign": (r"^(\w+) = (\S+)", r"\1 \2"),
    "colon": (r"^(\w+) = (.+)", r"\1: \2"),
    "two equals signs": (r"^(\w+) = (.+)", r"\1 == \2"),
    "no quotes": (r'^(\w+) = "([A-Za-z]\w*)"', r"\1 = \2"),
    "a quote too few": (r'^(\w+) = "(.*)"', r'\1 = "\2'),
    "two kinds of quotes": (r'^(\w+) = "(.*)"', "\\1 = '\\2\""),
    "curly quotes": (r'^(\w+) = "(.*)"', "\\1 = \u201c\\2\u201d"),
    "no bracket": (r"^\[([\w.]+)\]", r"[\1"),
    "round brackets": (r"^\[([\w.]+)\]", r"(\1)"),
    "semicolon": (r"^(\w+) = ([\d.]+)", r"\1 = \2;"),
    "unit": (r"^(\w+)_(V|A|mm|us|s|rpm|deg|Nm|m) = ([\d.]+)", r"\1_\2 = \3 \2"),
    "no zero": (r"^(\w+) = 0\.(\d+)", r"\1 = .\2"),
    "zeros": (r"^(\w+) = ([1-9]\d*)", r"\1 = 00\2"),
    "thousands": (r"^(\w+) = (\d+)(\d{3})", r"\1 = \2 \3"),
    "comma": (r"^(\w+) = (\d+)\.(\d+)", r"\1 = \2,\3"),
    "twice": (r"^(\w+) = ([1-9]\d*)", "\\1 = \\2\n\\1 = 9\\2"),
}


def slip_of_the_pen(r, text):
    """A text that is no TOML any more, by one line."""
    lines = text.splitlines()
    end = r"(?P<end>\s*(?:#.*)?)$"
    ways = [
        (n, name)
        for n, line in enumerate(lines)
        for name, (pattern, _) in PENS.items()
        if re.match(pattern + end, line)
    ]
    chosen = r.choice(sorted({name for _, name in ways}))
    n = r.choice([n for n, name in ways if name == chosen])
    right = lines[n]
    pattern, wrong = PENS[chosen]
    lines[n] = re.sub(pattern + end, rf"{wrong}\g<end>", right)
    return "\n".join(lines) + "\n", f"{chosen} in {right}"


def rewritten(line, text):
    """A text that is no TOML after the remedy of the line."""
    lines = text.splitlines()
    if not (place := re.search(r"[ai][tn] line (\d+)", line)):
        return None
    n = int(place[1]) - 1
    if found := re.search(r" write `(.+)`$", line):
        lines[n] = found[1]
    elif found := re.search(r"; write a decimal point, as in ([-0-9.]+\d)", line):
        lines[n] = re.sub(r"= .*", f"= {found[1]}", lines[n])
    elif line.endswith("twice, remove one"):
        del lines[n]
    else:
        return None
    return "\n".join(lines) + "\n"


def followed(line, data, meant):
    """The file after the remedy of the line, or None where it has none that can be followed."""
    if isinstance(data, str):
        return rewritten(line, data)
    data = copy.deepcopy(data)
    if found := re.search(r"unknown key `(.+?)` in \[(.+?)\]; did you mean `(\w+) = (.+?)`", line):
        old, table, new, value = found.groups()
        table = data[table.removeprefix("machine.")]
        del table[old]
        table[new] = float(value) if "." in value or "e" in value else int(value)
        return data
    if found := re.search(r"unknown key `(.+?)` in \[(.+?)\]; did you mean `(.+?)`", line):
        old, table, new = found.groups()
        table = table.removeprefix("machine.")  # a drive holds the tables of a geometry there
        data[table] = {new if k == old else k: v for k, v in data[table].items()}
        return data
    if found := re.search(r"unknown key `(.+?)` in \[(.+?)\]; it belongs in (\[.+\])", line):
        key, table, homes = found.groups()
        value = data[table.removeprefix("machine.")].pop(key)
        homes = [home.removeprefix("machine.") for home in re.findall(r"\[(.+?)\]", homes)]
        (home,) = [x for x in homes if key in meant.get(x, {}) and key not in data.get(x, {})]
        data.setdefault(home, {})[key] = value
        return data
    if found := re.search(r"unknown key `(.+?)` in \[(.+?)\]; known:", line):
        key, table = found.groups()
        del data[table.removeprefix("machine.")][key]
        return data
    if found := re.search(r"unknown table `(.+?)`; did you mean `(.+?)`", line):
        old, new = found.groups()
        return {new if k == old else k: v for k, v in data.items()}
    named = [
        (table, key)
        for table, key in dict.fromkeys([*places(meant), *places(data)])
        if re.search(rf"\b{table}\b", line) and re.search(rf"\b{key}\b", line)
    ]
    for table, key in named:
        value = meant.get(table, {}).get(key)
        if found := re.search(r"did you mean `?(.+?)`?\?", line):
            data[table][key] = found[1]
        elif found := re.search(r"decimal point, as in ([-0-9.]+)", line):
            data[table][key] = float(found[1])
        elif isinstance(value, str) and (words := re.findall(r"['`]([^'`]+)['`]", line)[1:]):
            (data[table][key],) = difflib.get_close_matches(value, words, n=1) or [None]
        else:
            data.setdefault(table, {})[key] = value
    return data if named else None


def same(a, b):
    """Two files, their numbers to nine digits."""
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if type(a) in (int, float) and type(b) in (int, float):
        return a == pytest.approx(b, rel=1e-9)
    return a == b


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_a_mistype_is_refused_in_one_line_and_its_remedy_works(kind, tmp_path):
    print(f"seed {SEED}")
    r = random.Random(f"{SEED} {kind}")
    load, names = KINDS[kind]
    for folder in ("examples", "machines"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    wrong = []
    for _ in range(EACH):
        name = r.choice(names)
        meant = read_toml(ROOT / f"{name}.toml")
        text = (ROOT / f"{name}.toml").read_text(encoding="utf-8")
        data, what = mistyped(r, kind, meant, text)
        path = tmp_path / f"{name}.toml"
        lines = []
        for _ in range(ROUNDS):
            path.write_text(data if isinstance(data, str) else toml(data), encoding="utf-8")
            try:
                load(path)
                if what.startswith("unit") or isinstance(data, str):
                    assert same(read_toml(path), meant), f"{what}: not as it was meant: {lines}"
                break
            except ParameterError as fault:
                line = str(fault).replace(str(path), path.name)
                lines.append(line)
                remedied = followed(line, data, meant) if "\n" not in line else None
                if remedied is None:
                    wrong.append(f"{name}, {what}: no remedy in {line}")
                    break
                data = remedied
        else:
            wrong.append(f"{name}, {what}: not mended by {lines}")
        if not lines:
            wrong.append(f"{name}, {what}: accepted")
    assert not wrong, f"seed {SEED}\n" + "\n".join(wrong)


COLUMNS = ("i_A", "theta_e_deg", "psi_Wb", "tau_Nm")
MILLI = {"i_A": "i_mA", "psi_Wb": "psi_mWb", "tau_Nm": "tau_mNm", "theta_e_deg": "theta_e_rad"}


def broken_map(r, rows):
    """A map with one mistake: its rows, header first, and what it is."""
    rows = [list(row) for row in rows]
    choice = r.choice(
        [
            *("header", "text", "comma", "empty", "nan", "missing row", "twice", "slip"),
            *("no column", "exchanged", "names exchanged", "no separator", "unit"),
        ]
    )
    n = r.randrange(40, len(rows) - 40)
    k = r.randrange(4)
    if choice == "header":
        rows[0][k] = misspelt(r, rows[0][k])
    elif choice in ("text", "empty", "nan"):
        rows[n][k] = {"text": "x", "empty": "", "nan": "nan"}[choice]
    elif choice == "comma":
        rows[n][2] = rows[n][2].replace(".", ",")
    elif choice == "missing row":
        del rows[n]
    elif choice == "twice":
        rows.insert(n, list(rows[n]))
        rows[n][2] = str(float(rows[n][2]) + 0.01)
    elif choice == "slip":
        k = r.choice([0, 2, 3])
        rows[1:] = [[*row[:k], repr(1e3 * float(row[k])), *row[k + 1 :]] for row in rows[1:]]
    elif choice == "exchanged":
        other = r.choice([x for x in range(4) if x != k])
        rows[n][k], rows[n][other] = rows[n][other], rows[n][k]
    elif choice == "names exchanged":
        other = r.choice([x for x in range(4) if x != k])
        rows[0][k], rows[0][other] = rows[0][other], rows[0][k]
    elif choice == "no separator":
        k = r.randrange(3)
        rows[n] = [*rows[n][:k], rows[n][k] + " " + rows[n][k + 1], *rows[n][k + 2 :]]
    elif choice == "unit":
        rows[0][k] = rows[0][k].rpartition("_")[0] + r.choice(["_gauss", "_V", "_turns", "_x"])
    else:
        k = r.choice([0, 1, 2])
        rows = [[*row[:k], *row[k + 1 :]] for row in rows]
    return rows, f"{choice} at row {n}, column {k}", k


def read_alike(table, right):
    """Whether each quantity is that of the other table."""
    for ours, own in (
        (getattr(t, q) for t in (table, right)) for q in ("i", "theta_e", "psi", "tau")
    ):
        yield ours is not None and ours.shape == own.shape and np.allclose(ours, own, atol=1e-12)


@pytest.mark.long
def test_a_mistype_in_a_map_is_refused_in_one_line_that_says_where(tmp_path):
    """A mistype in a table of numbers is mended by the user's own value, so that the line says the
    place: row and column, a column's name, or the unit of it."""
    print(f"seed {SEED}")
    r = random.Random(f"{SEED} map")
    with (ROOT / "machines" / "own_12_8.csv").open() as file:
        meant = list(csv.reader(file))
    path, wrong = tmp_path / "m.csv", []
    right = read_map(ROOT / "machines" / "own_12_8.csv", N_r=8)
    for _ in range(EACH):
        rows, what, k = broken_map(r, meant)
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows(rows)
        path.write_text(text.getvalue())
        try:
            table = read_map(path, N_r=8)
            line = "; ".join(check_map(table).reasons)
            if all(read_alike(table, right)):
                continue  # a name in other letters, or without its unit: read as it was meant
        except ParameterError as fault:
            line = str(fault)
        if not line:
            wrong.append(f"{what}: accepted")
            continue
        says = re.search(r"row \d+|at |columns?|line \d+|unit", line)
        if "\n" in line or not says:
            wrong.append(f"{what}: {line}")
        if what.startswith("slip") and (unit := MILLI[COLUMNS[k]]) and k != 1:
            # Followed: one of the proposals is the unit that was meant.
            word = {0: "currents", 2: "flux linkage", 3: "torque"}[k]
            if word not in line:
                wrong.append(f"{what}: {unit} not among the proposals: {line}")
    assert not wrong, f"seed {SEED}\n" + "\n".join(wrong)
