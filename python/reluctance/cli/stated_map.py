"""What a user says of the file of a flux map: the options of all `map` commands, and reading it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import wraps
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from reluctance.base.errors import ParameterError
from reluctance.base.files import is_file
from reluctance.machine.library import machine_table
from reluctance.machine.map_machine import CONVENTIONS

if TYPE_CHECKING:
    from reluctance.machine.maps import FluxTable

RotorPoles = Annotated[
    int | None, typer.Option("--N_r", metavar="POLES", help="Rotor poles, unless the file says.")
]
AngleUnit = Annotated[
    str | None,
    typer.Option("--angle_unit", "--angle-unit", metavar="deg|rad", help="Of the file's angles."),
]
AngleKind = Annotated[
    str | None,
    typer.Option(
        "--angle_kind",
        "--angle-kind",
        metavar="mechanical|electrical",
        help="Of the file's angles.",
    ),
]
Zero = Annotated[
    str | None, typer.Option(metavar="unaligned|aligned", help="Where the file's zero angle is.")
]
AlignedAt = Annotated[
    float | None,
    typer.Option(
        "--aligned_at",
        "--aligned-at",
        metavar="ANGLE",
        help="The file's angle at which the poles are aligned, in its unit; instead of --zero.",
    ),
]
Factor = Annotated[
    float,
    typer.Option(
        "--turns_factor",
        "--turns-factor",
        metavar="FACTOR",
        help="On the flux linkage alone: turns or coils in series that the file leaves out.",
    ),
]
Layout = Annotated[
    str | None,
    typer.Option(metavar="currents_down|angles_down", help="What runs down the rows of a grid."),
]
Name = Annotated[
    list[str] | None,
    typer.Option("--name", metavar="QUANTITY=NAME", help="psi, i, theta or tau in the file."),
]

MaxCurrent = Annotated[
    float | None, typer.Option("--i_max_A", metavar="AMPERE", help="Current limit of the drive.")
]


@dataclass(frozen=True)
class Stated:
    """What the user says of a map file."""

    N_r: int | None = None
    angle_unit: str | None = None
    angle_kind: str | None = None
    zero: str | None = None
    layout: str | None = None
    aligned_at: float | None = None
    name: tuple[str, ...] = ()
    torque: Path | None = None
    turns_factor: float = 1.0
    i_max_A: float | None = None
    accepted: bool = False


def _stated(
    poles: RotorPoles = None,
    angle_unit: AngleUnit = None,
    angle_kind: AngleKind = None,
    zero: Zero = None,
    layout: Layout = None,
    aligned_at: AlignedAt = None,
    name: Name = None,
    turns_factor: Factor = 1.0,
) -> Stated:
    """The options that every command on a map file has."""
    return Stated(
        N_r=poles,
        angle_unit=angle_unit,
        angle_kind=angle_kind,
        zero=zero,
        layout=layout,
        aligned_at=aligned_at,
        name=tuple(name or ()),
        turns_factor=turns_factor,
    )


def takes_stated(command: Callable[..., None]) -> Callable[..., None]:
    """The command with the options of `_stated` in the place of its parameter `stated`."""
    shared = signature(_stated).parameters
    own = signature(command).parameters

    @wraps(command)
    def run(**given: Any) -> None:
        stated = _stated(**{name: given.pop(name) for name in shared})
        command(**given, stated=stated)

    parameters = [
        option
        for name, parameter in own.items()
        for option in (shared.values() if name == "stated" else (parameter,))
    ]
    keyword = [p.replace(kind=Parameter.KEYWORD_ONLY) for p in parameters]
    run.__signature__ = Signature(keyword)  # type: ignore[attr-defined]
    run.__annotations__ = {p.name: p.annotation for p in keyword}
    return run


def read(file: Path, stated: Stated) -> "tuple[FluxTable, Stated]":
    """The table, and what was stated, by the user or by the machine file."""
    from reluctance.machine.maps import read_map

    if file.suffix.lower() == ".toml":
        if stated != Stated():
            raise ParameterError(
                f"{file} is a .toml: the conventions of a machine file stand in it; leave the "
                "options out, or pass the file of the map"
            )
        file, stated = _from_machine_file(file)
    table = read_map(
        file,
        N_r=stated.N_r,
        torque=stated.torque,
        names=_names(stated.name),
        **{key: getattr(stated, key) for key in CONVENTIONS},
    )
    if not 0 < stated.turns_factor < float("inf"):
        raise ParameterError(f"--turns_factor {stated.turns_factor:g}, need > 0")
    return replace(table, psi=stated.turns_factor * table.psi), stated


def _from_machine_file(file: Path) -> tuple[Path, Stated]:
    if not is_file(file):
        raise ParameterError(f"{file}: no such file; check the path")
    machine = machine_table(file.name, file.parent)
    if machine.get("model") != "map" or not isinstance(machine.get("map"), str):
        raise ParameterError(f"{file}: need a machine with model = 'map' and map = 'FILE'")
    known: Mapping[str, Any] = {k: machine.get(k) for k in ("N_r", "i_max_A", *CONVENTIONS)}
    torque = machine.get("torque_map")
    names = tuple(f"{k}={v}" for k, v in machine.get("names", {}).items())
    stated = Stated(
        **known,
        name=names,
        torque=None if torque is None else Path(torque),
        accepted=bool(machine.get("accepted_because")),
    )
    return Path(machine["map"]), stated


def _names(given: tuple[str, ...]) -> dict[str, str]:
    pairs = [text.partition("=") for text in given]
    for quantity, equals, name in pairs:
        if not equals or not name or quantity not in ("psi", "i", "theta", "tau"):
            raise ParameterError(
                f"--name {quantity}{equals}{name}: need psi=NAME, i=NAME, theta=NAME or tau=NAME"
            )
    return {quantity: name for quantity, _, name in pairs}
