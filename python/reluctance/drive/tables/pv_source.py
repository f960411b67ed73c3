"""The photovoltaic array of a [source] table: the core's part, and its open-circuit voltage."""

from __future__ import annotations

import math

import numpy as np

from reluctance import _core
from reluctance.base.arrays import FloatArray
from reluctance.base.units import to_si
from reluctance.drive.tables.sections import Source
from reluctance.plant.solar.pv_module import cell_of
from reluctance.plant.solar.single_diode import (
    Diode,
    array_diode,
    open_circuit,
    power_point,
)

COLD_G = 1000.0  # irradiance of the cold moment that the switches must stand [W/m^2]


def pv_array(source: Source) -> _core.PvArray:
    """The core's array, its dc link at open-circuit voltage."""
    cell = cell_of(source.module, source.datasheet, source.cell, "source")
    series, parallel = source.n_series or 0, source.n_parallel or 0
    t = source.t_s
    sun, heat = source.poa_global_Wpm2 or [], source.temp_cell_degC or []

    start = diode_of(source, np.array(sun[0]), np.array(heat[0]))
    return _core.PvArray(
        I_L=parallel * cell.I_L_ref,
        R_s=cell.R_s * series / parallel,
        R_sh=cell.R_sh_ref * series / parallel,
        a=series * cell.a_ref,
        alpha=parallel * cell.alpha_sc * (1 - cell.adjust / 100),
        v_block=source.blocking_diode_V,
        C=to_si(source.C_uF or 0.0, "uF"),
        u_start=max(float(open_circuit(start)) - source.blocking_diode_V, 0.0),
        ln_ref=math.log(cell.R_s * cell.I_o_ref / cell.a_ref),
        poa_global=_core.Course(t=t, value=sun),
        temp_cell=_core.Course(t=t, value=heat),
    )


def diode_of(source: Source, G: FloatArray, T_degC: FloatArray) -> Diode:
    """The array's curve at irradiance [W/m^2] and cell temperature [degC], one value a sample."""
    return array_diode(
        cell_of(source.module, source.datasheet, source.cell, "source"),
        G,
        T_degC,
        n_series=source.n_series or 0,
        n_parallel=source.n_parallel or 0,
    )


def cold_voltage(source: Source) -> float:
    """Greatest voltage that the array gives: open circuit, bright and cold [V]."""
    return float(open_circuit(diode_of(source, *np.array([COLD_G, source.temp_cold_degC]))))


def available(source: Source, t: FloatArray) -> FloatArray:
    """Power of the array at its maximum power point at the times t [s]; [W], as t."""
    G = np.interp(t, source.t_s, source.poa_global_Wpm2 or [])
    T_degC = np.interp(t, source.t_s, source.temp_cell_degC or [])
    return power_point(diode_of(source, G, T_degC)).p
