"""Figures as files: one list of formats for every command that draws."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from reluctance.errors import ParameterError
from reluctance.files import check_ending, write_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ENDINGS = (".png", ".svg", ".pdf", ".html")
# What would make two files of one figure differ.
METADATA: dict[str, dict[str, str | None]] = {
    ".png": {"Software": None},
    ".svg": {"Date": None},
    ".pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}


def check_figure(path: Path) -> None:
    """Raises ParameterError where a figure could not be written: before the work, not after it."""
    if check_ending(path, ENDINGS) == ".html":
        try:
            import bokeh  # noqa: F401
        except ImportError:
            raise ParameterError(
                "a page with zoom needs bokeh; `pip install 'reluctance[html]'`, or plot to .png"
            ) from None


def save_figure(figure: Figure, path: Path, *, title: str = "", below: str = "") -> None:
    """Writes a figure, the same bytes for the same one; the ending chooses png, svg, pdf or html.

    Parameters
    ----------
    figure : Figure
    path : Path
    title : str
        Of the page that .html gives.
    below : str
        What follows the figure there, as HTML.
    """
    import matplotlib as mpl

    check_figure(path)
    ending = path.suffix.lower()
    if ending == ".html":
        from reluctance.interactive import page

        text = page(title or path.stem, figure, below)
        write_whole(path, lambda p: p.write_text(text, encoding="utf-8") and None)
        return
    with mpl.rc_context({"svg.hashsalt": "reluctance"}):
        write_whole(path, lambda p: figure.savefig(p, dpi=110, metadata=METADATA[ending]))
