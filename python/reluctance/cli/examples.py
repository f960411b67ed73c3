"""`reluctance examples`: the drive files and pumping systems that come with the package."""

import itertools
import shutil
from filecmp import cmp
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from reluctance.base.errors import ParameterError
from reluctance.base.files import make_folder, write_together
from reluctance.base.resources import resources
from reluctance.base.schema import did_you_mean
from reluctance.base.toml_file import read_toml
from reluctance.cli.lines import wrapped
from reluctance.drive.load import is_system


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
        needed = [file for path in chosen.values() for file in with_companions(path)]
        for path in copied(list(dict.fromkeys(needed)), copy):
            print(path)
    elif name is not None:
        print(chosen[name].read_text(encoding="utf-8"), end="")
    else:
        width = max(map(len, known))
        for key, path in known.items():
            print(wrapped(f"{key:{width}}  {first_comment(path)}", indent=" " * (width + 2)))
        systems = [key for key, path in known.items() if is_system(read_toml(path))]
        print("next: reluctance examples NAME --copy . && reluctance run NAME.toml")
        print(f"for a pumping system ({', '.join(systems)}): reluctance pump NAME.toml")


def with_companions(path: Path) -> list[Path]:
    """A file, and the files beside it that it names, such as the drive of a pumping system."""
    found = [path]
    if path.suffix == ".toml":
        for text in _texts(read_toml(path)):
            other = path.parent / text
            if "/" not in text and "." in text and other.is_file() and other != path:
                found += with_companions(other)
    return found


def _texts(value: object) -> list[str]:
    """All texts in the tables of a file."""
    if isinstance(value, dict):
        return [text for part in value.values() for text in _texts(part)]
    return [value] if isinstance(value, str) else []


def copied(paths: list[Path], folder: Path) -> list[Path]:
    """Copies of files in a folder, all or none; nothing is overwritten, and a copy that is there
    already is left as it is.

    Raises
    ------
    ParameterError
        If one is there already, or the folder cannot be written to.
    """
    targets = {make_folder(folder) / path.name: path for path in paths}
    for target, path in targets.items():
        if target.exists() and (path == paths[0] or not cmp(target, path, shallow=False)):
            raise ParameterError(f"{target} exists; remove it, or copy to another folder")
    new = {target: path for target, path in targets.items() if not target.exists()}
    write_together({target: partial(_copy, path) for target, path in new.items()})
    return list(new)


def _copy(path: Path, target: Path) -> None:
    shutil.copyfile(path, target)


def first_comment(path: Path) -> str:
    """The first sentence of the comment that a TOML file opens with."""
    lines = itertools.takewhile(
        lambda line: line.startswith("#"), path.read_text("utf-8").splitlines()
    )
    sentence, stop, _ = " ".join(line.lstrip("# ") for line in lines).partition(". ")
    return sentence + stop.rstrip()
