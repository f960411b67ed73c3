"""Files: read TOML, check an ending, write whole or not at all, write a table of columns."""

import os
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reluctance.errors import ParameterError

Columns = Mapping[str, NDArray[np.float64]]


def read_toml(path: Path) -> dict[str, Any]:
    """A TOML file.

    Raises
    ------
    ParameterError
        If it cannot be read or parsed.
    """
    import tomllib  # here, as tempfile below: a tenth of the import time of the package

    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as fault:
        raise ParameterError(f"cannot read {path}: {fault.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as fault:
        raise ParameterError(f"{path} is not valid TOML: {fault}") from None


def toml_value(text: str) -> Any:
    """A value as TOML has it; a bare word is text."""
    import tomllib

    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def check_ending(path: Path, endings: Collection[str]) -> str:
    """The ending of a path, if it is one of these and its folder exists."""
    ending = path.suffix.lower()
    if ending not in endings:
        told = f"ending `{ending}`" if ending else "no ending"
        raise ParameterError(f"{path}: {told}, need one of {', '.join(sorted(endings))}")
    if not path.absolute().parent.is_dir():
        raise ParameterError(f"{path}: the folder {path.parent} does not exist; make it first")
    return ending


def write_whole(path: Path, write: Callable[[Path], None]) -> None:
    """Lets `write` fill a temporary file beside `path`, then puts it in place in one step."""
    import tempfile

    handle, name = tempfile.mkstemp(dir=path.absolute().parent, suffix=path.suffix)
    os.close(handle)
    try:
        write(Path(name))
        os.chmod(name, 0o666 & ~_umask())
        os.replace(name, path)
    except BaseException:
        os.unlink(name)
        raise


def write_text(path: Path, text: str) -> None:
    """All of the text or nothing."""

    def write(temporary: Path) -> None:
        temporary.write_text(text, encoding="utf-8")

    write_whole(path, write)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


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
    np.savetxt(
        path,
        np.column_stack(list(table.values())),
        fmt="%.17g",
        delimiter=",",
        header=",".join(table),
        comments="",
    )


def _npz(path: Path, table: Columns) -> None:
    with path.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **table)


def _parquet(path: Path, table: Columns) -> None:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise ParameterError(
            "parquet needs pyarrow; `pip install reluctance[parquet]` or write npz"
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
