"""docs/drive_file.md has every key of a drive file, no other, with the default of the code."""

import re
import tomllib
from pathlib import Path
from typing import Literal, get_args, get_origin

import pytest
from ends import SIZES, fault_of, numbers

import reluctance as rl
from reluctance.drive.all_tables import TABLES
from reluctance.drive.laws import LAWS, table_of
from reluctance.drive.tables.faults import Fault, Faults
from reluctance.machine.library import model_class
from reluctance.machine.loss_data import Iron

PAGE = (Path(__file__).parents[2] / "docs" / "drive_file.md").read_text(encoding="utf-8")
HEADING = re.compile(r"^(#{2,3}) (.+)$")
ROW = re.compile(r"^\| `(\w+)` \| ([^|]+) \| ([^|]+) \| ([^|]+) \|$")


def tables():
    """(heading of level 2, words of the last heading, {key: (default, meaning)}) of each table."""
    found, part, words = [], "", set()
    for line in PAGE.splitlines():
        if heading := HEADING.match(line):
            words = set(re.findall(r"\w+", heading[2].partition(":")[2]))
            part = heading[2] if heading[1] == "##" else part
        elif line == "| key | unit | default | meaning |":
            found.append((part, words, {}))
        elif row := ROW.match(line):
            key, rows = row[1], found[-1][2]
            assert key not in rows, f"{part}: `{key}` twice"
            rows[key] = row[3], row[4]
        else:
            assert not line.startswith("| `"), f"not four cells: {line}"
    return found


def documented(part, word=None):
    """{key: (default, meaning)} of the tables in a part whose heading names the word, or all."""
    keys = {}
    for table_part, words, rows in tables():
        if table_part == part and (word is None or words & {word, "all"}):
            assert not keys.keys() & rows.keys(), f"{part} {word}: a key in two tables"
            keys.update(rows)
    return keys


SECTIONS = (
    [(f"[{name}]", None, section) for name, section in TABLES.items() if section is not Faults]
    + [("[[faults]]", None, Fault)]
    + [("[machine]", name, model_class(name)) for name in ("lehuy", "map")]
    + [("[control]", law, table_of(law)) for law in LAWS]
    + [("[machine.iron]", None, Iron)]
)
each_section = pytest.mark.parametrize(
    ("part", "word", "section"), SECTIONS, ids=[f"{p}-{w}" if w else p for p, w, _ in SECTIONS]
)


@each_section
def test_every_key_is_documented_and_no_other(part, word, section):
    assert documented(part, word).keys() == section.model_fields.keys()


@each_section
def test_defaults_are_those_of_the_code(part, word, section):
    for key, (cell, _) in documented(part, word).items():
        field = section.model_fields[key]
        # A table made in Python has the name of its law from its class.
        assert (cell == "required") == (field.is_required() or key == "law"), key
        if key == "law":
            continue
        default = field.default
        if isinstance(default, bool):
            assert cell == str(default).lower(), key
        elif isinstance(default, int | float):
            assert float(cell) == default, key
        elif isinstance(default, str):
            assert cell == (f'`"{default}"`' if default else "empty"), key


def test_every_table_belongs_to_a_section():
    parts = {part for part, _, _ in SECTIONS}
    names = {word for _, word, _ in SECTIONS if word} | {"all"}
    for part, words, _ in tables():
        assert part in parts
        assert words <= names


@each_section
def test_every_choice_is_in_the_row_of_its_key(part, word, section):
    for key, (default, meaning) in documented(part, word).items():
        annotation = section.model_fields[key].annotation
        kinds = [
            kind for kind in (annotation, *get_args(annotation)) if get_origin(kind) is Literal
        ]
        choices = {choice for kind in kinds for choice in get_args(kind)}
        if key not in ("law", "model"):
            assert choices <= set(re.findall(r'`"(\w+)"`', default + meaning)), key


def test_the_complete_example_loads_and_has_every_table(tmp_path):
    text = re.search(r"```toml\n(.+?)```", PAGE, re.DOTALL)[1]
    path = tmp_path / "my_drive.toml"
    path.write_text(text, encoding="utf-8")
    assert rl.load(path).control.law == "torque_sharing"
    assert tomllib.loads(text).keys() == {"machine", "control", *TABLES} - {
        "pv_control"
    }  # of an array


RANGE = re.compile(r"(?<![\w.])(-?\d+(?:\.\d+)?) to (-?\d+(?:\.\d+)?)(?=$|[;,. )])")
UP_TO, AT_LEAST = re.compile(r"(?:^|[ ,])up to (\d+)"), re.compile(r"at least (\d+)$")


@each_section
def test_ranges_are_those_of_the_page(part, word, section):
    """A to B, up to B and at least A in the meaning of a key: the ends pass, beyond is refused."""
    page = documented(part, word)
    for key, whole in numbers(section):
        meaning, little = page[key][1], 1 if whole else 0.01
        if (part, key) in NOT_A_RANGE:
            continue
        for low, high in RANGE.findall(meaning):
            for end, beyond in ((low, -little), (high, little)):
                value = type(little)(float(end))
                assert fault_of(section, key, value) in (None, *OPEN.get(key, ())), (key, value)
                assert fault_of(section, key, value + beyond), (key, value + beyond)
        for pattern, beyond in ((UP_TO, little), (AT_LEAST, -little)):
            for end in pattern.findall(meaning):
                value = type(little)(float(end))
                assert fault_of(section, key, value) is None, (key, value)
                assert fault_of(section, key, value + beyond), (key, value + beyond)


NOT_A_RANGE = {("[control]", "f_switch_kHz"), ("[protection]", "speed_limit_rpm")}
OPEN = dict.fromkeys(("theta_on_deg", "theta_e_deg"), ("less_than",))  # a turn on is the same

LEAST = {"C_uF": 20.0}


@pytest.mark.filterwarnings("ignore:.*if these are milliseconds")
@each_section
def test_no_size_is_negative_and_a_small_one_passes(part, word, section):
    for key, whole in numbers(section):
        unit = key.rpartition("_")[2]
        if unit in SIZES and not whole and "_" in key:
            assert fault_of(section, key, -1e-9), key
            assert fault_of(section, key, LEAST.get(key, 0.0) + 1e-3) is None, key
        if unit == "pct":
            assert fault_of(section, key, -0.1) and fault_of(section, key, 100.0), key
            assert not fault_of(section, key, 0.0) and not fault_of(section, key, 99.9), key


@each_section
def test_a_default_may_be_written_out(part, word, section):
    for key, _ in numbers(section):
        default = section.model_fields[key].default
        if isinstance(default, int | float):
            assert fault_of(section, key, default) is None, key
