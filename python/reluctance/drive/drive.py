"""A drive: machine, converter, load, reference, control law and sensors, checked together."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from reluctance.base.errors import ParameterError
from reluctance.base.schema import Section, check_places, checked, did_you_mean
from reluctance.drive.all_tables import OPTIONAL, TABLES, Tables
from reluctance.drive.checks import check_together, check_torque_in_reach
from reluctance.drive.laws import LAWS, table_of
from reluctance.drive.laws.own_code import names_code
from reluctance.drive.overrides import plain, put
from reluctance.drive.plausible import check_plausible
from reluctance.drive.tables.control import Control
from reluctance.drive.write import write_drive
from reluctance.machine.library import machine_from, model_class
from reluctance.machine.machine_file import MachineFile
from reluctance.machine.models import MODELS


class Drive(Tables):
    """A drive, checked as a drive file is: each table by itself, and all of them together.

    Parameters
    ----------
    machine : MachineFile, str or Path
        The machine, its name in the library, or the path of a machine file.
    converter, load, reference, control : Converter, Load, Reference, Control
        A control law is a table too, as `EdgeMpc(T_s_us=20)`.
    source, sensing, simulation, protection, mismatch, pv_control, supervision, faults : optional
        Likewise. What is left out has its defaults.
    name : str
        For titles and files.
    check_torque : bool
        False leaves out whether the torque reference is in reach, for a caller that asks for
        another torque.

    Raises
    ------
    ParameterError
        With one line that says what is wrong and what is needed.

    Examples
    --------
    >>> import reluctance as rl
    >>> drive = rl.Drive(
    ...     machine="paper_6_4",
    ...     converter=rl.Converter(u_dc_V=240),
    ...     load=rl.Load(kind="locked", speed_rpm=500),
    ...     reference=rl.Reference(kind="torque", tau_Nm=30),
    ...     control=rl.EdgeMpc(T_s_us=20),
    ... )
    >>> float(drive.machine.psi(i=50.0, theta_e=3.14159)) > 0.3
    True
    """

    def __post_init__(self, check_torque: bool) -> None:
        self._check_kinds()
        check_together(self)
        check_plausible(self)
        if check_torque and self.reference.kind != "none":
            check_torque_in_reach(self)

    def _check_kinds(self) -> None:
        kinds: dict[str, type[Section]] = {**TABLES, "machine": MachineFile, "control": Control}
        for table, kind in kinds.items():
            if not isinstance(given := getattr(self, table), kind):
                raise ParameterError(f"Drive: {table} = {given!r}, need a {kind.__name__}")

    def with_values(self, values: Mapping[str, Any]) -> Drive:
        """This drive with other values, checked exactly like `--set`.

        Parameters
        ----------
        values : mapping
            `section.key` to its value; None removes the key. `control.law` changes the law: keys
            that the new one does not have go with the old one. `machine` takes a name from the
            library or a path.

        Raises
        ------
        ParameterError
            With one line that says what is wrong and what is needed.

        Examples
        --------
        >>> import reluctance as rl
        >>> drive = rl.load("examples/paper_rated.toml")
        >>> drive.with_values({"converter.u_dc_V": 300, "control.i_band_A": 0.5}).converter.u_dc_V
        300.0
        """
        if not isinstance(values, Mapping):
            raise ParameterError(
                f"with_values takes a dict as in {{'converter.u_dc_V': 300}}, not {values!r}"
            )
        for name in values:
            if not isinstance(name, str):
                raise ParameterError(f"with_values: {name!r} is not a `section.key`")
        kept = self.sections()
        data = {
            key: kept.pop(key).given
            for key in {name.partition(".")[0] for name in values}
            if key in kept
        }
        for name, value in values.items():
            put(data, name, plain(value), f"with_values {name} = {value!r}")
        return drive_from(data, name=self.name, kept=kept)

    @property
    def by_rule(self) -> dict[str, float]:
        """Keys of [control] that are left to a rule, and the values used for them, in the units of
        the keys. Angles are those for the greatest torque at the working speed; `angles` and `ditc`
        move them with the torque where no angle is given."""
        return self.control.by_rule(self.known())

    def computed(self, **tables: Section) -> Drive:
        """A copy with tables that were computed from checked ones, and are not checked again."""
        copy = object.__new__(Drive)
        vars(copy).update(vars(self) | tables)
        return copy

    def save(self, path: str | Path, *, comment: str = "") -> None:
        """Writes a file that `load` reads as the same drive. Files that lie with it or below are
        named from there, so that the folder can be moved; others by their absolute paths.

        Raises
        ------
        ParameterError
            If the ending is not .toml or the disk does not take it.
        """
        write_drive(self, path, comment=comment)


def drive_from(
    data: dict[str, Any],
    *,
    name: str = "drive",
    check_torque: bool = True,
    kept: Mapping[str, Section] | None = None,
) -> Drive:
    """A drive from the tables of a drive file; `machine` must be a table here. `kept` has those
    that have been checked before."""
    kept = kept or {}
    for key in data:
        if key not in (known := [*TABLES, "machine", "control"]):
            raise ParameterError(f"unknown table `{key}`{did_you_mean(key, known)}")
    for key in ("machine", "control", *TABLES):
        if key not in data and key not in kept and key not in OPTIONAL:
            raise ParameterError(f"missing table [{key}]")
    apart = ("machine", "faults")  # another file; a list of tables
    own = {key: table for key, table in data.items() if key not in apart}
    check_places(own, _kinds(data))
    sections: dict[str, Any] = {
        key: kept.get(key) or section.read(data.get(key, {}), f"[{key}]")
        for key, section in TABLES.items()
    }
    sections["machine"] = kept.get("machine") or machine_from(data["machine"])
    sections["control"] = kept.get("control") or _control(data["control"])
    return Drive(name=name, check_torque=check_torque, **sections)


def _kinds(data: Mapping[str, Any]) -> dict[str, type[Section]]:
    """The tables that a drive file may have; without a law or a model that nobody knows, which is
    told later."""
    kinds: dict[str, type[Section]] = dict(TABLES)
    law, model = (_value(data, *key) for key in (("control", "law"), ("machine", "model")))
    if law in LAWS or names_code(law):
        kinds["control"] = table_of(law)
    if model in MODELS:
        kinds["machine"] = model_class(model).filed()
    return kinds


def _value(data: Mapping[str, Any], table: str, key: str) -> Any:
    """Of a key that is text, where a table has it."""
    given = data.get(table)
    value = given.get(key) if isinstance(given, dict) else None
    return value if isinstance(value, str) else None


def _control(table: object) -> Control:
    law = table.get("law") if isinstance(table, dict) else None
    return checked(table_of(law), table, "[control]")


def check_drive(drive: object, function: str) -> None:
    """Raises ParameterError where a function of the public surface is given something else."""
    if not isinstance(drive, Drive):
        raise ParameterError(
            f"{function} takes a Drive, not {drive!r}; make one with reluctance.load(path)"
        )
