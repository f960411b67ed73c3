"""A comparison as it is shown: no two laws look alike, no names overlap, the table fits."""

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import pytest
from matplotlib.text import Annotation

import reluctance as rl
from reluctance.explore.comparison import CONTENDERS, Comparison, Entry, compare
from reluctance.explore.comparison import figure as drawing
from reluctance.explore.comparison.table import plain

RATED = Path(__file__).parents[2] / "examples" / "paper_rated.toml"
SHARING = [name for name in CONTENDERS if name.startswith("sharing_")]


@pytest.fixture(scope="module")
def found() -> Comparison:
    drive = rl.load(RATED, ["control.T_s_us=20"])
    return compare(drive, [*SHARING[:3], "deadbeat"], f_switch=5e3, octaves=(), processes=1)


def test_no_two_laws_look_alike() -> None:
    styles = [drawing.style(name) for name in CONTENDERS]
    assert len({(s["color"], s["ls"], s["marker"]) for s in styles}) == len(CONTENDERS)


def test_names_do_not_overlap(found: Comparison) -> None:
    made = drawing.figure(found)
    made.draw_without_rendering()
    for ax in made.axes[:2]:
        names = [text for text in ax.texts if isinstance(text, Annotation)]
        assert {text.get_text() for text in names} == {e.name for e in found.entries}
        boxes = [super(Annotation, text).get_window_extent() for text in names]  # without the line
        assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))


def test_the_name_of_the_lower_bound_lies_below_it(found: Comparison) -> None:
    made = drawing.figure(found)
    made.draw_without_rendering()
    ax = made.axes[0]
    (name,) = [text for text in ax.texts if text.get_text().startswith("below the lower bound")]
    below = ax.collections[-1].get_paths()[0].transformed(ax.transData)
    assert below.contains_point(name.get_window_extent().get_points()[1])


def test_a_law_that_failed_is_named_in_the_title(found: Comparison) -> None:
    failed = Entry("ditc", {}, met=False, note="not possible here: angles", runs=0)
    made = drawing.figure(replace(found, entries=(failed,)))
    assert "ditc" in made.get_suptitle()


def test_the_table_of_all_laws_fits_a_terminal(found: Comparison) -> None:
    rows = tuple(replace(found.entries[0], name=name, met=False) for name in CONTENDERS)
    lines = plain(replace(found, entries=rows, step_time=dict.fromkeys(CONTENDERS, 98765e-9)))
    assert max(map(len, lines)) <= 110
    assert len({len(line) for line in lines[: 2 + len(rows)]}) == 1
