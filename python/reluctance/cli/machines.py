"""`reluctance machines`: the machine library."""

import json
from typing import Annotated

import typer

from reluctance.base.errors import ParameterError
from reluctance.base.resources import resources
from reluctance.base.schema import did_you_mean
from reluctance.cli.lines import wrapped
from reluctance.cli.options import AsJson
from reluctance.machine import library
from reluctance.machine.library import Entry


def _names() -> list[str]:
    return sorted(path.stem for path in resources("machines").glob("*.toml"))


def machines(
    name: Annotated[
        str | None,
        typer.Argument(metavar="[NAME]", help="Show this one and its file.", autocompletion=_names),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """List the machine library, or show one machine of it."""
    if name is not None and name not in (known := _names()):
        raise ParameterError(f"machine `{name}` is not in the library{did_you_mean(name, known)}")
    found = [entry for entry in library.machines() if name in (None, entry.key)]
    if as_json:
        rows = [entry.with_units() for entry in found]
        print(json.dumps(rows if name is None else rows[0]))
        return
    for entry in found:
        _tell(entry)
    if name is not None:
        print(f"\n{(resources('machines') / f'{name}.toml').read_text(encoding='utf-8')}", end="")


def _tell(entry: Entry) -> None:
    m = entry.machine
    print(f"{entry.key}: {m.name}")
    torque = f"{entry.tau_peak:.3g} N m static from one phase at {m.i_max_A:g} A"
    print(f"  model {m.model}, {torque}")
    for name in ("source", "licence"):
        print(wrapped(f"  {name}: {getattr(m, name)}", indent="    "))
