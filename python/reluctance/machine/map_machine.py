"""A machine by its flux map: `model = "map"` in a machine file."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field, model_validator

from reluctance import _core
from reluctance.base.files import is_file
from reluctance.base.reading import reading
from reluctance.base.schema import FileName
from reluctance.machine.flux_map_machine import FluxMapMachine

if TYPE_CHECKING:
    from reluctance.machine.coupling import Coupling
    from reluctance.machine.maps import FluxTable, MapReport, Surface
    from reluctance.machine.maps.pole_force import PoleForce

CONVENTIONS = ("angle_unit", "angle_kind", "zero", "layout", "aligned_at")


class MapMachine(FluxMapMachine):
    """Flux linkage, and torque where given, over current and angle, in a file beside this one."""

    model: Literal["map"]
    map: FileName  # path from the machine file: .csv, .mat or .json
    torque_map: FileName | None = None  # a second grid with the torque, on the same axes
    pairs: FileName | None = None  # what neighbouring phases add to each other: .csv
    force_map: FileName | None = None  # radial force on a stator pole of one phase: .csv
    angle_unit: Literal["deg", "rad"] | None = None  # what the map file does not say itself
    angle_kind: Literal["mechanical", "electrical"] | None = None
    zero: Literal["unaligned", "aligned"] | None = None
    layout: Literal["currents_down", "angles_down"] | None = None
    aligned_at: float | None = None  # the file's angle of alignment, in its unit; instead of zero
    names: dict[str, str] = Field(default_factory=dict)  # psi, i, theta, tau: names in the file
    symmetric: bool = True  # even about unaligned and aligned
    psi_factor: float = Field(1.0, gt=0)  # on the flux linkage of the file, as for end effects
    accepted_because: str = ""  # why a map that the judge refuses is used all the same

    @model_validator(mode="after")
    def judge_agrees(self) -> MapMachine:
        report = self.report
        if report.verdict != "good" and not self.accepted_because.strip():
            raise ValueError(
                f"map {Path(self.map).name} is refused: {'; '.join(report.reasons)}. Or say why "
                'it will do: accepted_because = "..."'
            )
        return self

    @property
    def table(self) -> FluxTable:
        """The table in the project's convention."""
        return _table(*self._key)

    @property
    def report(self) -> MapReport:
        """What the judge says of the table, with the drive's current limit."""
        from reluctance.machine.maps import check_map

        return check_map(self.table, i_max=self.i_max_A)

    def __hash__(self) -> int:  # laws keep tables for what they know; `names` has no hash
        return hash(self.model_dump_json())

    @property
    def surface(self) -> Surface:
        """The co-energy spline through the table."""
        return _surface(self._key, self.symmetric)

    @property
    def magnetics(self) -> _core.FluxMap:
        return self.surface.machine

    @property
    def coupling(self) -> Coupling | None:
        """What neighbouring phases add to each other; None where the file names no `pairs`."""
        if self.pairs is None:
            return None
        coupling = _coupling(self.pairs, _digest(self.pairs), self.N_r, self.n_phases)
        return coupling.times(self.psi_factor * self.pair_factor)

    @property
    def coupled(self) -> bool:
        return self.pairs is not None

    @property
    def pole_force(self) -> PoleForce | None:
        if self.force_map is None:
            return None
        return _force(self.force_map, _digest(self.force_map))

    @model_validator(mode="after")
    def force_map_is_one(self) -> MapMachine:
        _ = self.pole_force
        return self

    @model_validator(mode="after")
    def pairs_are_of_this_machine(self) -> MapMachine:
        if self.coupling is not None:
            from reluctance.machine.coupling import check_pairs

            check_pairs(self.coupling, self.magnetics, self.i_max_A)
        return self

    @property
    def i_known_A(self) -> float:
        return float(self.table.i[-1])

    @property
    def _key(self) -> tuple[Any, ...]:
        """All that the table depends on, the content of its files included."""
        stated = tuple(getattr(self, name) for name in CONVENTIONS)
        names = tuple(sorted(self.names.items()))
        contents = (
            _digest(self.map),
            None if self.torque_map is None else _digest(self.torque_map),
        )
        return (self.map, self.torque_map, self.N_r, stated, names, self.psi_factor, contents)


def _digest(path: str) -> bytes:
    """Of the content; of nothing where there is no file: reading it will say so."""
    file = Path(path)
    if not is_file(file):
        return b""
    with reading(file, "a flux map"):
        now = file.stat()
        return _digest_of(path, now.st_ino, now.st_mtime_ns, now.st_size)


@lru_cache(maxsize=64)
def _digest_of(path: str, inode: int, mtime_ns: int, size: int) -> bytes:
    """Read again when the file is another one, or has changed."""
    return hashlib.sha256(Path(path).read_bytes()).digest()


@lru_cache(maxsize=32)
def _table(
    path: str,
    torque: str | None,
    N_r: int,
    stated: tuple[Any, ...],
    names: tuple[tuple[str, str], ...],
    psi_factor: float,
    contents: tuple[bytes, bytes | None],
) -> FluxTable:
    from reluctance.machine.maps import read_map  # here, because it brings SciPy along

    conventions = dict(zip(CONVENTIONS, stated, strict=True))
    table = read_map(path, N_r=N_r, torque=torque, names=dict(names), **conventions)
    return table.times(psi_factor)


@lru_cache(maxsize=32)
def _surface(key: tuple[Any, ...], symmetric: bool) -> Surface:
    from reluctance.machine.maps import fit_surface

    return fit_surface(_table(*key), symmetric=symmetric)


@lru_cache(maxsize=32)
def _force(path: str, content: bytes) -> PoleForce:
    from reluctance.machine.maps.pole_force import read_pole_force

    return read_pole_force(Path(path))


@lru_cache(maxsize=32)
def _coupling(path: str, content: bytes, N_r: int, n_phases: int) -> Coupling:
    from reluctance.machine.pair_file import read_pairs

    return read_pairs(Path(path), N_r=N_r, n_phases=n_phases)
