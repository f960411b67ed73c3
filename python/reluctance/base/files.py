"""Files: what a command has read, where a result goes, and writing it whole or not at all."""

import os
import secrets
import signal
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from reluctance.base.errors import ParameterError, one_line

if TYPE_CHECKING:
    pass


_new_folders: list[Path] = []  # the deepest of each first
unfinished_groups: set[int] = set()  # processes that end with this one, by their leaders
_unfinished: set[Path] = set()  # what `remove_unfinished` clears away when the process is ended
_beginnings: list[None] = []  # of what is not in these sets yet
_put_off: list[int] = []  # signals that came meanwhile
kept: Counter[Path] = Counter()  # runs of this command that a store has for good
_read: set[Path] | None = None  # files that the command has read; None where there is no command


def begin_command() -> None:
    """From here on no result replaces a file that `note_input` has named."""
    global _read
    _read = set()


def end_command() -> None:
    """What is read and written from here on is no command's."""
    global _read
    _read = None


def edit_input(path: Path) -> None:
    """A file that the command reads in order to change it."""
    if _read is not None:
        _read.discard(path.resolve())


def note_input(path: Path) -> None:
    """A file of the user's that is read."""
    if _read is not None:
        with suppress(OSError, ValueError):  # a name that no file can have
            _read.add(path.resolve())


def why(fault: Exception) -> str:
    return getattr(fault, "strerror", None) or one_line(fault)


def check_ending(path: Path, endings: Collection[str]) -> str:
    """The ending of a path, if it is one of these and a file could be put there."""
    ending = path.suffix.lower()
    if ending not in endings:
        told = f"ending `{ending}`" if ending else "no ending"
        raise ParameterError(f"{path}: {told}, need one of {', '.join(sorted(endings))}")
    check_place(path)
    return ending


def check_place(path: Path) -> None:
    """Raises ParameterError where a file could not be put: before the work, not after it."""
    folder = path.absolute().parent
    if not _is_dir(folder):
        raise ParameterError(f"{path}: the folder {path.parent} does not exist; make it first")
    if _is_dir(path):
        raise ParameterError(f"{path} is a folder, need a file; choose another name")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise ParameterError(f"{path}: no right to write in {folder}; choose another folder")
    refuse_input(path, _read or ())


def refuse_input(out: Path, read: Iterable[Path | None]) -> None:
    """Raises ParameterError where a result would replace a file that the command reads."""
    there = [path for path in read if path is not None and is_file(path)]
    if is_file(out) and any(path.samefile(out) for path in there):
        raise ParameterError(f"{out} is read by this command; name another file for its result")


def check_own_table(out: Path, columns: Iterable[str]) -> None:
    """Raises ParameterError where a file is there that does not begin with these columns: this
    command has not written it, so it does not replace it."""
    if not is_file(out):
        return
    with told(out), out.open("rb") as file:
        head = ",".join(columns).encode()
        if file.read(len(head)) != head:
            raise ParameterError(
                f"{out} exists, and is no table with the columns that this command writes; "
                "remove it, or choose another name"
            )


def check_folder(folder: Path, remedy: str = "choose another --out") -> None:
    """Raises ParameterError where a folder could not be made, or not be written to."""
    there = folder.absolute()
    while not exists(there):
        there = there.parent
    if not there.is_dir():
        raise ParameterError(f"{folder}: {there} is a file, need a folder; {remedy}")
    if not os.access(there, os.W_OK | os.X_OK):
        raise ParameterError(f"{folder}: no right to write in {there}; {remedy}")


def make_folder(folder: Path, remedy: str = "choose another --out") -> Path:
    """The folder, made where it does not exist, with those above it."""
    check_folder(folder, remedy)
    _new_folders.extend(p for p in (folder, *folder.parents) if not exists(p))
    with told(folder):
        folder.mkdir(parents=True, exist_ok=True)
    return folder


@contextmanager
def told(path: Path) -> Iterator[None]:
    """What goes wrong with the disk while `path` is written, as one line."""
    try:
        yield
    except OSError as fault:
        why = os.strerror(fault.errno) if fault.errno else one_line(fault)
        raise ParameterError(
            f"cannot write {path}: {why}; nothing is left half-written, choose another place"
        ) from None


def write_whole(path: Path, write: Callable[[Path], object]) -> None:
    """Lets `write` fill a temporary file beside `path`, then puts it in place in one step.

    Raises
    ------
    ParameterError
        If the disk does not take it; then `path` is as it was.
    """
    write_together({path: write})


def write_once(path: Path, write: Callable[[Path], object]) -> None:
    """Like `write_whole`, but a file that another process has put there meanwhile stays."""
    write_together({path: write}, put=_put_once)


def write_together(
    files: Mapping[Path, Callable[[Path], object]],
    *,
    put: Callable[[Path, Path], object] = os.replace,
) -> None:
    """Several files that belong together, like `write_whole`: all are full before one appears."""
    full: dict[Path, Path] = {}
    try:
        for path, write in files.items():
            check_place(path)
            with told(path):
                full[path] = _temporary(path)
                write(full[path])
        for path, temporary in full.items():
            with told(path):
                put(temporary, path)
    finally:
        for temporary in full.values():
            temporary.unlink(missing_ok=True)
            _unfinished.discard(temporary)


def _put_once(temporary: Path, path: Path) -> None:
    """In one step, which can succeed once. A file system without links lets others see it grow."""
    try:
        os.link(temporary, path)
    except FileExistsError:
        pass
    except OSError:
        try:
            with path.open("xb") as file:
                file.write(temporary.read_bytes())
        except FileExistsError:
            pass


def _temporary(path: Path) -> Path:
    """An empty file beside `path`, with its ending, and the rights that the umask leaves."""
    made = path.absolute().parent / f"tmp{secrets.token_hex(8)}{path.suffix}"
    with noted():
        made.open("xb").close()
        _unfinished.add(made)
    return made


@contextmanager
def scratch(folder: Path | None = None) -> Iterator[Path]:
    """A folder that is gone afterwards, in `folder` or where the system keeps such."""
    import tempfile

    with noted():
        made = tempfile.TemporaryDirectory(dir=folder)
        _unfinished.add(Path(made.name))
    with made as name:
        try:
            yield Path(name)
        finally:
            _unfinished.discard(Path(name))


def remove_unfinished() -> None:
    """Clears temporary files and folders away, new folders that are empty, and compilers that run:
    for a process that is being ended."""
    import shutil

    for leader in list(unfinished_groups):
        end_group(leader)
    for path in list(_unfinished):
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)
    for folder in _new_folders:
        with suppress(OSError):  # it holds something
            folder.rmdir()


@contextmanager
def noted() -> Iterator[None]:
    """Within, a process, a file or a folder begins and is noted as unfinished: a signal waits until
    it is."""
    _beginnings.append(None)
    try:
        yield
    finally:
        _beginnings.pop()
        if _put_off and not _beginnings:
            os.kill(os.getpid(), _put_off[0])


def puts_off(number: int) -> bool:
    """Whether a signal has to wait; it is sent again then."""
    if _beginnings:
        _put_off.append(number)
    return bool(_beginnings)


def end_group(leader: int) -> None:
    """Ends a process and those that it started."""
    with suppress(ProcessLookupError):
        os.killpg(leader, signal.SIGKILL)


def write_text(path: Path, text: str) -> None:
    """All of the text or nothing."""

    def write(temporary: Path) -> None:
        temporary.write_text(text, encoding="utf-8")

    write_whole(path, write)


def is_file(path: Path) -> bool:
    """Whether a path names a file; a name that no file can have names none."""
    try:
        return path.is_file()
    except (OSError, ValueError):  # too long, or with a zero byte
        return False


def _is_dir(path: Path) -> bool:
    try:
        return path.is_dir()
    except (OSError, ValueError):  # a name that is too long, or has a zero byte
        return False


def exists(path: Path) -> bool:
    try:
        return path.exists() or path == path.parent
    except (OSError, ValueError):
        return False
