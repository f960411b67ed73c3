"""Drive files: from TOML to a checked Drive, or to one line that says what is wrong."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from reluctance.base.errors import ParameterError, one_line
from reluctance.base.files import is_file
from reluctance.base.reading import reading
from reluctance.base.schema import Section, placed
from reluctance.base.toml_file import read_toml
from reluctance.drive.all_tables import TABLES
from reluctance.drive.course import read_course
from reluctance.drive.drive import Drive, drive_from
from reluctance.drive.laws import LAWS, table_of
from reluctance.drive.laws.own_code import names_code, refuse_untrusted
from reluctance.drive.overrides import law_of, parsed, put
from reluctance.machine.library import is_geometry, machine_table, placed_machine


def load(
    path: str | Path,
    overrides: list[str] | None = None,
    *,
    trust: bool = False,
    check_torque: bool = True,
) -> Drive:
    """A drive from a TOML file.

    Parameters
    ----------
    path : str or Path
        The drive file. Its `machine` is a name from the machine library, a path to a machine file
        relative to the drive file, or a table.
    overrides : list of str, optional
        `section.key=value` with the value as in TOML; bare words are text; no value removes the
        key. `machine=...` takes a name from the library or a path.
    trust : bool
        Run the code that the file names: a law in Python (`law = "python:FILE:CLASS"`) or a
        compiled one (`law = "cpp:FILE:STRUCT"`). A drive file of unknown origin is data, and stays
        data without it.
    check_torque : bool
        False leaves out whether the torque reference is in reach, for a caller that asks for
        another torque.

    Raises
    ------
    ParameterError
        With one line that says what is wrong and what is needed.
    """
    if not isinstance(path, str | Path):
        raise ParameterError(f"load takes the path of a drive file, not {path!r}")
    if isinstance(overrides, str) or not isinstance(overrides or [], Sequence):
        raise ParameterError(
            f"overrides = {overrides!r}, need a list of texts as in [{str(overrides)!r}]"
        )
    path = Path(path)
    data = read_toml(path)
    return drive_of_file(path, data, overrides, trust=trust, check_torque=check_torque)


def drive_of_file(
    path: Path,
    data: dict[str, Any],
    overrides: Sequence[str] | None = None,
    *,
    trust: bool = False,
    check_torque: bool = True,
) -> Drive:
    """A drive from the content of its file, which is changed. Otherwise as `load`."""
    if is_system(data):
        raise ParameterError(
            f"{path} is a pumping system, not a drive file; `reluctance pump {path} --write-drive "
            "drive.toml` makes one of it, as reluctance.pumping.drive_of does in Python"
        )
    with reading(path, "a drive file"):
        if isinstance(data.get("machine"), str):
            data["machine"] = machine_table(data["machine"], path.parent)
        elif isinstance(data.get("machine"), dict):
            data["machine"] = placed_machine(data["machine"], path.parent)
        if "control" not in data and (is_geometry(data) or set(data) == {"machine"}):
            kind = "geometry" if is_geometry(data) else "machine file"
            raise ParameterError(
                f"{path} is a {kind}, not a drive file; name it in one, "
                f'machine = "{path.name}", or pass --set machine={path}'
            )
        _placed(data, path.parent)
        refuse_untrusted([law_of(data)], trust)
        for text in overrides or []:
            name, value = parsed(text)
            put(data, name, value, f"--set {text}")
            refuse_untrusted([law_of(data)], trust)
        _settle_courses(data, path.parent)
        return drive_from(data, name=one_line(path.stem), check_torque=check_torque)


def is_system(data: Mapping[str, Any]) -> bool:
    """Whether the tables of a file are those of a pumping system."""
    return "drive" in data and "site" in data


def _placed(data: dict[str, Any], folder: Path) -> None:
    """The files that the tables name, seen from here instead of from the drive file."""
    law = law_of(data)
    kinds: dict[str, type[Section]] = dict(TABLES)
    if names_code(law) or law in LAWS:
        kinds["control"] = table_of(law)
    for name, kind in kinds.items():
        if isinstance(data.get(name), dict):
            data[name] = placed(kind, data[name], folder)


COURSES = (
    ("reference", "tau_Nm"),
    ("reference", "speed_rpm"),
    ("load", "tau_Nm"),
    ("load", "speed_rpm"),
    ("load", "H_static_m"),
)


def _settle_courses(data: dict[str, Any], folder: Path) -> None:
    """A constant that names a file becomes the course over time in it: columns t_s and the
    key, or two columns without names."""
    for section, key in COURSES:
        table = data.get(section)
        file = table.get(key) if isinstance(table, dict) else None
        if not isinstance(table, dict) or not isinstance(file, str):
            continue
        path = folder / file if is_file(folder / file) else Path(file)
        if file.lower().endswith((".csv", ".xlsx")) or is_file(path):
            if beside := [name for name in ("t_s", "values") if name in table]:
                undone = " ".join(f"--set {section}.{name}=" for name in beside)
                raise ParameterError(
                    f"[{section}] {key} = {file!r} is a course over time, and so is "
                    f"{' and '.join(beside)}; remove one of them ({undone})"
                )
            del table[key]
            table["t_s"], table["values"] = read_course(path, key)
