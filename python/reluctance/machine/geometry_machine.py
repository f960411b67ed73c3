"""A machine by its geometry: a geometry file in the place of a machine file."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Self, cast

from pydantic import Field

from reluctance import _core
from reluctance.base.files import is_file
from reluctance.base.schema import Section, checked
from reluctance.machine.machine_file import MachineFile

if TYPE_CHECKING:
    from reluctance.machine.coupling import Coupling
    from reluctance.machine.geometry.solved import Solution
    from reluctance.machine.maps.pole_force import PoleForce


class GeometryMachine(MachineFile):
    """What follows from a geometry: the keys of every machine, and the solved field."""

    model: Literal["geometry"]
    geometry: Section
    psi_factor: float = Field(1.0, gt=0)  # on the solved flux linkage, as a control knows it

    @property
    def given(self) -> dict[str, Any]:
        """The tables of the geometry, from which this machine is computed again."""
        return {"model": "geometry", **self.geometry.given}

    @property
    def filed(self) -> Section:
        return self.geometry

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A copy with other keys of the geometry file, solved where that needs it."""
        if not update:
            return super().model_copy(deep=deep)
        return cast(Self, geometry_machine({**self.given, **update}, self.where()))

    @property
    def solution(self) -> Solution:
        """Flux linkage, torque, forces, masses."""
        return _solution(*self._key)

    @property
    def coupling(self) -> Coupling | None:
        """What neighbouring phases add to each other; None with [map] coupling = "none"."""
        return _coupling(*self._key)

    @property
    def coupled(self) -> bool:
        return bool(self.geometry.given["map"].get("coupling", "none") == "pairs")

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
    def files(self) -> list[Path]:
        steel = Path(self.geometry.given["lamination"]["steel"])  # or a grade of the library
        return [steel] if is_file(steel) else []

    @property
    def i_known_A(self) -> float:
        return float(self.solution.i[-1])


def flattened(data: dict[str, Any]) -> dict[str, Any]:
    """The tables of a geometry file as one [machine] table, as a drive holds it."""
    head = data.get("machine")
    rest = {key: value for key, value in data.items() if key != "machine"}
    return {**(head if isinstance(head, dict) else {}), **rest, "model": "geometry"}


def is_geometry(data: dict[str, Any]) -> bool:
    """Whether these are the tables of a geometry file."""
    return "stator" in data or "lamination" in data or "air_gap" in data


def geometry_machine(table: dict[str, Any], where: str) -> GeometryMachine:
    """The machine of a [machine] table with model = "geometry": checked, and solved if it has not
    been before.

    Raises
    ------
    ParameterError
        With one line: a key, a value out of range, parts that do not fit, a B-H curve that is none.
    """
    from reluctance.machine.geometry.file import Geometry

    geometry = checked(Geometry, {k: v for k, v in table.items() if k != "model"}, where)
    solution = _solution(*_key(geometry))
    temperature = geometry.winding.temperature_degC
    run_at = geometry.temp_w_degC
    poles = f"{geometry.stator_poles}/{geometry.rotor_poles}, {geometry.phases} phases"
    values = dict(
        model="geometry",
        geometry=geometry,
        name=geometry.name or f"{poles}, from its geometry",
        source=geometry.source,
        licence=geometry.licence,
        assumed=geometry.assumed,
        N_s=geometry.stator_poles,
        N_r=geometry.rotor_poles,
        n_phases=geometry.phases,
        R_ohm=solution.R_ohm if geometry.R_ohm is None else geometry.R_ohm,
        temp_R_degC=temperature,
        temp_w_degC=temperature if run_at is None else run_at,
        i_max_A=geometry.map.current_max_A if geometry.i_max_A is None else geometry.i_max_A,
        J_kgm2=solution.J_kgm2 if geometry.J_kgm2 is None else geometry.J_kgm2,
        B_Nms=geometry.B_Nms,
    )
    return checked(GeometryMachine, values, where)


def with_steel_path(table: dict[str, Any], folder: Path) -> dict[str, Any]:
    """The table with the path of its B-H file seen from here instead of from its folder."""
    lamination = table.get("lamination")
    if not isinstance(lamination, dict) or not isinstance(lamination.get("steel"), str):
        return table
    if not Path(lamination["steel"]).suffix:  # a grade of the library
        return table
    return {**table, "lamination": {**lamination, "steel": str(folder / lamination["steel"])}}


def _key(geometry: Section) -> tuple[str, bytes]:
    """The geometry, and a digest of its B-H file."""
    file = Path(geometry.given["lamination"]["steel"])
    steel = hashlib.sha256(file.read_bytes()).digest() if is_file(file) else b""
    return geometry.model_dump_json(), steel


@lru_cache(maxsize=32)
def _solution(geometry: str, steel: bytes) -> Solution:
    from reluctance.machine.geometry.file import Geometry
    from reluctance.machine.geometry.solved import solved

    return solved(Geometry.model_validate_json(geometry))


@lru_cache(maxsize=32)
def _magnetics(geometry: str, steel: bytes, N_r: int, psi_factor: float) -> _core.FluxMap:
    from reluctance.machine.maps.surface import surface

    return surface(_solution(geometry, steel).table(N_r).times(psi_factor))


@lru_cache(maxsize=32)
def _coupling(geometry: str, steel: bytes) -> Coupling | None:
    from reluctance.machine.geometry.file import Geometry
    from reluctance.machine.geometry_coupling import coupling_of

    checked_file = Geometry.model_validate_json(geometry)
    return coupling_of(checked_file) if checked_file.map.coupling == "pairs" else None
