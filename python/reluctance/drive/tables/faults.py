"""The [[faults]] of a drive file: what breaks in the plant, and when. The control is not told."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable
from typing import Any, Literal, Self

from pydantic import Field, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.base.phases import LETTERS
from reluctance.base.schema import Section, checked, did_you_mean
from reluctance.base.units import to_si
from reluctance.drive.tables.source import Source

# The keys that each kind needs, besides its phase and its time. What they do to the plant is in
# include/srm/plant/faults.hpp; dc_sag is a course of the source.
NEEDS: dict[str, tuple[str, ...]] = {
    "open_wire": (),
    "upper_open": (),
    "lower_open": (),
    "upper_shorted": (),
    "lower_shorted": (),
    "diode_shorted": ("R_ohm",),
    "turns_shorted": ("part", "R_ohm"),
    "winding_to_ground": ("R_ohm",),
    "poor_contact": ("R_ohm",),
    "sensor_gain": ("gain",),
    "sensor_offset": ("offset_A",),
    "sensor_stuck": (),
    "sensor_dead": (),
    "encoder_off": ("angle_deg",),
    "encoder_frozen": (),
    "encoder_lost_counts": ("part",),
    "encoder_reversed": (),
    "power_exchanged": ("other",),
    "sensors_exchanged": ("other",),
    "dc_sag": ("part",),
}
OF_THE_POWER_STAGE = list(NEEDS)[: list(NEEDS).index("sensor_gain")]
POINTS = tuple[list[float], list[float]]


class Fault(Section):
    """One fault. It is present from `t_s` on, or from where its phase next passes `theta_e_deg`."""

    kind: str = Field(json_schema_extra={"enum": [*NEEDS]})
    phase: Literal["a", "b", "c", "d", "e", "f"] = "a"
    other: Literal["a", "b", "c", "d", "e", "f"] | None = None  # that is exchanged with `phase`
    t_s: float = Field(0.0, ge=0)
    theta_e_deg: float | None = Field(None, ge=0, lt=360)  # electrical, of the phase
    end_s: float | None = Field(None, gt=0)  # its cause is gone; by default it stays
    part: float | None = Field(None, gt=0, lt=1)  # of turns, of counts, of the voltage that is left
    R_ohm: float | None = Field(None, gt=0)  # of what conducts and should not, or of a contact
    gain: float | None = Field(None, gt=0)  # shown over true
    offset_A: float | None = None  # shown less true
    angle_deg: float | None = Field(None, ge=-180, le=180)  # electrical, shown less true

    @model_validator(mode="after")
    def keys_belong_to_the_kind(self) -> Fault:
        if self.kind not in NEEDS:
            raise ValueError(f"kind = {self.kind!r}: no such fault{did_you_mean(self.kind, NEEDS)}")
        always = {"kind", "phase", "t_s", "theta_e_deg", "end_s"}
        for key in NEEDS[self.kind]:
            if getattr(self, key) is None:
                raise ValueError(f"kind = {self.kind!r} needs {key}")
        for key in sorted(self.model_fields_set - always - set(NEEDS[self.kind])):
            raise ValueError(f"{key} has no effect with kind = {self.kind!r}; remove it")
        if self.end_s is not None and self.end_s <= self.t_s:
            raise ValueError(f"end_s = {self.end_s:g}, need more than t_s = {self.t_s:g}")
        if self.other == self.phase:
            raise ValueError(f"other = {self.other!r}, need another one than phase")
        if self.kind == "dc_sag" and self.theta_e_deg is not None:
            raise ValueError("theta_e_deg has no effect with kind = 'dc_sag'; set t_s")
        return self

    def __str__(self) -> str:
        of_phase = not self.kind.startswith(("encoder", "dc"))
        phases = f", phase {self.phase}" + (f" and {self.other}" if self.other else "")
        return self.kind + (phases if of_phase else "")

    def core(self, N_r: int) -> _core.BrokenPart:
        angle = None if self.angle_deg is None else to_si(self.angle_deg, "deg") / N_r
        values = (self.part, self.gain, self.offset_A, angle)
        return _core.BrokenPart(
            kind=getattr(_core.Broken, self.kind),
            phase=LETTERS.index(self.phase),
            other=LETTERS.index(self.other or self.phase),
            value=next((value for value in values if value is not None), 0.0),
            R=self.R_ohm or 0.0,
            start=self.t_s,
            end=_core.never_ends if self.end_s is None else self.end_s,
            theta_e=-1.0 if self.theta_e_deg is None else to_si(self.theta_e_deg, "deg"),
        )


class Faults(Section):
    """All of them. A file has each as a table [[faults]]; `--set faults.0.t_s` is the first one's
    time."""

    each: list[Fault] = Field(default_factory=list)

    @classmethod
    def read(cls, table: object, where: str) -> Self:
        """Of the tables of a file, in their order."""
        if not isinstance(table, list):
            if table == {}:
                return cls()
            raise ParameterError(
                f"{where} is no list of tables; write [{where}] with two brackets above the keys "
                "of each fault"
            )
        place = where.removesuffix("]")
        return cls(
            each=[
                one if isinstance(one, Fault) else checked(Fault, one, f"{place}.{n}]")
                for n, one in enumerate(table)
            ]
        )

    @classmethod
    def __get_pydantic_json_schema__(
        cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """In a file they are an array."""
        array: JsonSchemaValue = handler.resolve_ref_schema(handler(core_schema))["properties"]
        return dict(array["each"])

    @property
    def given(self) -> Any:
        return [fault.given for fault in self.each]

    def core(self, N_r: int) -> list[_core.BrokenPart]:
        """Those of the core's list; N_r: rotor poles."""
        return [fault.core(N_r) for fault in self.each if fault.kind != "dc_sag"]

    def begun(self, found: Iterable[float], until: float) -> list[tuple[float, Fault]]:
        """Those that have begun until then, and when [s]. found: the same of the core's list."""
        of_core = iter(found)
        times = [f.t_s if f.kind == "dc_sag" else next(of_core) for f in self.each]
        return [(t, f) for t, f in zip(times, self.each, strict=True) if t <= until]

    def sagged(self, source: Source, u_dc: float) -> Source:
        """The source with the sags of its voltage; u_dc: the nominal one [V]."""
        points = source.points(u_dc)
        for fault in self.each:
            if fault.kind == "dc_sag" and fault.part is not None:
                points = _lowered(points, fault.t_s, fault.end_s, fault.part)
        if points == source.points(u_dc):
            return source
        return source.computed(t_s=points[0], values=points[1])


def _lowered(points: POINTS, start: float, end: float | None, part: float) -> POINTS:
    """A course that is multiplied by `part` between two times."""
    t, values, first = _with_step(points, start)
    last = len(t)
    if end is not None:
        t, values, last = _with_step((t, values), end)
    return t, [part * v if first <= j < last else v for j, v in enumerate(values)]


def _with_step(points: POINTS, at: float) -> tuple[list[float], list[float], int]:
    """The same course with two points more at a time, and the index of the second."""
    t, values = points
    j = bisect_right(t, at)
    if j in (0, len(t)):
        value = values[0] if j == 0 else values[-1]
    else:
        value = values[j - 1] + (values[j] - values[j - 1]) * (at - t[j - 1]) / (t[j] - t[j - 1])
    return [*t[:j], at, at, *t[j:]], [*values[:j], value, value, *values[j:]], j + 1
