"""Errors that a user can mend: the command line prints them on one line and exits with 2."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

LONGEST_LINE = 1000  # of an error: a name from a file may have any length


class ParameterError(ValueError):
    """An input that cannot be used: what it is, its value, what is needed, what to do."""

    def __init__(self, text: object) -> None:
        super().__init__(one_line(text))


class Unsolved(RuntimeError):
    """A search of the numerics that found nothing: what was sought, where, and what may help. What
    asks for it either takes something else or makes a ParameterError of it."""


class Note(UserWarning):
    """What was assumed of an input: the command line prints it on one line and goes on."""


def one_line(fault: object) -> str:
    """A text, which names from files may be in, on one line that a terminal can show."""
    text = " ".join(str(fault).split())
    text = "".join(c if c.isprintable() else "?" for c in text)
    return text if len(text) <= LONGEST_LINE else f"{text[: LONGEST_LINE - 4]} ..."


@contextmanager
def named(path: Path) -> Iterator[None]:
    """Around work on a file: a ParameterError that does not name the file begins with its name."""
    try:
        yield
    except ParameterError as fault:
        if one_line(path) in str(fault):
            raise
        raise ParameterError(f"{path}: {fault}") from None


def need(holds: bool, what: str, value: object, need: str) -> None:
    """Raises ParameterError unless it holds."""
    if not holds:
        raise ParameterError(f"{what} = {value}, need {need}")
