"""`reluctance examples`: the drive files that come with the package."""

import shutil
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from reluctance.drive.schema import did_you_mean
from reluctance.errors import ParameterError
from reluctance.files import make_folder, write_together
from reluctance.resources import resources


def example_files() -> dict[str, Path]:
    """The examples by their names."""
    return {path.stem: path for path in sorted(resources("examples").glob("*.toml"))}


def _names() -> list[str]:
    return list(example_files())


def examples(
    name: Annotated[
        str | None,
        typer.Argument(metavar="[NAME]", help="Print this one.", autocompletion=_names),
    ] = None,
    copy: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Copy it, or all of them, into this folder."),
    ] = None,
) -> None:
    """List the example drive files, print one, or copy them."""
    known = example_files()
    if name is not None and name.removesuffix(".toml") not in known:
        raise ParameterError(f"example `{name}` is unknown{did_you_mean(name, known)}")
    chosen = known if name is None else {name: known[name.removesuffix(".toml")]}
    if copy is not None:
        for path in copied(list(chosen.values()), copy):
            print(path)
    elif name is not None:
        print(chosen[name].read_text(encoding="utf-8"), end="")
    else:
        width = max(map(len, known))
        for key, path in known.items():
            print(f"{key:{width}}  {first_comment(path)}")
        print("next: reluctance examples NAME --copy . && reluctance run NAME.toml")


def copied(paths: list[Path], folder: Path) -> list[Path]:
    """Copies of files in a folder, all or none; nothing is overwritten.

    Raises
    ------
    ParameterError
        If one is there already, or the folder cannot be written to.
    """
    targets = {make_folder(folder) / path.name: path for path in paths}
    for target in targets:
        if target.exists():
            raise ParameterError(f"{target} exists; remove it, or copy to another folder")
    write_together({target: partial(_copy, path) for target, path in targets.items()})
    return list(targets)


def _copy(path: Path, target: Path) -> None:
    shutil.copyfile(path, target)


def first_comment(path: Path) -> str:
    """What the first line of a TOML file says."""
    with path.open(encoding="utf-8") as file:
        return file.readline().lstrip("# ").rstrip()
