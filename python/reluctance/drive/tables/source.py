"""The [source] table: what feeds the dc link."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from reluctance import _core
from reluctance.base.arrays import FloatArray
from reluctance.base.units import to_si
from reluctance.drive.tables.over_time import OverTime, course
from reluctance.plant.solar.datasheet import Datasheet
from reluctance.plant.solar.pv_module import CellNumbers, cell_of, check_one_module
from reluctance.plant.solar.single_diode import (
    MOST_MODULES,
    Cell,
    Diode,
    array_diode,
    open_circuit,
    power_point,
)

COLD_G = 1000.0  # irradiance of the cold moment that the switches must stand [W/m^2]
FASTEST_us = 0.5  # time constant of battery and capacitor: a shorter one makes the steps short


class Source(OverTime):
    """What feeds the dc link. A stiff one and a battery have the nominal voltage of [converter], or
    a course in V; an array has irradiance and cell temperature at the times t_s."""

    kind: Literal["stiff", "battery", "pv"] = "stiff"
    R_ohm: float | None = Field(None, gt=0)  # battery: of the battery and its cable
    C_uF: float | None = Field(None, ge=20)  # battery, pv: dc-link capacitor
    one_way: bool = False  # battery: a rectifier, which takes no energy back
    module: str | None = None  # pv: a name of the CEC table
    datasheet: Datasheet | None = None  # pv: or a module by what its maker prints
    cell: CellNumbers | None = None  # pv: or by the numbers of its diode
    n_series: int | None = Field(None, ge=1, le=MOST_MODULES)  # pv: modules
    n_parallel: int | None = Field(None, ge=1, le=MOST_MODULES)
    poa_global_Wpm2: list[float] | None = Field(None, min_length=1)  # pv: irradiance
    temp_cell_degC: list[float] | None = Field(None, min_length=1)  # pv
    blocking_diode_V: float = Field(0.0, ge=0)  # pv: while it conducts
    temp_cold_degC: float = Field(-10.0, gt=-60, lt=60)  # pv: coldest cell in full sun

    @model_validator(mode="after")
    def numbers_belong_to_the_kind(self) -> Source:
        given = self.model_fields_set - {"kind"}
        for key in sorted(given - KEYS_OF_SOURCE[self.kind]):
            raise ValueError(f"{key} has no effect with kind = {self.kind!r}; remove it")
        for key in NEEDED_OF_SOURCE[self.kind]:
            if getattr(self, key) is None:
                raise ValueError(f"kind = {self.kind!r} needs {key}")
        if any(u <= 0 for u in self.values):
            raise ValueError(f"values = {self.values}, need voltages > 0")
        if self.kind == "battery" and (self.R_ohm or 0) * (self.C_uF or 0) < FASTEST_us:
            raise ValueError(
                f"R_ohm = {self.R_ohm:g} and C_uF = {self.C_uF:g} equalise in less than "
                f"{FASTEST_us:g} us, need R_ohm >= {FASTEST_us / (self.C_uF or 1):.3g}, or "
                "kind = 'stiff'"
            )
        return self

    @model_validator(mode="after")
    def array_is_one_in_the_light(self) -> Source:
        if self.kind != "pv":
            return self
        check_one_module(self.module, self.datasheet, self.cell, "source")
        sun, heat = self.poa_global_Wpm2 or [], self.temp_cell_degC or []
        if not all(0 <= G <= 2000 for G in sun):
            raise ValueError(f"poa_global_Wpm2 = {sun}, need 0 to 2000")
        if max(sun) == 0:
            raise ValueError("poa_global_Wpm2 is 0 throughout: night only, no pump would start")
        if not all(-60 < T < 120 for T in heat):
            raise ValueError(f"temp_cell_degC = {heat}, need -60 to 120")
        return self

    def over_time(self) -> dict[str, list[float]]:
        if self.kind != "pv":
            return super().over_time()
        return {
            "poa_global_Wpm2": self.poa_global_Wpm2 or [],
            "temp_cell_degC": self.temp_cell_degC or [],
        }

    def core(self, u_dc: float) -> _core.StiffSource | _core.Battery | _core.PvArray:
        """The core's part; u_dc: the nominal voltage of the dc link [V]."""
        if self.kind == "pv":
            return self._array()
        voltage = course(self.points(u_dc))
        if self.kind == "stiff":
            return _core.StiffSource(u_dc=voltage)
        return _core.Battery(E=voltage, R=self.si["R"], C=self.si["C"], one_way=self.one_way)

    def _array(self) -> _core.PvArray:
        """Its dc link begins at open-circuit voltage."""
        cell = self._cell
        series, parallel = self.n_series or 0, self.n_parallel or 0
        sun, heat = self.poa_global_Wpm2 or [], self.temp_cell_degC or []
        start = self.diode(np.array(sun[0]), np.array(heat[0]))
        return _core.PvArray(
            I_L=parallel * cell.I_L_ref,
            R_s=cell.R_s * series / parallel,
            R_sh=cell.R_sh_ref * series / parallel,
            a=series * cell.a_ref,
            alpha=parallel * cell.alpha_sc * (1 - cell.adjust / 100),
            v_block=self.blocking_diode_V,
            C=to_si(self.C_uF or 0.0, "uF"),
            u_start=max(float(open_circuit(start)) - self.blocking_diode_V, 0.0),
            ln_ref=math.log(cell.R_s * cell.I_o_ref / cell.a_ref),
            poa_global=course((self.t_s, sun)),
            temp_cell=course((self.t_s, heat)),
        )

    @property
    def _cell(self) -> Cell:
        return cell_of(self.module, self.datasheet, self.cell, "source")

    def diode(self, G: FloatArray, T_degC: FloatArray) -> Diode:
        """Curve of the array at irradiance [W/m^2] and cell temperature [degC], one value a
        sample."""
        series, parallel = self.n_series or 0, self.n_parallel or 0
        return array_diode(self._cell, G, T_degC, n_series=series, n_parallel=parallel)

    @property
    def cold_voltage(self) -> float:
        """Greatest voltage that the array gives: open circuit, bright and cold [V]."""
        return float(open_circuit(self.diode(*np.array([COLD_G, self.temp_cold_degC]))))

    def available(self, t: FloatArray) -> FloatArray:
        """Power of the array at its maximum power point at the times t [s]; [W], as t."""
        G = np.interp(t, self.t_s, self.poa_global_Wpm2 or [])
        T_degC = np.interp(t, self.t_s, self.temp_cell_degC or [])
        return power_point(self.diode(G, T_degC)).p


NEEDED_OF_SOURCE = {
    "stiff": (),
    "battery": ("R_ohm", "C_uF"),
    "pv": ("t_s", "C_uF", "n_series", "n_parallel", "poa_global_Wpm2", "temp_cell_degC"),
}
KEYS_OF_SOURCE = {
    "stiff": {"t_s", "values"},
    "battery": {"t_s", "values", "R_ohm", "C_uF", "one_way"},
    "pv": {
        *("t_s", "module", "datasheet", "cell", "n_series", "n_parallel", "C_uF"),
        *("poa_global_Wpm2", "temp_cell_degC", "blocking_diode_V", "temp_cold_degC"),
    },
}
