"""Files: read TOML, check where a result goes, write whole or not at all, write a table."""

import os
import re
import secrets
import signal
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from reluctance.base.columns import point_hint
from reluctance.base.errors import ParameterError, one_line

if TYPE_CHECKING:
    from numpy.typing import NDArray

Columns = Mapping[str, "NDArray[Any]"]  # of numbers; some of text
MAX_TOML_BYTES = 1_000_000  # a drive or machine file has a few kilobytes
MOST_DOTS = 100  # in a key: the parser's time and memory rise with the square of its parts
TABLES_OF_NUMBERS = (".csv", ".txt", ".tsv", ".dat", ".xlsx", ".xls", ".mat", ".json")
KEY_ENDS = re.compile(r"[=,\[\]{}]")

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


def read_toml(path: Path) -> dict[str, Any]:
    """A TOML file.

    Raises
    ------
    ParameterError
        If it cannot be read or parsed.
    """
    import tomllib  # here, as tempfile below: a tenth of the import time of the package

    note_input(path)
    try:
        with path.open("rb") as file:
            content = file.read(MAX_TOML_BYTES + 1)
    except (OSError, ValueError) as fault:  # ValueError: a zero byte in the name
        raise ParameterError(f"cannot read {path}: {_why(fault)}{_other_file(path)}") from None
    if len(content) > MAX_TOML_BYTES:
        raise ParameterError(
            f"{path} has more than {MAX_TOML_BYTES / 1e6:g} MB, need a TOML file of some kilobytes"
        )
    try:
        text = content.decode("utf-8-sig")
        lines = (line for line in text.splitlines() if not line.lstrip().startswith("#"))
        parts = (part for line in lines for part in KEY_ENDS.split(line))
        deepest = max((part.count(".") for part in parts), default=0)
        if deepest > MOST_DOTS:
            raise ParameterError(
                f"{path}: a key of {deepest + 1} parts, need at most {MOST_DOTS}; check the quotes"
            )
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as fault:
        if path.suffix.lower() in TABLES_OF_NUMBERS:
            raise ParameterError(
                f"{path} is a table of numbers, need a .toml file; if it is a flux map, "
                "`reluctance map import` makes a machine file of it"
            ) from None
        raise ParameterError(
            f"{path} is not valid TOML: {one_line(fault)}{_toml_hint(fault, content)}"
        ) from None


def _other_file(path: Path) -> str:
    """The ending of an error about a file that is not there: the one that was meant."""
    from reluctance.base.resources import resources  # for mistakes only

    if is_file(Path(f"{path}.toml")):
        return f"; did you mean {path}.toml?"
    name = path.name.removesuffix(".toml")
    if not _exists(path) and is_file(resources("examples") / f"{name}.toml"):
        return f"; `reluctance examples {name} --copy .` copies the example of this name"
    return ""


def _toml_hint(fault: Exception, content: bytes) -> str:
    """What people write instead of TOML."""
    from reluctance.base.mended import meant  # for mistakes only

    if isinstance(fault, UnicodeDecodeError):
        return "; save the file as UTF-8"
    if "Invalid date" in str(fault):
        return "; need a day of the calendar, as in 2025-02-28"
    if "Cannot overwrite" in str(fault) or "twice" in str(fault):
        return "; it stands there twice, remove one"
    place = re.search(r"line (\d+)", str(fault))
    lines = content.decode("utf-8-sig", "replace").splitlines()
    line = lines[int(place[1]) - 1] if place and int(place[1]) <= len(lines) else ""
    if day := re.search(r"=\s*(\d{1,2})\.(\d{1,2})\.(\d{4})\b", line):
        return f"; need a date as {day[3]}-{day[2]:0>2}-{day[1]:0>2}"
    if comma := re.search(r"=\s*([-+]?\d+,\d+)\s*(#.*)?$", line):
        return f"; {point_hint(comma[1])}"
    if place:
        return f"; write `{right}`" if (right := meant(line)) else ""
    for number, each in enumerate(lines, 1):  # a text without its end
        if right := meant(each):
            return f"; in line {number} write `{right}`"
    return ""


def _why(fault: Exception) -> str:
    return getattr(fault, "strerror", None) or one_line(fault)


def toml_value(text: str) -> Any:
    """A value as TOML has it; a bare word is text."""
    import tomllib

    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


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
    while not _exists(there):
        there = there.parent
    if not there.is_dir():
        raise ParameterError(f"{folder}: {there} is a file, need a folder; {remedy}")
    if not os.access(there, os.W_OK | os.X_OK):
        raise ParameterError(f"{folder}: no right to write in {there}; {remedy}")


def make_folder(folder: Path, remedy: str = "choose another --out") -> Path:
    """The folder, made where it does not exist, with those above it."""
    check_folder(folder, remedy)
    _new_folders.extend(p for p in (folder, *folder.parents) if not _exists(p))
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


def _exists(path: Path) -> bool:
    try:
        return path.exists() or path == path.parent
    except (OSError, ValueError):
        return False


def write_table(path: Path, table: Columns) -> None:
    """Writes columns of one length; the ending chooses csv, npz, parquet or mat.

    Raises
    ------
    ParameterError
        If the ending is unknown, the folder is missing, or parquet support is not installed.
    """
    write = TABLES[check_ending(path, TABLES)]
    write_whole(path, lambda temporary: write(temporary, table))


def _csv(path: Path, table: Columns) -> None:
    import numpy as np

    if any(column.dtype.kind == "U" for column in table.values()):
        return _csv_with_text(path, table)
    np.savetxt(
        path,
        np.column_stack(list(table.values())),
        fmt="%.17g",
        delimiter=",",
        header=",".join(table),
        comments="",
    )


def _csv_with_text(path: Path, table: Columns) -> None:
    """Numbers as above; nothing where there is none."""
    import csv
    from math import isnan

    def cell(value: Any) -> str:
        if isinstance(value, str):
            return value
        return "" if isnan(value) else f"{value:.17g}"

    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(table)
        for row in zip(*(column.tolist() for column in table.values()), strict=True):
            writer.writerow([cell(value) for value in row])


def _npz(path: Path, table: Columns) -> None:
    import numpy as np

    with path.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **table)


def _parquet(path: Path, table: Columns) -> None:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise ParameterError(
            "parquet needs pyarrow; `pip install 'reluctance[parquet]'` or write npz"
        ) from None
    pyarrow.parquet.write_table(pyarrow.table(dict(table)), path)


def _mat(path: Path, table: Columns) -> None:
    from scipy.io import savemat

    savemat(path, table, do_compression=True)


TABLES: dict[str, Callable[[Path, Columns], None]] = {
    ".csv": _csv,
    ".npz": _npz,
    ".parquet": _parquet,
    ".mat": _mat,
}
