"""What a figure becomes: a page with every line, a style's colours, texts within their axes."""

import math

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

from reluctance.base import interactive, picture
from reluctance.base.picture import Picture, styled


@pytest.mark.parametrize("count", [interactive.MOST_POINTS, 10 * interactive.MOST_POINTS + 7])
def test_a_long_line_keeps_its_ends_and_every_peak(count):
    rng = np.random.default_rng(3)
    x, y = np.arange(float(count)), rng.normal(size=count) / 10
    peaks = rng.choice(count, 20, replace=False)
    y[peaks] = np.tile([5.0, -5.0], 10)
    shown_x, shown_y = interactive.thinned(x, y)
    assert len(shown_x) <= interactive.MOST_POINTS + 2 and set(peaks) <= set(shown_x)
    assert shown_x[0] == 0 and shown_x[-1] == count - 1 and np.all(np.diff(shown_x) > 0)
    assert np.array_equal(y[shown_x.astype(int)], shown_y)
    assert len(shown_x) == count or count > interactive.MOST_POINTS


def test_a_page_has_the_lines_of_each_panel_with_their_names_steps_and_limits():
    figure = Figure()
    first, second, third = figure.subplots(3)
    first.plot([1, 2, 3], [4, 5, 6], "--", color="#112233", lw=3, label="straight")
    first.plot([1, 2, 3], [1, 0, 1], drawstyle="steps-post", label="stepped")
    first.plot([2.0], [3.0], "o", color="#445566", label="dot")
    first.plot([1, 3], [9, 9], label="_unnamed")
    first.set(xlabel="time (ms)", ylabel="current (A)", title="phase a", xlim=(0, 4))
    second.plot([1, 100], [1, 1000])
    second.set(xscale="log", yscale="log", xlim=(0.5, 200))
    third.plot([0, 4], [0, 1])
    third.set(xlabel="time (ms)", xlim=(0, 4))
    third.set_yticks([0.0, 1.0], ["off", "on"])
    shared = {}
    a, b, c = (interactive._panel(ax, shared) for ax in (first, second, third))
    assert a.title.text == "phase a" and a.xaxis[0].axis_label == "time (ms)"
    assert a.yaxis[0].axis_label == "current (A)" and c.x_range is a.x_range is not b.x_range
    assert (a.x_range.start, a.x_range.end) == (0, 4) and b.x_range.start == 0.5
    assert [type(p.x_scale).__name__ for p in (a, b)] == ["LinearScale", "LogScale"]
    assert [type(p.y_scale).__name__ for p in (a, b)] == ["LinearScale", "LogScale"]
    glyphs = {r.name or "": r.glyph for r in a.renderers}
    kinds = {name: type(glyph).__name__ for name, glyph in glyphs.items()}
    assert kinds == {"straight": "Line", "stepped": "Step", "dot": "Scatter", "": "Line"}
    assert glyphs["straight"].line_color == "#112233" and glyphs["straight"].line_width == 3
    assert glyphs["straight"].line_dash == [6] and glyphs["stepped"].mode == "after"
    assert [item.label.value for item in a.legend[0].items] == ["straight", "stepped", "dot"]
    (line,) = (r for r in a.renderers if r.name == "straight")
    assert [*line.data_source.data["y"]] == [4, 5, 6]
    assert c.yaxis[0].major_label_overrides == {0.0: "off", 1.0: "on"}
    assert not a.yaxis[0].major_label_overrides
    hovers = [next(t for t in p.tools if type(t).__name__ == "HoverTool") for p in (a, b)]
    heads = [[name for name, _ in hover.tooltips] for hover in hovers]
    assert heads == [["", "time (ms)", "current (A)"], ["", "x", "y"]]
    html = interactive.page("mine & yours", figure, below="<p>under</p>")
    assert "mine &amp; yours" in html and "<p>under</p>" in html
    assert "http://" not in html.split("</head>")[1]  # it needs no network


def test_the_signs_of_a_formula_in_a_name_are_only_signs():
    figure = Picture(8, 6)
    figure.subplots().plot([1, 2])
    figure.suptitle(r"drive$\nothing$.toml")
    assert picture.drawn(figure, ".png").startswith(b"\x89PNG")
    assert not figure._suptitle.get_parse_math()


def test_a_page_has_lines_across_and_annotations_and_its_legend_covers_no_curve():
    figure = Figure()
    ax = figure.subplots()
    ax.plot([1, 3], [4, 6], label="torque")
    ax.axvline(2.0, color="#ff0000", ls=":", label="fault")
    ax.axhline(5.0, color="#0000ff")
    ax.annotate(
        "open_wire", (2.0, 0.5), xycoords=("data", "axes fraction"), rotation=90, ha="right",
        va="center", color="#ff0000", bbox={"fc": "white"},
    )  # fmt: skip
    ax.annotate("peak", (3, 6), (2, 1), textcoords="offset points")
    ax.annotate("far away", (3, 6), (1.1, 0.5), textcoords="axes fraction")
    ax.annotate("corner", (0, 1), xycoords="axes fraction")
    panel = interactive._panel(ax, {})
    spans = {type(r.glyph).__name__: r for r in panel.renderers}
    upright, level = spans["VSpan"], spans["HSpan"]
    assert upright.glyph.line_color == "#ff0000" and [*upright.data_source.data["x"]] == [2.0]
    assert level.glyph.line_color == "#0000ff" and [*level.data_source.data["y"]] == [5.0]
    assert upright.name == "fault" and upright.glyph.line_dash == "dotted"
    fault, peak = (label for label in panel.center if type(label).__name__ == "Label")
    assert (fault.text, fault.x, fault.y_units) == ("open_wire", 2.0, "screen")
    assert fault.y == panel.frame_height / 2 and fault.text_color == "#ff0000"
    assert fault.angle == pytest.approx(math.pi / 2) and fault.background_fill_color == "white"
    assert (fault.text_align, fault.text_baseline) == ("center", "bottom")  # left of its line
    assert (peak.text, peak.x, peak.y, peak.y_units) == ("peak", 3, 6, "data")
    assert (peak.x_offset, peak.y_offset, peak.angle) == (2, 1, 0)
    assert panel.above[-1] is panel.legend[0] and panel.legend[0] not in panel.center


def test_a_colour_is_that_of_the_style_and_as_light_in_a_grey_one():
    """The luminance of Rec. ITU-R BT.709: pure green is 0.715 as light as white."""
    assert styled("#00ff00") == styled("#00ff00", 1) == "#00ff00"
    with mpl.rc_context({"axes.prop_cycle": mpl.cycler(color=["0.1", "0.5", "0.9"])}):
        assert float(styled("#00ff00")) == pytest.approx(0.715, abs=1e-3)
        assert float(styled("#ff0000")) == pytest.approx(0.213, abs=1e-3)
        assert float(styled("#ffffff")) == 1 and float(styled("k")) == 0
        assert [styled("r", n) for n in (0, 1, 2, 4)] == ["0.1", "0.5", "0.9", "0.5"]
    with mpl.rc_context({"axes.prop_cycle": mpl.cycler(color=["#010203", "0.5"])}):
        assert styled("#00ff00") == "#00ff00" and styled("#00ff00", 0) == "#010203"


def test_a_text_is_wrapped_only_where_it_is_longer_than_its_room():
    figure = Figure(figsize=(6, 4))
    text = figure.text(0, 0.5, "some words in one line")
    width = text.get_window_extent().width
    assert not picture._wrap(text, width) and text.get_text() == "some words in one line"
    assert picture._wrap(text, 0.6 * width)
    lines = text.get_text().split("\n")
    assert " ".join(lines) == "some words in one line"
    assert len(lines) == 2 and max(map(len, lines)) <= 0.6 * len("some words in one line")
    assert not picture._wrap(text, width)
    for words in ("", "  ", "$a_b$ and more words of it"):
        text.set_text(words)
        assert not picture._wrap(text, 1.0) and text.get_text() == words
    upright = figure.text(0.5, 0, "some words in one line", rotation=90)
    assert not picture._wrap(upright, width) and picture._wrap(upright, 0.6 * width)


@pytest.mark.parametrize(("width", "rows"), [(9.0, 1), (4.7, 1), (4.5, 2)])
def test_panels_stand_below_each_other_where_they_would_be_too_narrow(width, rows):
    figure = Picture(width, 3.0)
    left, right = figure.subplots(1, 2)
    left.twinx()
    assert figure.one_column == (rows == 2)
    figure._stack_narrow_panels()
    places = {ax.get_subplotspec().get_geometry()[:2] for ax in (left, right)}
    assert places == {(rows, 3 - rows)}
    assert figure.get_size_inches() == pytest.approx((width, max(3.0 * rows, 1.7 * rows)))
    flat = Picture(width, 1.0)
    flat.subplots(2, 1)
    flat._stack_narrow_panels()
    assert flat.get_size_inches() == pytest.approx((width, 2 * 1.7))


def test_a_legend_below_takes_fewer_columns_until_it_fits():
    figure = Picture(4.0, 3.0)
    ax = figure.subplots()
    lines = [ax.plot([0, 1], [0, n])[0] for n in range(6)]
    figure.legend_below(lines, [f"a rather long name {n}" for n in range(6)])
    assert figure.legends[0]._ncols == 6
    figure._fit()
    (legend,) = figure.legends
    assert legend._ncols < 6 and legend.get_window_extent().width <= 4.0 * figure.dpi
    assert [t.get_text() for t in legend.get_texts()] == [
        f"a rather long name {n}" for n in range(6)
    ]
