"""The gallery's scripts are short, say what they show, and use the public surface only.

That they run is checked by `make docs`, which runs all of them.
"""

import ast
import re
from pathlib import Path

import pytest

SCRIPTS = sorted((Path(__file__).parents[2] / "examples" / "gallery").glob("*.py"))
WANTED = 22


def test_there_are_enough() -> None:
    assert len(SCRIPTS) >= WANTED


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_a_script_opens_with_a_title_and_a_text(path: Path) -> None:
    title, _, text = (
        ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    ).partition("\n")
    assert title.endswith(".") and len(title) < 50
    assert len(text.split()) > 30


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_a_script_is_short_and_uses_the_public_surface(path: Path) -> None:
    source = path.read_text(encoding="utf-8")
    assert len(source.splitlines()) <= 100
    assert set(re.findall(r"^(?:from|import) (reluctance\S*)", source, flags=re.M)) == {
        "reluctance"
    }
    assert source.rstrip().endswith("plt.show()")


JOBS = [path for path in SCRIPTS if path.stem.startswith("sweep_")]


def test_ten_sweep_jobs_take_ten_lines_each() -> None:
    assert len(JOBS) == 10
    for path in JOBS:
        body = ast.parse(path.read_text(encoding="utf-8")).body
        code = [n for n in body if not isinstance(n, ast.Import | ast.ImportFrom)][
            2:
        ]  # text, DRIVE
        lines = path.read_text(encoding="utf-8").splitlines()[code[0].lineno - 1 :]
        assert len(lines) <= 10, path
