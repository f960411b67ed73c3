"""Lines of text as commands print them."""

import shutil
import sys
import textwrap
from typing import TextIO


def wrapped(line: str, stream: TextIO | None = None) -> str:
    """Broken between words on a terminal, whole in a pipe. stream: by default standard output."""
    if not (stream or sys.stdout).isatty():
        return line
    width = shutil.get_terminal_size().columns
    return textwrap.fill(line, width, break_long_words=False, break_on_hyphens=False)
