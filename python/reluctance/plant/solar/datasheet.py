"""A photovoltaic module by the numbers that its maker prints.

The five parameters follow from three points of the curve and the temperature coefficients (De Soto,
Klein and Beckman, Solar Energy 80 (2006) 78). The points are met exactly, the coefficients of
voltage and power as nearly as a diode can: for one module in eight no diode has the printed ones,
and the fits of pvlib end without a result.
"""

from __future__ import annotations

import numpy as np
from pydantic import Field, model_validator

from reluctance.base.arrays import FloatArray
from reluctance.base.cache import cached
from reluctance.base.errors import ParameterError
from reluctance.base.schema import Section
from reluctance.plant.solar.single_diode import (
    K_BOLTZMANN,
    Cell,
    array_diode,
    open_circuit,
    power_point,
)

# Datasheets print three or four digits, and powers that are rounded to 5 W: 335 W with 37.4 V and
# 8.96 A (335.1 W), 400 W with 38.7 V and 10.34 A (400.2 W).
PRINTED = 0.015  # how far P_mp_W may be from V_mp I_mp
# How far the coefficients of V_oc and P_mp may be off: tests/plant/test_datasheet.py has how far
# they are over crystalline modules of the CEC table. More is another module's number or another
# unit.
OFF = 0.15  # [%/K]
CELL_VOLTAGES = (0.5, 0.78)  # open circuit at 25 degC, silicon [V]
T_REF, HOT = 25.0, 50.0  # [degC]


class Datasheet(Section):
    """[source.datasheet], [array.datasheet]: a module at 1000 W/m2 and 25 degC, as printed."""

    P_mp_W: float = Field(gt=0)
    V_oc_V: float = Field(gt=0)
    I_sc_A: float = Field(gt=0)
    V_mp_V: float = Field(gt=0)
    I_mp_A: float = Field(gt=0)
    alpha_sc_pctpK: float = Field(ge=0)  # of I_sc, positive
    beta_oc_pctpK: float = Field(lt=0)  # of V_oc, negative
    gamma_mp_pctpK: float = Field(lt=0)  # of P_mp, negative
    cells: int = Field(ge=1)  # in series: 72 in a module of 144 half cells

    @model_validator(mode="after")
    def numbers_are_of_one_module(self) -> Datasheet:
        if not self.V_mp_V < self.V_oc_V or not self.I_mp_A < self.I_sc_A:
            raise ValueError(
                f"V_mp_V = {self.V_mp_V:g}, I_mp_A = {self.I_mp_A:g}: need less than V_oc_V = "
                f"{self.V_oc_V:g} and I_sc_A = {self.I_sc_A:g}; are two of them exchanged?"
            )
        power = self.V_mp_V * self.I_mp_A
        if abs(power / self.P_mp_W - 1) > PRINTED:
            raise ValueError(
                f"P_mp_W = {self.P_mp_W:g}, but V_mp_V I_mp_A = {power:.4g} W, need the same "
                f"within {PRINTED:.1%}; take all of one column of the datasheet (STC, not NOCT)"
            )
        low, high = CELL_VOLTAGES
        each = self.V_oc_V / self.cells
        if not low <= each <= high:
            half = low <= 2 * each <= high and self.cells % 2 == 0
            told = f"{self.cells // 2} in a module of {self.cells}" if half else "72 in one of 144"
            raise ValueError(
                f"cells = {self.cells}: {each:.2g} V a cell, need {low:g} to {high:g}; count the "
                f"cells in series: {told} half cells"
            )
        self._check_coefficients()
        return self

    def _check_coefficients(self) -> None:
        """A datasheet may print them in mA/K, mV/K, V/K or W/K. No crystalline module of the CEC
        table loses less than 0.2 %/K of V_oc or P_mp."""
        for key, (least, most), units in (
            ("alpha_sc_pctpK", (0.0, 0.2), {"mA/K": 1e3 * self.I_sc_A}),
            ("beta_oc_pctpK", (-0.6, -0.2), {"mV/K": 1e3 * self.V_oc_V, "V/K": self.V_oc_V}),
            ("gamma_mp_pctpK", (-0.8, -0.2), {"W/K": self.P_mp_W}),
        ):
            value = getattr(self, key)
            if least <= value <= most:
                continue
            shares = {unit: 100 * value / whole for unit, whole in units.items()}
            hint = "".join(
                f"; if it is in {unit}, write {share:.3g}"
                for unit, share in shares.items()
                if least <= share <= most
            )
            raise ValueError(f"{key} = {value:g}, need {least:g} to {most:g} per cent per K{hint}")


def cell_from(sheet: Datasheet, table: str) -> Cell:
    """The module of a datasheet.

    Raises
    ------
    ParameterError
        If no diode goes through its points, or those that do have other coefficients.
    """
    cell = cached(Cell, ["datasheet", sheet.given], lambda: _fit(sheet, table), algorithm=1)
    beta, gamma = _slopes(cell).tolist()
    if max(abs(beta - sheet.beta_oc_pctpK), abs(gamma - sheet.gamma_mp_pctpK)) > OFF:
        raise ParameterError(
            f"[{table}.datasheet] beta_oc_pctpK = {sheet.beta_oc_pctpK:g}, gamma_mp_pctpK = "
            f"{sheet.gamma_mp_pctpK:g}: the nearest diode through the points has {beta:.3f} and "
            f"{gamma:.3f}, need the same within {OFF:g}; check the coefficients and `cells`"
        )
    return cell


def _fit(sheet: Datasheet, table: str) -> Cell:
    """Of all diodes through the points, the one whose coefficients are nearest to the printed."""
    kT = K_BOLTZMANN * (T_REF + 273.15)
    found = [c for n in IDEALITIES if (c := _through(sheet, n * sheet.cells * kT)) is not None]
    if not found:
        raise ParameterError(
            f"[{table}.datasheet] no diode goes through these points; check V_mp_V, I_mp_A, "
            "V_oc_V, I_sc_A and cells, all at 1000 W/m2 and 25 degC"
        )
    printed = np.array([sheet.beta_oc_pctpK, sheet.gamma_mp_pctpK])
    return min(found, key=lambda cell: float(np.linalg.norm(_slopes(cell) - printed)))


IDEALITIES = np.linspace(0.6, 2.0, 281)  # of a cell's diode


@np.errstate(over="ignore", invalid="ignore")  # of values that no module has
def _through(sheet: Datasheet, a: float) -> Cell | None:
    """The diode of a voltage scale through I_sc, V_oc and the point of greatest power, if there is
    one with positive resistances. The curve is linear in I_L, I_0 and 1/R_sh; the slope of the
    power at V_mp leaves R_s."""
    from scipy.optimize import brentq  # half of the start-up time

    v = np.array([0.0, sheet.V_oc_V, sheet.V_mp_V])
    i = np.array([sheet.I_sc_A, 0.0, sheet.I_mp_A])
    most = (sheet.V_oc_V - sheet.V_mp_V) / sheet.I_mp_A

    def linear(R_s: float) -> FloatArray:
        v_d = v + R_s * i
        rows = np.stack([np.ones(3), -np.expm1(v_d / a) * np.exp(-sheet.V_oc_V / a), -v_d], axis=1)
        return np.linalg.solve(rows, i)

    def slope(R_s: float) -> float:
        _, scaled, g = linear(R_s)
        steep = scaled / a * np.exp((v[2] + R_s * i[2] - sheet.V_oc_V) / a) + g
        return float(i[2] - v[2] * steep / (1 + R_s * steep))

    ends = 1e-6 * most, 0.999 * most
    if slope(ends[0]) * slope(ends[1]) > 0:
        return None
    R_s = brentq(slope, *ends)
    I_L, scaled, g = linear(R_s).tolist()
    if min(scaled, g) <= 0:
        return None
    return Cell(
        I_L_ref=I_L,
        I_o_ref=scaled * float(np.exp(-sheet.V_oc_V / a)),
        R_s=R_s,
        R_sh_ref=1 / g,
        a_ref=a,
        alpha_sc=sheet.alpha_sc_pctpK / 100 * sheet.I_sc_A,
        adjust=0.0,
    )


def _slopes(cell: Cell) -> FloatArray:
    """Temperature coefficients of V_oc and of the power, from 25 to 50 degC [%/K]."""
    diode = array_diode(cell, np.full(2, 1000.0), np.array([T_REF, HOT]), n_series=1, n_parallel=1)
    u_oc, power = open_circuit(diode), power_point(diode).p
    return np.array([100 * (x[1] / x[0] - 1) / (HOT - T_REF) for x in (u_oc, power)])
