"""Lines of text as commands print them."""

import shutil
import sys
import textwrap
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
