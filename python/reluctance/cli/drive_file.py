"""The drive that a command is about: of a drive file, or of a pumping system on its array."""

from pathlib import Path

from reluctance.base.files import read_toml
from reluctance.drive.drive import Drive
from reluctance.drive.load import is_system, load
from reluctance.drive.overrides import parsed


def load_drive(path: Path, overrides: list[str] | None = None, *, trust: bool = False) -> Drive:
    """A drive from either file. `--set` of a system reaches its own tables and those of its drive.

    Raises
    ------
    ParameterError
        With one line that says what is wrong and what is needed.
    """
    if not is_system(read_toml(path)):
        return load(path, overrides, trust=trust)
    from reluctance.pumping import drive_of, load_system  # pandas and pvlib: a second
    from reluctance.pumping.system import TABLES

    own: list[str] = []
    others: list[str] = []
    for text in overrides or []:
        name = text.partition("=")[0].strip()
        of_system = name.partition(".")[0] in {*TABLES, "drive", "pump"}
        (own if of_system else others).append(text)
    drive = drive_of(load_system(path, own))
    return drive.with_values(dict(parsed(text) for text in others)) if others else drive
