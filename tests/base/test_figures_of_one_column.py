"""Figures in one column of a journal: no text overlaps another, none is cut, grey is grey."""

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from command import command
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.image import imread

import reluctance as rl
from reluctance.base.figures import look, save_figure
from reluctance.explore.comparison import compare
from reluctance.explore.comparison import figure as comparison_figure

EXAMPLES = Path(__file__).parents[2] / "examples"
CUBIC = EXAMPLES / "sharing_cubic.toml"
BANDS, TORQUES = "control.i_band_A=0.5:2:6", "reference.tau_Nm=10:50:5"
TWO = ("--figure", "torque_error_rms,f_switch_Hz")
QUICK = ("run", "limit", "sweep over two keys")  # the others are proofs
COMMANDS = {
    "run": ("run", CUBIC, "--until", 0.03),
    "run of five phases": ("run", EXAMPLES / "five_phases_losses.toml", "--until", 0.03),
    "run on an array": ("run", EXAMPLES / "sun_cloud.toml", "--until", 0.03),
    "run with a speed": ("run", EXAMPLES / "load_step.toml", "--until", 0.03),
    "sweep over one key": ("sweep", CUBIC, "--until", 0.02, "--vary", BANDS),
    "sweep over two keys": ("sweep", CUBIC, "--until", 0.02, "--vary", BANDS, "--vary", TORQUES),
    "heat map": (
        *("sweep", CUBIC, "--until", 0.02, "--vary", BANDS, "--vary", TORQUES),
        *(*TWO, "--kind", "heat"),
    ),
    "parallel axes": (
        *("sweep", CUBIC, "--until", 0.02, "--vary", BANDS, "--vary", TORQUES),
        *("--kind", "parallel"),
    ),
    "Pareto front": ("sweep", CUBIC, "--until", 0.02, "--vary", BANDS, *TWO, "--kind", "pareto"),
    "limit": ("limit", CUBIC),
    "efficiency": ("efficiency", CUBIC, "--speed", "500,1000,1500", "--torque", "10,20,30"),
    "tune": (
        *("tune", CUBIC, "--vary", "control.i_band_A=0.5:2", "--until", 0.02, "--budget", 6),
        *("--minimise", "torque_error_rms", "--keep", "f_switch_Hz<15e3"),
    ),
    "map plot": ("map", "plot", EXAMPLES.parent / "machines" / "onelab_6_4.toml", "--out"),
}


@pytest.fixture
def texts(monkeypatch):
    """Every text that is drawn, by its box [px]; only those of the last drawing count."""
    drawn = {}
    usual = RendererAgg.draw_text

    def draw_text(self, gc, x, y, s, prop, angle, ismath=False, mtext=None):
        if mtext is not None and s.strip() and gc.get_alpha() != 0:
            size = (self.width, self.height)
            drawn.setdefault(id(self), {})[id(mtext)] = (s, box(mtext, self), size, self)
        usual(self, gc, x, y, s, prop, angle, ismath, mtext)

    monkeypatch.setattr(RendererAgg, "draw_text", draw_text)
    return drawn


def box(text, renderer):
    """Of the letters alone: an annotation's own box contains its arrow."""
    from matplotlib.text import Text

    return Text.get_window_extent(text, renderer)


def faults(drawn):
    """Texts that overlap or leave the figure, in the last drawing."""
    shown = list(list(drawn.values())[-1].values())
    assert len(shown) > 8
    found = []
    for one, other in combinations(shown, 2):
        a, b = one[1], other[1]
        wide = min(a.x1, b.x1) - max(a.x0, b.x0)
        high = min(a.y1, b.y1) - max(a.y0, b.y0)
        if wide > 1 and high > 1:
            found.append(f"{one[0]!r} and {other[0]!r} overlap by {wide:.0f} x {high:.0f}")
    for text, at, (width, height), _ in shown:
        if min(at.x0, at.y0, width - at.x1, height - at.y1) < -1:
            found.append(f"{text!r} is cut: {at} of {width} x {height}")
    return found


@pytest.mark.parametrize(
    "name",
    [name if name in QUICK else pytest.param(name, marks=pytest.mark.long) for name in COMMANDS],
)
def test_texts_have_their_places(name, texts, tmp_path):
    out = tmp_path / "a.png"
    where = (out,) if COMMANDS[name][-1] == "--out" else ("--plot", out)
    done = command(*COMMANDS[name], *where, "--width", "88mm", "--style", "grayscale")
    assert done.code == 0, done.error
    assert not faults(texts)
    pixels = imread(out)[..., :3]
    assert np.ptp(pixels, axis=2).max() < 0.02, "a colour in a grey figure"


@pytest.fixture(scope="module")
def found():
    drive = rl.load(CUBIC, ["control.T_s_us=20"])
    laws = ["sharing_cubic", "deadbeat", "pwm_current"]
    return compare(drive, laws, f_switch=5e3, octaves=(-1, 1), processes=1)


@pytest.mark.long
def test_a_comparison_fits_one_column(found, texts, tmp_path):
    with look("grayscale", "88mm"):
        save_figure(comparison_figure.figure(found), tmp_path / "a.png")
    assert not faults(texts)
    pixels = imread(tmp_path / "a.png")[..., :3]
    assert np.ptp(pixels, axis=2).max() < 0.02
