"""What commands show while they work, and how they break lines."""

import shutil
import sys
import textwrap
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn


@contextmanager
def progress_bar(title: str, total: float) -> Iterator[Callable[[float], None]]:
    """A bar on a terminal for work that takes over a second; silent in a pipe."""
    console = Console(stderr=True)
    with Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TaskProgressColumn(),
        TimeRemainingColumn(),
        console=console,
        disable=not console.is_terminal,
        transient=True,
    ) as progress:
        task = progress.add_task(title, total=total, visible=False)

        def told(reached: float) -> None:
            elapsed = progress.tasks[task].elapsed or 0.0
            progress.update(task, completed=reached, visible=elapsed > 1.0)

        yield told


@contextmanager
def working(title: str) -> Iterator[None]:
    """A sign of life on a terminal, for work that tells nothing of its progress."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield
        return
    with console.status(title, spinner="line"):
        yield


def wrapped(line: str) -> str:
    """Broken between words on a terminal, whole in a pipe."""
    return textwrap.fill(line, shutil.get_terminal_size().columns) if sys.stdout.isatty() else line
