"""Waveforms to files, all or nothing: a file appears only when it is complete."""

import os
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from reluctance.errors import ParameterError
from reluctance.simulate import Result


def columns(result: Result) -> dict[str, NDArray[np.float64]]:
    """The waveforms under their border names, each of shape (n,)."""
    table = {
        "t_s": result.t,
        "theta_m_rad": result.theta_m,
        "speed_rpm": result.omega_m * 30 / np.pi,
        "u_dc_V": result.u_dc,
        "tau_Nm": result.tau,
        "tau_ref_Nm": result.tau_ref,
    }
    for k in range(len(result.i)):
        phase = "abcdef"[k]
        table[f"i_{phase}_A"] = result.i[k]
        table[f"u_{phase}_V"] = result.u[k]
        table[f"psi_{phase}_Wb"] = result.psi[k]
        table[f"tau_{phase}_Nm"] = result.tau_ph[k]
        table[f"leg_{phase}"] = result.leg[k]
        table[f"i_ref_{phase}_A"] = result.i_ref[k]
    return table


def save(result: Result, path: str | Path) -> None:
    """Writes the waveforms; the ending chooses csv, npz, parquet or mat.

    Raises
    ------
    ParameterError
        If the ending is unknown, the folder is missing, or parquet support is not installed.
    """
    path = Path(path)
    write = WRITERS[check_ending(path, WRITERS)]
    write_whole(path, lambda temporary: write(temporary, columns(result)))


def check_ending(path: Path, endings: dict[str, Callable[..., None]] | set[str]) -> str:
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
    handle, name = tempfile.mkstemp(dir=path.absolute().parent, suffix=path.suffix)
    os.close(handle)
    try:
        write(Path(name))
        os.chmod(name, 0o666 & ~_umask())
        os.replace(name, path)
    except BaseException:
        os.unlink(name)
        raise


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _csv(path: Path, table: dict[str, NDArray[np.float64]]) -> None:
    np.savetxt(
        path,
        np.column_stack(list(table.values())),
        fmt="%.17g",
        delimiter=",",
        header=",".join(table),
        comments="",
    )


def _npz(path: Path, table: dict[str, NDArray[np.float64]]) -> None:
    with path.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **table)


def _parquet(path: Path, table: dict[str, NDArray[np.float64]]) -> None:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise ParameterError(
            "parquet needs pyarrow; `pip install reluctance[parquet]` or write npz"
        ) from None
    pyarrow.parquet.write_table(pyarrow.table(table), path)


def _mat(path: Path, table: dict[str, NDArray[np.float64]]) -> None:
    from scipy.io import savemat

    savemat(path, table, do_compression=True)


WRITERS: dict[str, Callable[[Path, dict[str, NDArray[np.float64]]], None]] = {
    ".csv": _csv,
    ".npz": _npz,
    ".parquet": _parquet,
    ".mat": _mat,
}
