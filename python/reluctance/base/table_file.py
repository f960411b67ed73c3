"""Writing a table of columns: the ending chooses the format."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from reluctance.base.errors import ParameterError
from reluctance.base.files import check_ending, write_whole

if TYPE_CHECKING:
    from numpy.typing import NDArray

Columns = Mapping[str, "NDArray[Any]"]  # of numbers; some of text


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
