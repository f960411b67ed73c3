"""A pumping system: from a TOML file to checked tables and a drive."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Literal, TypeVar

import numpy as np
from pydantic import Field, model_validator

import reluctance
from reluctance.base.errors import ParameterError, one_line
from reluctance.base.reading import reading
from reluctance.base.schema import Section, check_places, checked, did_you_mean
from reluctance.base.toml_file import read_toml, toml_value
from reluctance.drive.all_tables import TABLES as DRIVE_TABLES
from reluctance.drive.drive import Drive
from reluctance.drive.tables.source import COLD_G
from reluctance.plant.hydraulics.pipe import Pipe
from reluctance.plant.hydraulics.pump import Pump, pump_from
from reluctance.plant.solar.single_diode import PowerPoint, open_circuit, power_point
from reluctance.pumping.array import Array
from reluctance.pumping.site import Site
from reluctance.pumping.tank import Demand, Tank
from reluctance.pumping.weather_file import WeatherTable

T = TypeVar("T")
WARM = 50.0  # cell temperature in full sun at which the nominal voltage is taken [degC]
TORQUE_MARGIN = 1.1  # the loss map's end over the torque of the drive file


class Operation(Section):
    """[operation]: the voltage that the array is held at, and what is between it and the drive."""

    kind: Literal["mppt", "constant", "fraction", "dcdc"] = "mppt"
    u_V: float | None = Field(None, gt=0)  # constant: of the array; dcdc: of the dc link
    fraction: float | None = Field(None, gt=0, lt=1)  # of the open-circuit voltage
    efficiency: float | None = Field(None, gt=0, le=1)  # of the dc-dc converter
    C_uF: float | None = Field(None, ge=20)  # of the dc link; by default 10 ms of nominal power

    @model_validator(mode="after")
    def numbers_belong_to_the_kind(self) -> "Operation":
        needs = {
            "mppt": set[str](),
            "constant": {"u_V"},
            "fraction": {"fraction"},
            "dcdc": {"u_V", "efficiency"},
        }[self.kind]
        given = {k for k in ("u_V", "fraction", "efficiency") if getattr(self, k) is not None}
        if missing := sorted(needs - given):
            raise ValueError(f"kind = {self.kind!r} needs {' and '.join(missing)}")
        for key in sorted(given - needs):
            raise ValueError(f"{key} has no effect with kind = {self.kind!r}; remove it")
        return self


class Limits(Section):
    """[limits] of the drive on this pump."""

    tau_max_Nm: float | None = Field(None, gt=0)  # by default 1.1 times the drive file's torque
    u_max_V: float | None = Field(None, gt=0)  # that the switches stand; by default not checked
    temp_cold_degC: float = Field(-10.0, gt=-60, lt=60)  # coldest cell in full sun, as of a drive


@dataclass(frozen=True, repr=False)
class System:
    """All that a day of pumping depends on, checked."""

    name: str
    folder: Path  # that its weather file is relative to
    drive: Drive
    pump: Pump
    site: Site
    weather: WeatherTable
    array: Array
    operation: Operation
    pipe: Pipe
    limits: Limits
    tank: Tank
    demand: Demand | None

    def __repr__(self) -> str:
        array = f"{self.array.n_series} x {self.array.n_parallel} modules, {self.operation.kind}"
        return f"System({self.name}: {array}; {self.pump.name}; {self.drive!r})"

    @property
    def tau_max(self) -> float:
        """Largest torque that the drive is used for [N m]."""
        return self.limits.tau_max_Nm or TORQUE_MARGIN * self.drive.tau_max

    @property
    def u_cold(self) -> float:
        """Greatest voltage that the array gives: open circuit, bright and cold [V]."""
        cold = np.array([self.limits.temp_cold_degC])
        return float(open_circuit(self.array.diode(np.array([COLD_G]), cold))[0])

    @property
    def nominal(self) -> PowerPoint:
        """What the array gives at most in full sun, its cells warm; (1,)."""
        return power_point(self.array.diode(np.array([1000.0]), np.array([WARM])))

    @property
    def u_dc(self) -> float:
        """Nominal voltage of the dc link: what the control law is set up for [V]."""
        if self.operation.kind == "dcdc":
            assert self.operation.u_V is not None
            return self.operation.u_V
        return round(float(self.nominal.u[0]), 1)

    def check_voltage(self) -> None:
        """The one rule of sizing, simulation and firmware: the switches stand the array's voltage.

        Raises
        ------
        ParameterError
            If they do not.
        """
        limit, cold = self.limits.u_max_V, self.limits.temp_cold_degC
        if limit is not None and self.u_cold > limit:
            raise ParameterError(
                f"[array] n_series = {self.array.n_series}: {self.u_cold:.4g} V without load in "
                f"full sun at [limits] temp_cold_degC = {cold:g}, need at most [limits] u_max_V = "
                f"{limit:g}; take fewer modules in series, or a warmer cold if the site has one"
            )

    def with_values(self, values: dict[str, Any]) -> "System":
        """A copy with other values, as {"array.n_series": 8}; checked."""
        changed = self
        for name, value in values.items():
            table, key, section = changed.table_of(name)
            changed = changed.with_table(
                table, {**section.model_dump(exclude_unset=True), key: value}
            )
        return changed

    def table_of(self, name: str) -> tuple[str, str, Section]:
        """Table, key and section of a value such as `array.n_series`.

        Raises
        ------
        ParameterError
            If the system has no such value, or it has no effect.
        """
        table, _, key = name.partition(".")
        if table in ("tank", "demand") and self.demand is None:
            raise ParameterError(
                f"`{name}` has no effect without [demand]; add [demand] m3_per_day to the system "
                "file"
            )
        section = getattr(self, table, None)
        if table not in TABLES or section is None or key not in type(section).model_fields:
            known = [f"{t}.{k}" for t in TABLES for k in TABLES[t].model_fields]
            raise ParameterError(
                f"unknown value `{name}` of a pumping system{did_you_mean(name, known)}"
            )
        return table, key, section

    def with_table(self, table: str, values: dict[str, Any]) -> "System":
        """A copy with another table of its file; checked."""
        if table not in TABLES:
            raise ParameterError(f"unknown table `{table}`{did_you_mean(table, TABLES)}")
        new: dict[str, Any] = {table: checked(TABLES[table], values, f"[{table}]")}
        return replace(self, **new)


TABLES: dict[str, type[Section]] = {
    "site": Site,
    "weather": WeatherTable,
    "array": Array,
    "operation": Operation,
    "pipe": Pipe,
    "limits": Limits,
    "tank": Tank,
    "demand": Demand,
}
OF_A_DRIVE = {"machine", "control", *DRIVE_TABLES}
OPTIONAL = {"operation", "limits", "tank", "demand"}


def load_system(path: str | Path, overrides: Sequence[str] = ()) -> System:
    """A pumping system from a TOML file. Its `drive` is a drive file, its `pump` a pump of the
    library or a file; paths are relative to the system file. `overrides` are `section.key=value`
    with the value as in TOML; no value removes the key.

    Raises
    ------
    ParameterError
        With one line that says what is wrong and what is needed.
    """
    return system_of_file(Path(path), read_toml(Path(path)), overrides)


def system_of_file(path: Path, data: dict[str, Any], overrides: Sequence[str] = ()) -> System:
    """A system from the content of its file, which is changed. Otherwise as `load_system`."""
    with reading(path, "a system file"):
        for text in overrides:
            _put(data, text)
        return system_from(data, folder=path.parent, name=one_line(path.stem))


def _put(data: dict[str, Any], text: str) -> None:
    """Puts the value of `section.key=value` into the tables, or removes the key."""
    name, equals, value = (part.strip() for part in text.partition("="))
    *path, key = name.split(".")
    if not equals or not key:
        raise ParameterError(f"--set {text}: need section.key=value")
    table = data
    for part in path:
        table = table.setdefault(part, {})
        if not isinstance(table, dict):
            raise ParameterError(f"--set {text}: `{part}` is not a table")
    if value:
        table[key] = toml_value(value)
    elif table.pop(key, None) is None:
        raise ParameterError(f"--set {text}: no such key to remove{did_you_mean(key, table)}")


def system_from(data: dict[str, Any], *, folder: Path, name: str = "system") -> System:
    """A pumping system from the tables of its file."""
    known = [*TABLES, "drive", "pump"]
    if "machine" in data and "site" not in data:
        raise ParameterError(
            "this is a drive file, not a pumping system; use `reluctance run`, or name it as "
            "`drive` in a system file: reluctance examples sun_day"
        )
    for key in data:
        if key in OF_A_DRIVE and isinstance(data.get("drive"), str):
            raise ParameterError(
                f"`{key}` is a table of a drive, not of a pumping system; change it in "
                f"{data['drive']}, the file of the drive"
            )
        if key not in known:
            raise ParameterError(f"unknown table `{key}`{did_you_mean(key, known)}")
    for key in known:
        if key not in data and key not in OPTIONAL:
            raise ParameterError(f"missing {'table ' if key in TABLES else ''}`{key}`")
    if not isinstance(data["drive"], str):
        raise ParameterError(f"drive = {data['drive']!r}, need the path of a drive file in quotes")
    if "tank" in data and "demand" not in data:
        raise ParameterError("[tank] has no effect without [demand]")
    check_places(data, {**TABLES, "pump": Pump})
    parts: dict[str, Callable[[], object]] = {
        key: partial(checked, section, data.get(key, {}), f"[{key}]")
        for key, section in TABLES.items()
        if key in data or key not in ("tank", "demand")
    }
    parts["drive"] = lambda: reluctance.load(folder / data["drive"])
    parts["pump"] = lambda: pump_from(data["pump"], folder)
    found: dict[str, Any] = together(parts)
    return System(
        name=name,
        folder=folder,
        **{"tank": checked(Tank, {"volume_m3": 0.0}, "[tank]"), "demand": None, **found},
    )


def together(parts: dict[str, Callable[[], T]]) -> dict[str, T]:
    """The result of each part; the faults of all are told together, on one line."""
    found, faults = {}, []
    for key, make in parts.items():
        try:
            found[key] = make()
        except ParameterError as fault:
            faults.append(str(fault))
    if faults:
        raise ParameterError("; and ".join(faults))
    return found
