"""The figure of a comparison: no two laws look alike, no two names overlap."""

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import pytest
from matplotlib.text import Annotation

import reluctance as rl
from reluctance.compare import CONTENDERS, Comparison, Entry, compare
from reluctance.compare import figure as drawing

RATED = Path(__file__).parents[1] / "examples" / "paper_rated.toml"
SHARING = [name for name in CONTENDERS if name.startswith("sharing_")]


@pytest.fixture(scope="module")
def found() -> Comparison:
    drive = rl.load(RATED, ["control.T_s_us=20"])
    return compare(drive, [*SHARING[:3], "deadbeat"], f_switch=5e3, octaves=(), processes=1)


def test_no_two_laws_look_alike(found: Comparison) -> None:
    styles = [
        drawing._style(found, Entry(name, {}, met=True, note="", runs=0)) for name in CONTENDERS
    ]
    assert len({(s["color"], s["ls"], s["marker"]) for s in styles}) == len(CONTENDERS)


def test_names_do_not_overlap(found: Comparison) -> None:
    made = drawing.figure(found)
    made.draw_without_rendering()
    for ax in made.axes[:2]:
        names = [text for text in ax.texts if isinstance(text, Annotation)]
        assert {text.get_text() for text in names} == {e.name for e in found.entries}
        boxes = [super(Annotation, text).get_window_extent() for text in names]  # without the line
        assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))


def test_a_law_that_failed_is_named_in_the_title(found: Comparison) -> None:
    failed = Entry("ditc", {}, met=False, note="not possible here: angles", runs=0)
    made = drawing.figure(replace(found, entries=(failed,)))
    assert "ditc" in made.get_suptitle()
