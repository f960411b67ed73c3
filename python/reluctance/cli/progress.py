"""What commands show while they work."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Thread

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

AFTER_S = 1.0  # of work that a bar appears
EVERY_S = 10.0  # between lines of progress in a pipe


@contextmanager
def progress_bar(title: str, total: float) -> Iterator[Callable[[float], None]]:
    """A bar on a terminal for work that takes over a second; in a pipe a line now and then, also
    while the work tells nothing."""
    console = Console(stderr=True)
    if not console.is_terminal:
        with _in_lines(title, total) as told:
            yield told
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
        with _each(AFTER_S, lambda: progress.update(task, visible=True)):
            yield lambda reached: progress.update(task, completed=reached)


@contextmanager
def _in_lines(title: str, total: float) -> Iterator[Callable[[float], None]]:
    """Tells a log where the work is and since when, once in EVERY_S."""
    share, lines = 0.0, 0

    def told(reached: float) -> None:
        nonlocal share
        share = reached / total

    def show() -> None:
        nonlocal lines
        lines += 1
        text = f"{title}: {100 * share:.0f} % after {EVERY_S * lines:.0f} s"
        print(text, file=sys.stderr, flush=True)

    with _each(EVERY_S, show):
        yield told


@contextmanager
def _each(seconds: float, show: Callable[[], object]) -> Iterator[None]:
    """Shows something each time that so many seconds have passed, whatever the work does."""
    over = Event()

    def watch() -> None:
        while not over.wait(seconds):
            try:
                show()
            except OSError:  # nobody listens
                return

    watcher = Thread(target=watch, daemon=True)
    watcher.start()
    try:
        yield
    finally:
        over.set()
        watcher.join()


@contextmanager
def working(title: str) -> Iterator[None]:
    """A sign of life on a terminal, for work that tells nothing of its progress."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield
        return
    with console.status(title, spinner="line"):
        yield
