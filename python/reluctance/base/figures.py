"""Figures as files: one list of formats, one width and one style for every command that draws."""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import TYPE_CHECKING, Any

from reluctance.base.errors import ParameterError
from reluctance.base.files import check_ending, write_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ENDINGS = (".png", ".svg", ".pdf", ".html")
# What would make two files of one figure differ.
METADATA: dict[str, dict[str, str | None]] = {
    ".png": {"Software": None},
    ".svg": {"Date": None},
    ".pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}
# Letters in PDF and PostScript as TrueType: journals refuse Type 3.
EMBEDDED: dict[Any, Any] = {"pdf.fonttype": 42, "ps.fonttype": 42}
INCHES = {"in": 1.0, "cm": 1 / 2.54, "mm": 1 / 25.4}
NARROWEST, WIDEST = 3.0, 20.0  # that a figure may be [in]: a column of a journal has 3.3 to 3.5
SMALL: dict[Any, Any] = {
    "font.size": 8,
    "axes.titlesize": 8,
    "legend.fontsize": 7,
}  # where a width is given [pt]

width_in: ContextVar[float | None] = ContextVar("width_in", default=None)  # see `look`


@contextmanager
def look(style: str | None, width: str | None) -> Iterator[None]:
    """Figures drawn within have a style of Matplotlib, by name or file, and a width as `3.5in` or
    `88mm`. With a width they have no title, and panels below each other where the width is small.

    Raises
    ------
    ParameterError
        If there is no such style, or the width is none.
    """
    inches = None if width is None else _inches(width)
    if style is None and inches is None:
        yield
        return
    import matplotlib as mpl
    from matplotlib import style as styles

    with mpl.rc_context({} if inches is None else SMALL):
        if style is not None:
            try:
                styles.use(style)
            except OSError:
                raise ParameterError(
                    f"--style {style}: Matplotlib has no such style; take one of its own, as "
                    "`grayscale`, or a file .mplstyle"
                ) from None
        token = width_in.set(inches)
        try:
            yield
        finally:
            width_in.reset(token)


def _inches(text: str) -> float:
    match = re.fullmatch(r"\s*(\d*\.?\d+)\s*(in|cm|mm)\s*", text)
    width = float(match[1]) * INCHES[match[2]] if match else 0.0
    if not NARROWEST <= width <= WIDEST:
        raise ParameterError(
            f"--width {text}: need {NARROWEST:g}in to {WIDEST:g}in, as 3.5in, 8.8cm or 88mm"
        )
    return width


def check_figure(path: Path, style: str | None = None, width: str | None = None) -> None:
    """Raises ParameterError where a figure could not be written: before the work, not after it."""
    with look(style, width):
        pass
    if check_ending(path, ENDINGS) == ".html":
        try:
            import bokeh  # noqa: F401
        except ImportError:
            raise ParameterError(
                "a page with zoom needs bokeh; `pip install 'reluctance[html]'`, or plot to .png"
            ) from None


def check_figures(paths: Sequence[Path | None], style: str | None, width: str | None) -> None:
    """Likewise of the figures that a command is asked for; a look without a figure is refused."""
    for path in paths:
        if path is not None:
            check_figure(path, style, width)
    for option, value in (("--width", width), ("--style", style)):
        if value is not None and all(path is None for path in paths):
            raise ParameterError(
                f"{option} {value} has no effect without a figure; add --plot FILE"
            )


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
        from reluctance.base.interactive import page

        return page(title, figure, below).encode()
    content = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "reluctance", **EMBEDDED}):
        figure.savefig(content, format=ending[1:], dpi=110, metadata=METADATA[ending])
    return content.getvalue()


def embedded(figure: Figure) -> str:
    """The figure as the source of an <img>, so that a page needs no other file."""
    return "data:image/png;base64," + base64.b64encode(drawn(figure, ".png")).decode("ascii")
