"""The drive that a command is about: of a drive file, or of a pumping system on its array."""

from pathlib import Path

from reluctance.base.errors import named
from reluctance.base.toml_file import read_toml
from reluctance.drive.drive import Drive
from reluctance.drive.load import drive_of_file, is_system
from reluctance.drive.overrides import parsed


def load_drive(path: Path, overrides: list[str] | None = None, *, trust: bool = False) -> Drive:
    """A drive from either file. `--set` of a system reaches its own tables and those of its drive.

    Raises
    ------
    ParameterError
        With one line that says what is wrong and what is needed.
    """
    data = read_toml(path)
    if not is_system(data):
        return drive_of_file(path, data, overrides, trust=trust)
    from reluctance.pumping import drive_of  # pandas and pvlib: a second
    from reluctance.pumping.system import TABLES, system_of_file

    own: list[str] = []
    others: list[str] = []
    for text in overrides or []:
        name = text.partition("=")[0].strip()
        of_system = name.partition(".")[0] in {*TABLES, "drive", "pump"}
        (own if of_system else others).append(text)
    with named(path):
        drive = drive_of(system_of_file(path, data, own))
    return drive.with_values(dict(parsed(text) for text in others)) if others else drive
