"""Figures as files: one list of formats for every command that draws."""

from __future__ import annotations

import base64
import io
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
    check_figure(path)
    content = drawn(figure, path.suffix.lower(), title=title or path.stem, below=below)
    write_whole(path, lambda p: p.write_bytes(content))


def drawn(figure: Figure, ending: str, *, title: str = "", below: str = "") -> bytes:
    """What `save_figure` writes. A figure is drawn before a file is opened: a backend that fails at
    a full disk leaves an open file behind."""
    import matplotlib as mpl

    if ending == ".html":
        from reluctance.interactive import page

        return page(title, figure, below).encode()
    content = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "reluctance"}):
        figure.savefig(content, format=ending[1:], dpi=110, metadata=METADATA[ending])
    return content.getvalue()


def embedded(figure: Figure) -> str:
    """The figure as the source of an <img>, so that a page needs no other file."""
    return "data:image/png;base64," + base64.b64encode(drawn(figure, ".png")).decode("ascii")
