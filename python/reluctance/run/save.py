"""The waveforms of a run as a file."""

from pathlib import Path

from reluctance.files import write_table
from reluctance.run.result import Result


def save(result: Result, path: str | Path) -> None:
    """Writes the waveforms; the ending chooses csv, npz, parquet or mat.

    Raises
    ------
    ParameterError
        If the ending is unknown, the folder is missing, or parquet support is not installed.
    """
    write_table(Path(path), result.columns())
