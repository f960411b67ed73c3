"""docs/drive_file.md has every key of a drive file, no other, with the default of the code."""

import re
import tomllib
from pathlib import Path
from typing import Literal, get_args, get_origin

import pytest

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
