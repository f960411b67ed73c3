"""The photovoltaic array of a [source] table: the core's part, and its open-circuit voltage."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from reluctance import _core
from reluctance.drive.tables import CellNumbers, Source
from reluctance.errors import ParameterError
from reluctance.units import to_si

HALVINGS = 60  # of the open-circuit voltage: to the last digit
GOLDEN, GOLDEN_STEPS = 0.6180339887498949, 40  # 1e-8 of the voltage
COLD_G = 1000.0  # irradiance of the cold moment that the switches must stand [W/m^2]


def cell_of(source: Source) -> CellNumbers:
    """One module at 1000 W/m^2 and 25 degC: the table's numbers, or those of its name.

    Raises
    ------
    ParameterError
        If pvlib is missing, does not know the name, or has a wrong sign in its row.
    """
    if source.cell is not None:
        return source.cell
    from reluctance.pumping.array import cec_module  # upwards: the CEC table comes with pvlib

    try:
        module = cec_module(source.module or "")
    except ParameterError as fault:
        text = str(fault).replace("[array.cell]", "[source.cell]").replace("[array]", "[source]")
        raise ParameterError(text) from None
    return CellNumbers(
        I_L_ref_A=module.I_L_ref,
        I_o_ref_A=module.I_o_ref,
        R_s_ohm=module.R_s,
        R_sh_ref_ohm=module.R_sh_ref,
        a_ref_V=module.a_ref,
        alpha_sc_ApK=module.alpha_sc,
        adjust_pct=module.adjust,
    )


def pv_array(source: Source) -> _core.PvArray:
    """The core's array, its dc link at open-circuit voltage."""
    cell = cell_of(source)
    series, parallel = source.n_series or 0, source.n_parallel or 0
    t = source.t_s
    sun, heat = source.poa_global_Wpm2 or [], source.temp_cell_degC or []

    def made(u_start: float) -> _core.PvArray:
        return _core.PvArray(
            I_L=parallel * cell.I_L_ref_A,
            R_s=cell.R_s_ohm * series / parallel,
            R_sh=cell.R_sh_ref_ohm * series / parallel,
            a=series * cell.a_ref_V,
            alpha=parallel * cell.alpha_sc_ApK * (1 - cell.adjust_pct / 100),
            v_block=source.blocking_diode_V,
            C=to_si(source.C_uF or 0.0, "uF"),
            u_start=u_start,
            ln_ref=math.log(cell.R_s_ohm * cell.I_o_ref_A / cell.a_ref_V),
            poa_global=_core.Course(t=t, value=sun),
            temp_cell=_core.Course(t=t, value=heat),
        )

    u_oc = open_circuit(made(0.0), sun[0], heat[0])
    return made(max(u_oc - source.blocking_diode_V, 0.0))


def open_circuit(array: _core.PvArray, G: float, T_degC: float) -> float:
    """Voltage without current, at irradiance [W/m^2] and cell temperature [degC]; [V]."""
    if G <= 0:
        return 0.0
    low, high = 0.0, 1.0
    while array.current(high, G, T_degC) > 0:
        high *= 2
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if array.current(middle, G, T_degC) > 0 else (low, middle)
    return low


def cold_voltage(source: Source) -> float:
    """Greatest voltage that the array gives: open circuit, bright and cold [V]."""
    return open_circuit(pv_array(source), COLD_G, source.temp_cold_degC)


def available(source: Source, t: NDArray[np.float64]) -> NDArray[np.float64]:
    """Power of the array at its maximum power point at the times t [s]; [W]."""
    array = pv_array(source)
    t = np.asarray(t, dtype=float)
    sun = np.interp(t, source.t_s, source.poa_global_Wpm2 or [])
    heat = np.interp(t, source.t_s, source.temp_cell_degC or [])
    return np.array([_maximum(array, float(G), float(T)) for G, T in zip(sun, heat, strict=True)])


def _maximum(array: _core.PvArray, G: float, T_degC: float) -> float:
    """Greatest u i, which has one maximum, by golden section [W]."""
    low, high = 0.0, open_circuit(array, G, T_degC)
    for _ in range(GOLDEN_STEPS):
        a, b = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
        if a * array.current(a, G, T_degC) < b * array.current(b, G, T_degC):
            low = a
        else:
            high = b
    return low * array.current(low, G, T_degC)
