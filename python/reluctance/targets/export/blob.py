"""The resolved parameters of a drive as bytes: what the C interface is made from.

The core writes them from the objects that the simulation runs (include/srm/c_api/archive.hpp).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.base.files import check_place, write_whole
from reluctance.drive.drive import Drive
from reluctance.drive.guard.supervised import controller
from reluctance.drive.run.plant import loop_parts


@dataclass(frozen=True)
class Kind:
    """What a library must have been compiled with to run a drive."""

    law: str  # struct of the law: EdgeMpc
    machine: str  # struct of the machine model: LeHuy or FluxMap
    n_phases: int
    precision: str  # of the controller: float or double

    def __str__(self) -> str:
        return f"{self.law}, {self.machine}, {self.n_phases} phases, {self.precision}"


def write_blob(drive: Drive, file: str | Path) -> Kind:
    """Write the blob of a drive to a file.

    Parameters
    ----------
    drive : Drive
    file : str or Path

    Returns
    -------
    Kind
        What a library must have been compiled with to run it.

    Raises
    ------
    ParameterError
        If the law has no form outside Python, or the file cannot be written.
    """
    file = Path(file)
    check_place(file)
    content = blob(drive)
    write_whole(file, lambda path: path.write_bytes(content))
    return kind(drive)


def blob(drive: Drive, *, record: float | None = None) -> bytes:
    """The resolved parameters of a drive, for the C interface.

    Parameters
    ----------
    drive : Drive
    record : float, optional
        Interval of the waveforms [s]; 0 keeps every solver point and event, None keeps nothing.

    Raises
    ------
    ParameterError
        If the law has no form outside Python.
    """
    loop = _core.SimulationParts(**loop_parts(drive, -1.0 if record is None else record))
    return _core.blob(exported_controller(drive), loop)


def kind(drive: Drive) -> Kind:
    """What a library must have been compiled with to run a drive."""
    law = _core.law_of(exported_controller(drive)) or ""
    machine = type(drive.machine.magnetics).__name__
    return Kind(law, machine, drive.machine.n_phases, drive.control.precision)


def exported_controller(drive: Drive) -> _core.Controller:
    """The controller of a drive, if the C interface can have it.

    Raises
    ------
    ParameterError
        If the law has no form outside Python.
    """
    drive.check_sound("the C interface, in units and in the studio")
    if drive.control.learns:
        raise ParameterError(
            "[control] learn = true has no form in the C interface, in units and in the studio; "
            "need false there (the firmware package learns)"
        )
    made = exportable(drive, controller(drive))
    law = _core.law_of(made) or ""
    if len(law) > 24:
        raise ParameterError(f"the law `{law}` has no name of 1 to 24 letters")
    return made


def exportable(drive: Drive, made: _core.Controller) -> _core.Controller:
    """A controller of a drive, if its law has a form outside Python."""
    if _core.law_of(made) is None:
        raise ParameterError(
            f"[control] law = {drive.control.law!r} cannot be exported; "
            "a law in C++ can (docs/extending.md)"
        )
    return made
