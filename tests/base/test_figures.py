"""Figures: seen in a notebook without magic, taken by a journal, of the width that is asked for."""

import re
import warnings

import matplotlib as mpl
import pytest
from command import command, refused
from matplotlib.figure import Figure

import reluctance as rl
from reluctance.base.figures import look, save_figure
from reluctance.base.picture import Picture

DRIVE = "examples/paper_rated.toml"


@pytest.fixture(scope="module")
def result():
    return rl.simulate(rl.load(DRIVE), until=0.02, record=1e-5)


def is_whole(figure: Figure) -> bool:
    """Whether all that is drawn lies within the figure, but for a line's width."""
    figure.draw_without_rendering()
    box, (width, height) = figure.get_tightbbox(), figure.get_size_inches()
    return min(box.x0, box.y0, width - box.x1, height - box.y1) > -0.03


def test_a_figure_shows_itself_in_a_notebook_without_magic(result):
    png = result.plot()._repr_png_()
    assert png.startswith(b"\x89PNG") and len(png) > 20_000


def test_pdf_has_truetype_letters_however_it_is_saved(result, tmp_path):
    figure = result.plot()
    save_figure(figure, tmp_path / "a.pdf")
    figure.savefig(tmp_path / "b.pdf")
    for name in ("a.pdf", "b.pdf"):
        content = (tmp_path / name).read_bytes()
        assert b"/Type3" not in content and b"/FontFile2" in content, name


@pytest.mark.parametrize("size", [(3.5, 2.4), (3.0, 5.0), (7.0, 3.0)])
def test_no_label_is_clipped_at_any_width(result, size, tmp_path):
    figure = result.plot()
    figure.set_size_inches(*size)
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # Matplotlib warns where labels leave no room for axes
        figure.savefig(tmp_path / "a.png")
    assert figure.get_size_inches()[0] == size[0]
    assert is_whole(figure)


def test_the_size_of_matplotlib_is_honoured(result):
    with mpl.rc_context({"figure.figsize": (8.5, 6.5)}):
        assert tuple(result.plot().get_size_inches()) == (8.5, 6.5)
    assert tuple(result.plot().get_size_inches()) == (11, 8)


def test_width_and_style_of_the_command(tmp_path):
    out = tmp_path / "paper.svg"
    arguments = ("run", DRIVE, "--until", 0.02, "--plot", out)
    assert command(*arguments, "--width", "3.5in", "--style", "grayscale").code == 0
    text = out.read_text()
    assert re.search(r'<svg[^>]* width="252pt"', text)  # 3.5 x 72
    assert "#1f77b4" not in text  # the first colour of the usual style
    assert command(*arguments).code == 0
    assert "#1f77b4" in out.read_text()


@pytest.mark.parametrize("wrong", ["3.5", "0in", "3 feet", "-2in", "900mm"])
def test_a_width_that_is_none(wrong, tmp_path):
    line = refused("run", DRIVE, "--plot", tmp_path / "a.pdf", "--width", wrong)
    assert "3.5in" in line


def test_a_style_that_is_none(tmp_path):
    line = refused("run", DRIVE, "--plot", tmp_path / "a.pdf", "--style", "prety")
    assert "no such style" in line and not list(tmp_path.iterdir())


def test_look_leaves_nothing_behind():
    before = dict(mpl.rcParams)
    with look("dark_background", "88mm"):
        assert mpl.rcParams["font.size"] != before["font.size"]
    assert dict(mpl.rcParams) == before


@pytest.mark.parametrize(
    ("width", "inches"),
    [("3.5in", 3.5), ("8.89cm", 3.5), ("88.9mm", 3.5), (" 20 in ", 20.0), ("3in", 3.0)],
)
def test_a_width_is_in_inches_centimetres_or_millimetres(width, inches):
    """An inch has 25.4 mm."""
    with look(None, width):
        assert Picture(7.0, 4.0).get_size_inches() == pytest.approx((inches, inches * 4 / 7))
