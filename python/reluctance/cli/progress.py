"""What commands show while they work."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

EVERY_S = 10.0  # between lines of progress in a pipe


@contextmanager
def progress_bar(title: str, total: float) -> Iterator[Callable[[float], None]]:
    """A bar on a terminal for work that takes over a second; in a pipe a line now and then."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield _in_lines(title, total)
        return
    with Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TaskProgressColumn(),
        TimeRemainingColumn(),
        console=console,
        transient=True,
    ) as progress:
        task = progress.add_task(title, total=total, visible=False)

        def told(reached: float) -> None:
            elapsed = progress.tasks[task].elapsed or 0.0
            progress.update(task, completed=reached, visible=elapsed > 1.0)

        yield told


def _in_lines(title: str, total: float) -> Callable[[float], None]:
    """Tells a log where the work is, at most once in EVERY_S."""
    last = monotonic()

    def told(reached: float) -> None:
        nonlocal last
        if monotonic() - last >= EVERY_S:
            last = monotonic()
            print(f"{title}: {100 * reached / total:.0f} %", file=sys.stderr, flush=True)

    return told


@contextmanager
def working(title: str) -> Iterator[None]:
    """A sign of life on a terminal, for work that tells nothing of its progress."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield
        return
    with console.status(title, spinner="line"):
        yield
