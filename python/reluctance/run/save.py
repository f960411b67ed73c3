"""The waveforms of a run as a table of columns, and as a file."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from reluctance.files import write_table
from reluctance.run.simulate import Result


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
    write_table(Path(path), columns(result))
