"""The gallery's scripts are short, say what they show, and use the public surface only.

That they run is checked by `make docs`, which runs all of them.
"""

import ast
import re
from pathlib import Path

import pytest

SCRIPTS = sorted((Path(__file__).parents[1] / "examples" / "gallery").glob("*.py"))
WANTED = 12


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
