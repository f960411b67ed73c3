"""The numbers of README and docs are those of the files that they cite, and the files are current.

A page cites a file in a comment, which no reader of the rendered page sees.

One number, just before the comment; a column may be scaled:

    0.84 %<!-- docs/results.csv example=paper_rated torque_error_rms*100 -->

A whole table, in the line above it. The first cell of a row selects the row of the file, and each
further column of the table says what it shows; `-` is not compared:

    <!-- from docs/results.csv by example: -; torque_error_rms*100; f_switch_Hz/1000 -->

`& COLUMN` is a second number in the same cell, `@ KEY=VALUE` selects rows for one column only and
`where KEY=VALUE` for all; `COLUMN in FILE` is of another file with the same key. The file may
be a table of a page that a command writes, FILE.md#heading.
"""

import csv
import re
import shlex
import tomllib
from pathlib import Path

import numpy as np
import pytest

import reluctance as rl

ROOT = Path(__file__).parents[2]
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").glob("*.md"), *(ROOT / "docs").glob("*/*.md")])
PAGES = [page for page in PAGES if "generated" not in page.parts and "gallery" not in page.parts]
BY_COMMAND = {"laws.md": "<!-- From here on made by"}  # where the hand-written part ends

NUMBER = re.compile(r"[-−]?\d{1,3}(?: \d{3})+(?!\d)|[-−]?\d+(?:\.\d+)?(?:e[-−]?\d+)?")
SINGLE = re.compile(r"<!-- (\S+\.(?:csv|md\S*))\s+(.+?)\s+-->", re.S)
COMMENT = re.compile(r"<!--.*?-->", re.S)
TABLE = re.compile(r"<!-- from (\S+) by (\w+)(?: where ([^:]+))?: (.+) -->")


def rows(source: str) -> list[dict[str, str]]:
    """The rows of a CSV file, or of the first table under a heading of a page."""
    name, _, heading = source.partition("#")
    text = (ROOT / name).read_text(encoding="utf-8")
    if not heading:
        return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))
    below = re.split(rf"^#+ {heading.replace('-', '[ -]')}$", text, flags=re.M | re.I)[1]
    lines = re.search(r"(?:^\|.*\n)+", below, flags=re.M)[0].splitlines()
    head = cells(lines[0])
    return [dict(zip(head, cells(line), strict=True)) for line in lines[2:]]


def cells(line: str) -> list[str]:
    return [re.sub(r"[`*]|<!--.*?-->", "", cell).strip() for cell in line.split("|")[1:-1]]


def value(source: str, keys: dict[str, str], column: str) -> float:
    """The one number that a citation means: a column, a sum of columns, times or over a factor."""
    name, scale, factor = re.fullmatch(r"(.+?)(?:([*/])(\d+))?", column.strip()).groups()
    found = [row for row in rows(source) if all(same(row[k], v) for k, v in keys.items())]
    assert len(found) == 1, f"{source}: {len(found)} rows with {keys}"
    cells = [found[0][part].replace("−", "-") for part in name.split("+")]
    number = sum(float(NUMBER.search(cell)[0]) for cell in cells)
    return number * float(factor) if scale == "*" else number / float(factor or 1)


def same(cell: str, wanted: str) -> bool:
    try:
        return float(cell) == float(wanted)
    except ValueError:
        return cell == wanted


def keys_of(parts: list[str]) -> dict[str, str]:
    return dict(part.split("=", 1) for part in parts if part)


def agrees(shown: str, exact: float) -> bool:
    """The number as shown is the exact one, rounded to the digits that are shown."""
    text = shown.replace(" ", "").replace("−", "-")
    decimals = len(text.partition(".")[2])
    return abs(float(text) - exact) <= 0.5001 * 10.0**-decimals


def wrong_in_table(lines: list[str], citation: re.Match[str]) -> list[str]:
    """The cells of a table that disagree with their file."""
    source, key, where, columns = citation.groups()
    faults, compared = [], 0
    for line in lines[2:]:
        first, *shown = cells(line)
        for cell, spec in zip(shown, columns.split(";"), strict=True):
            what, _, only = spec.strip().partition(" @ ")
            if what == "-" or not NUMBER.search(cell):
                continue
            keys = {key: first} | keys_of((where or "").split(",")) | keys_of(only.split(","))
            for text, column in zip(NUMBER.findall(cell), what.split("&"), strict=True):
                compared += 1
                column, _, other = column.strip().partition(" in ")
                exact = value(other or source, keys, column)
                if not agrees(text, exact):
                    faults.append(f"{first}: {text} is {exact:.6g} in {other or source}, {column}")
    assert compared, f"{citation[0]}: no number below it"
    return faults


def wrong(page: str) -> list[str]:
    """Every number of a page that disagrees with the file it cites."""
    lines, faults = page.splitlines(), []
    for n, line in enumerate(lines):
        if citation := TABLE.search(line):
            start = next(m for m in range(n + 1, n + 4) if lines[m].startswith("|"))
            end = next((m for m in range(start, len(lines)) if not lines[m].startswith("|")), None)
            faults += wrong_in_table(lines[start:end], citation)
        elif "<!-- from " in line:
            faults.append(f"not understood: {line}")
    for citation in SINGLE.finditer(page):
        if not TABLE.match(citation[0]):
            before = " ".join(COMMENT.sub("", page[: citation.start()]).split())
            *keys, column = shlex.split(citation[2])
            exact = value(citation[1], keys_of(keys), column)
            shown = NUMBER.findall(before)[-1]
            if not agrees(shown, exact):
                faults.append(f"{shown} is {exact:.6g}: {citation[0]}")
    return faults


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_numbers_are_those_of_the_cited_files(page: Path) -> None:
    assert wrong(page.read_text(encoding="utf-8")) == []


def test_a_wrong_number_is_found() -> None:
    cited = "<!-- docs/results.csv example=paper_rated i_rms_A -->"
    assert wrong(f"48.95 A{cited}") == []
    assert len(wrong(f"48.96 A{cited}")) == 1
    table = "<!-- from docs/results.csv by example: torque_error_rms*100 -->\n\n"
    table += "| a | b |\n|---|---|\n"
    assert wrong(table + "| `paper_rated` | 0.84 % |\n") == []
    assert len(wrong(table + "| `paper_rated` | 0.48 % |\n")) == 1


def test_the_statuses_of_firmware_are_those_of_the_header() -> None:
    header = (ROOT / "include/srm/control/guard/fault.hpp").read_text(encoding="utf-8")
    number = dict(re.findall(r"^  (\w+) = (\d+)", header, flags=re.M))
    texts = re.findall(r'case Status::(\w+):\s+return "(.*?)";', header)
    page = (ROOT / "docs/firmware.md").read_text(encoding="utf-8")
    table = re.search(r"^\| status \| meaning \|\n(?:\|.*\n)+", page, flags=re.M)[0]
    shown = [cells(line) for line in table.splitlines()[2:]]
    assert shown == [[number[name], text] for name, text in texts]


@pytest.mark.parametrize(
    "name", ["paper_rated", "deadbeat", "five_phases_losses", "coupled_phases"]
)
def test_the_results_file_is_what_the_examples_give(name: str) -> None:
    """Within 1 %: two computers may round differently. With noise of sensors a single extreme makes
    the peak-to-peak ripple: to that comes what it moves by at voltages that differ by 1e-10."""
    (row,) = [row for row in rows("docs/results.csv") if row["example"] == name]
    drive = rl.load(ROOT / "examples" / f"{name}.toml")
    u_dc = [drive.converter.u_dc_V * (1 + n * 1e-10) for n in range(4)]
    runs = [rl.simulate(drive.with_values({"converter.u_dc_V": u}), record=None) for u in u_dc]
    moves = {"torque_ripple_pp": float(np.ptp([run.kpis.torque_ripple_pp for run in runs]))}
    found = runs[0].kpis.with_units()
    for column, text in row.items():
        if column in found and text:
            written = pytest.approx(float(text), rel=0.01, abs=1e-4 + moves.get(column, 0.0))
            assert found[column] == written, column


def prose(page: Path) -> list[str]:
    """The lines that a person wrote and that can be wrapped."""
    text = page.read_text(encoding="utf-8").partition(BY_COMMAND.get(page.name, "\0"))[0]
    text = COMMENT.sub("", re.sub(r"^(```|:::).*?^\1", "", text, flags=re.M | re.S))
    return [
        line
        for line in text.splitlines()
        if not re.match(r"\||    |<!--|!?\[[^\]]*\]\(\S+\)\S*$", line.strip() or line)
    ]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_prose_is_wrapped(page: Path) -> None:
    assert [line for line in prose(page) if len(line) > 100] == []


def test_the_readme_is_short() -> None:
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 120


def test_one_version_everywhere() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert rl.__version__ == project["version"]
    assert re.search(r"^version: (.+)$", citation, flags=re.M)[1] == project["version"]


LINK = re.compile(r"(?<!!)\[[^\]]*\]\(([^)\s#]+)[^)]*\)|!\[[^\]]*\]\(([^)\s]+)\)")


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_a_page_reads_well_on_a_forge(page):
    """A forge shows no directive, hides a comment, and follows links between the sources."""
    text = page.read_text(encoding="utf-8")
    assert "```{" not in text and ":::{" not in text
    for place in re.finditer(r"<!-- \{command\}", text):
        assert text[: place.start()].endswith("\n```\n"), "a {command} follows its block"
    plain = re.sub(r"```.*?```", "", text, flags=re.S)
    for match in LINK.finditer(plain):
        target = match[1] or match[2]
        if ":" not in target and "generated" not in target:
            assert (page.parent / target).exists(), target
