"""A machine by its geometry: a geometry file in the place of a machine file."""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Callable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal, Self

from pydantic import Field

from reluctance import _core
from reluctance.base.errors import Note
from reluctance.base.files import is_file
from reluctance.base.schema import Section, check_places, checked, inner_sections
from reluctance.machine.coupling import Coupling
from reluctance.machine.flux_map_machine import FluxMapMachine
from reluctance.machine.geometry.coupling_of import coupling_of
from reluctance.machine.geometry.file import Geometry
from reluctance.machine.geometry.proportions import questions
from reluctance.machine.geometry.solved import Solution, solved
from reluctance.machine.maps.pole_force import PoleForce
from reluctance.machine.maps.surface import surface


class GeometryMachine(FluxMapMachine):
    """What follows from a geometry: the keys of every machine, and the solved field."""

    model: Literal["geometry"]
    geometry: Geometry
    psi_factor: float = Field(1.0, gt=0)  # on the solved flux linkage, as a control knows it

    @classmethod
    def from_table(cls, table: dict[str, Any], where: str) -> Self:
        """Checked, and solved if it has not been before.

        Raises
        ------
        ParameterError
            With one line: a key, a value out of range, parts that do not fit, a B-H curve that is
            none.
        """
        geometry = geometry_of(table, where)
        keys = machine_keys(geometry, _solution(*_key(geometry)))
        return checked(cls, {**keys, "model": "geometry", "geometry": geometry}, where)

    @property
    def given(self) -> dict[str, Any]:
        """The tables of the geometry, from which this machine is computed again."""
        return {"model": "geometry", **self.geometry.given}

    @classmethod
    def filed(cls) -> type[Section]:
        return Geometry

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A copy with other keys of the geometry file, solved where that needs it."""
        if not update:
            return super().model_copy(deep=deep)
        return self.from_table({**self.given, **update}, self.where())

    @property
    def solution(self) -> Solution:
        """Flux linkage, torque, forces, masses."""
        return _solution(*self._key)

    @property
    def coupling(self) -> Coupling | None:
        """What neighbouring phases add to each other; None with [map] coupling = "none"."""
        coupling = _coupling(*self._key, self.N_r, self.i_max_A)
        return None if coupling is None else coupling.times(self.psi_factor * self.pair_factor)

    @property
    def coupled(self) -> bool:
        return self.geometry.map.coupling == "pairs"

    @property
    def pole_force(self) -> PoleForce:
        return self.solution.force_table

    @property
    def _key(self) -> tuple[str, bytes]:
        """All that the solution depends on."""
        return _key(self.geometry)

    @property
    def magnetics(self) -> _core.FluxMap:
        return _magnetics(*self._key, self.N_r, self.psi_factor)

    @property
    def i_known_A(self) -> float:
        return float(self.solution.i[-1])


def geometry_of(table: dict[str, Any], where: str) -> Geometry:
    """The geometry of a [machine] table, checked."""
    check_places(table, inner_sections(Geometry), "machine.")
    geometry = checked(Geometry, {k: v for k, v in table.items() if k != "model"}, where)
    for question in questions(geometry):
        warnings.warn(question, Note, stacklevel=2)
    return geometry


def machine_keys(
    g: Geometry, s: Solution, estimate: Callable[[float], float] = float
) -> dict[str, Any]:
    """What every machine file has. estimate: how a computed number is written."""
    poles = f"{g.stator_poles}/{g.rotor_poles}, {g.phases} phases"
    temperature = g.winding.temperature_degC
    warm = {"temp_R_degC": temperature} if g.R_ohm is None else {}  # a given one: at the default
    return {
        "name": g.name or f"{poles}, from its geometry",
        "source": g.source,
        "licence": g.licence,
        "assumed": g.assumed,
        "N_s": g.stator_poles,
        "N_r": g.rotor_poles,
        "n_phases": g.phases,
        "R_ohm": estimate(s.R_ohm) if g.R_ohm is None else g.R_ohm,
        **warm,
        "temp_w_degC": temperature if g.temp_w_degC is None else g.temp_w_degC,
        "i_max_A": g.map.current_max_A if g.i_max_A is None else g.i_max_A,
        "J_kgm2": estimate(s.J_kgm2) if g.J_kgm2 is None else g.J_kgm2,
        "B_Nms": g.B_Nms,
    }


def _key(geometry: Geometry) -> tuple[str, bytes]:
    """The geometry, and a digest of its B-H file."""
    file = Path(geometry.lamination.steel)
    steel = hashlib.sha256(file.read_bytes()).digest() if is_file(file) else b""
    return geometry.model_dump_json(), steel


@lru_cache(maxsize=32)
def _solution(geometry: str, steel: bytes) -> Solution:
    return solved(Geometry.model_validate_json(geometry))


@lru_cache(maxsize=32)
def _magnetics(geometry: str, steel: bytes, N_r: int, psi_factor: float) -> _core.FluxMap:
    return surface(_solution(geometry, steel).table(N_r).times(psi_factor))


@lru_cache(maxsize=32)
def _coupling(geometry: str, steel: bytes, N_r: int, i_max: float) -> Coupling | None:
    checked_file = Geometry.model_validate_json(geometry)
    if checked_file.map.coupling != "pairs":
        return None
    return coupling_of(checked_file, _magnetics(geometry, steel, N_r, 1.0), i_max)
