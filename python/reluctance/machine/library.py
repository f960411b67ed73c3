"""The machine library, and the right class for a [machine] table."""

from copy import deepcopy
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from reluctance.base.errors import ParameterError
from reluctance.base.files import is_file
from reluctance.base.reading import reading
from reluctance.base.resources import resources
from reluctance.base.schema import did_you_mean, placed
from reluctance.base.toml_file import read_toml
from reluctance.machine.machine_file import MachineFile
from reluctance.machine.models import MODELS, Magnetics


def model_class(model: str) -> type[MachineFile]:
    """The class of a model of the list."""
    module, _, name = MODELS[model].rpartition(".")
    found: type[MachineFile] = getattr(import_module(f"reluctance.machine.{module}"), name)
    return found


def model_of(machine: Magnetics) -> type[MachineFile]:
    """The class whose machine of the core this is."""
    return next(cls for cls in map(model_class, MODELS) if isinstance(machine, cls.core))


class FiledTable(dict[str, Any]):
    """A [machine] table that knows the file that it is from, and what stands there: its values may
    be changed before they are checked."""

    def __init__(self, table: dict[str, Any], file: Path) -> None:
        super().__init__(table)
        self.file, self.as_filed = file, deepcopy(table)


def machine_from(table: object) -> MachineFile:
    """The machine of a [machine] table, checked.

    Raises
    ------
    ParameterError
        With one line: an unknown model or key, a value out of range, a flux map that is refused.
        It begins with the file of the table, if the fault stands there.
    """
    try:
        return _machine_from(table)
    except ParameterError as fault:
        if isinstance(table, FiledTable) and _fault(table.as_filed) == str(fault):
            line = str(fault)
            if table.get("model") == "geometry":  # there the tables stand by themselves
                line = line.replace("[machine.", "[")
            raise ParameterError(f"{table.file}: {line}") from None
        raise


def _fault(table: object) -> str:
    """What is wrong with a table."""
    try:
        _machine_from(table)
    except ParameterError as fault:
        return str(fault)
    return ""


def _machine_from(table: object) -> MachineFile:
    if not isinstance(table, dict):
        raise ParameterError(f"[machine] = {table!r}, need a table")
    if "model" not in table:
        raise ParameterError("missing key `model` in [machine]")
    model = table["model"]
    if not isinstance(model, str) or model not in MODELS:
        raise ParameterError(
            f"[machine] model = {model!r} is unknown{did_you_mean(str(model), MODELS)}"
        )
    return model_class(model).from_table(table, "[machine]")


def placed_machine(table: dict[str, Any], folder: Path) -> dict[str, Any]:
    """The [machine] table with the files in it seen from here instead of from its folder."""
    model = table.get("model")
    kind = model_class(model) if isinstance(model, str) and model in MODELS else MachineFile
    return placed(kind.filed(), table, folder)


GEOMETRY = ("machine", "lamination", "stator", "rotor", "air_gap", "winding", "map")


def is_geometry(data: dict[str, Any]) -> bool:
    """Whether these are the tables of a geometry file."""
    return "stator" in data or "lamination" in data or "air_gap" in data


def flattened(data: dict[str, Any]) -> dict[str, Any]:
    """The tables of a geometry file as one [machine] table, as a drive holds it."""
    for key in data:
        if key not in GEOMETRY:
            raise ParameterError(f"unknown table `{key}`{did_you_mean(key, GEOMETRY)}")
    head = data.get("machine")
    rest = {key: value for key, value in data.items() if key != "machine"}
    return {**(head if isinstance(head, dict) else {}), **rest, "model": "geometry"}


@dataclass(frozen=True)
class Entry:
    """One machine of the library."""

    key: str  # what a drive file calls it
    machine: MachineFile
    tau_peak: float  # greatest static torque of one phase at i_max_A [N m]

    def with_units(self) -> dict[str, object]:
        """As `reluctance machines --json` prints it."""
        m = self.machine
        return {
            "machine": self.key,
            "name": m.name,
            "N_s": m.N_s,
            "N_r": m.N_r,
            "n_phases": m.n_phases,
            "i_max_A": m.i_max_A,
            "tau_peak_Nm": self.tau_peak,
            "model": m.model,
            "source": m.source,
            "licence": m.licence,
            "assumed": m.assumed,
        }


def machines() -> list[Entry]:
    """All machines of the library, by name."""
    found = []
    for path in sorted(resources("machines").glob("*.toml")):
        machine = machine_from(machine_table(path.name, path.parent))
        torque = machine.tau(machine.i_max_A, np.linspace(0, np.pi, 181))
        found.append(Entry(path.stem, machine, float(torque.max())))
    return found


def machine_table(machine: str, folder: Path) -> dict[str, Any]:
    """The [machine] table of a library machine by its name, or of a file by its path."""
    candidates = [folder / machine, resources("machines") / f"{machine}.toml"]
    for candidate in candidates:
        if is_file(candidate):
            data = read_toml(candidate)
            if is_geometry(data):
                with reading(candidate, "a geometry"):
                    table = flattened(data)
                return FiledTable(placed_machine(table, candidate.parent), candidate)
            if set(data) != {"machine"}:
                raise ParameterError(f"{candidate}: need the table [machine] and nothing else")
            table = data["machine"]
            if not isinstance(table, dict):
                raise ParameterError(f"{candidate}: machine = {table!r}, need the table [machine]")
            return FiledTable(placed_machine(table, candidate.parent), candidate)
    names = [p.stem for p in resources("machines").glob("*.toml")]
    raise ParameterError(
        f"machine `{machine}` is neither a file nor in the library{did_you_mean(machine, names)}; "
        f"a file is looked for in {folder.resolve()}"
    )
