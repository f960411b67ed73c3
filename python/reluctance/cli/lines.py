"""Lines of text as commands print them."""

import shutil
import sys
import textwrap
from collections.abc import Iterable
from typing import TextIO


def wrapped(line: str, stream: TextIO | None = None, indent: str = "") -> str:
    """Broken between words on a terminal, whole in a pipe.

    Parameters
    ----------
    stream : by default standard output.
    indent : of all lines but the first.
    """
    if not (stream or sys.stdout).isatty():
        return line
    return textwrap.fill(
        line,
        shutil.get_terminal_size().columns,
        subsequent_indent=indent,
        break_long_words=False,
        break_on_hyphens=False,
    )


def tell_notes(notes: Iterable[str], *, as_json: bool = False) -> None:
    """Each on lines of its own. Where standard output is for one JSON object, on standard error."""
    stream = sys.stderr if as_json else sys.stdout
    for note in notes:
        print(wrapped(f"note: {note}", stream), file=stream)
