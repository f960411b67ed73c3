"""Current-voltage curve of a photovoltaic array: one diode, two resistors, arrays of samples.

    I = I_L - I_0 (exp(V_d / a) - 1) - V_d / R_sh,        V = V_d - R_s I

Everything is a function of the diode voltage V_d, explicitly; Newton's method finds V_d for a
terminal voltage or for the maximum power. De Soto, Klein and Beckman, Solar Energy 80 (2006) 78,
and Dobos, J. Sol. Energy Eng. 134 (2012) 021011 for the dependence on irradiance and temperature.
"""

from dataclasses import dataclass

import numpy as np

from reluctance.base.arrays import FloatArray

T_REF = 298.15  # [K]
G_REF = 1000.0  # [W/m^2]
K_BOLTZMANN = 8.617333262e-05  # [eV/K]
E_GAP = 1.121  # silicon at T_REF [eV]
D_E_GAP = -0.0002677  # relative change of the gap [1/K]
TOLERANCE = 1e-10  # of the diode voltage, in units of a
MOST_STEPS = 60  # Newton's method takes 4 to 12

MOST_MODULES = 10_000  # in series, and in parallel


@dataclass(frozen=True)
class Cell:
    """A module at 1000 W/m^2 and 25 degC, as in the CEC table."""

    I_L_ref: float  # photo current [A]
    I_o_ref: float  # saturation current [A]
    R_s: float  # [ohm]
    R_sh_ref: float  # [ohm]
    a_ref: float  # diode voltage scale of the module [V]
    alpha_sc: float  # of the short-circuit current [A/K]
    adjust: float  # CEC's correction of alpha_sc [%]


@dataclass(frozen=True)
class Diode:
    """The five parameters of an array, one value a sample."""

    I_L: FloatArray  # [A]
    I_0: FloatArray  # [A]
    R_s: float  # [ohm]
    g_sh: FloatArray  # 1/R_sh: zero without light [S]
    a: FloatArray  # [V]


@dataclass(frozen=True)
class PowerPoint:
    """Where an array gives most."""

    u: FloatArray  # [V]
    i: FloatArray  # [A]
    u_oc: FloatArray  # open-circuit voltage [V]

    @property
    def p(self) -> FloatArray:
        """Power [W]."""
        return np.asarray(self.u * self.i)


def array_diode(
    cell: Cell, poa_global: FloatArray, temp_cell: FloatArray, *, n_series: int, n_parallel: int
) -> Diode:
    """Parameters of n_series x n_parallel equal modules at irradiance [W/m^2] and cell
    temperature [degC]."""
    G = np.maximum(poa_global, 0.0) / G_REF
    T = temp_cell + 273.15
    alpha = cell.alpha_sc * (1 - cell.adjust / 100)
    gap = E_GAP * (1 + D_E_GAP * (T - T_REF))
    I_0 = cell.I_o_ref * (T / T_REF) ** 3
    I_0 = I_0 * np.exp(E_GAP / (K_BOLTZMANN * T_REF) - gap / (K_BOLTZMANN * T))
    return Diode(
        I_L=n_parallel * G * (cell.I_L_ref + alpha * (T - T_REF)),
        I_0=n_parallel * I_0,
        R_s=cell.R_s * n_series / n_parallel,
        g_sh=G / cell.R_sh_ref * n_parallel / n_series,
        a=n_series * cell.a_ref * T / T_REF,
    )


def current(d: Diode, u: FloatArray | float) -> FloatArray:
    """Current at a terminal voltage, negative above the open-circuit voltage [A].

    V - R_s I is convex and rising in V_d, so that Newton's method from above never overshoots.
    """
    v_d = np.asarray(u + d.R_s * d.I_L, dtype=float)
    for _ in range(MOST_STEPS):
        i, slope, _ = _current_of(d, v_d)
        step = (v_d - d.R_s * i - u) / (1 - d.R_s * slope)
        v_d = v_d - step
        if np.all(np.abs(step) < TOLERANCE * d.a):
            break
    return _current_of(d, v_d)[0]


def open_circuit(d: Diode) -> FloatArray:
    """Voltage at which no current flows [V]."""
    v_d = d.a * np.log1p(d.I_L / d.I_0)
    for _ in range(MOST_STEPS):
        i, slope, _ = _current_of(d, v_d)
        v_d = v_d - i / slope
        if np.all(np.abs(i / slope) < TOLERANCE * d.a):
            break
    return np.asarray(v_d)


def power_point(d: Diode) -> PowerPoint:
    """The maximum of V I: a zero of its derivative with respect to V_d."""
    u_oc = open_circuit(d)
    v_d = u_oc - d.a * np.log1p(u_oc / d.a)  # exact for R_s = 0, g_sh = 0 to one step
    for _ in range(MOST_STEPS):
        i, slope, bend = _current_of(d, v_d)
        u, du = v_d - d.R_s * i, 1 - d.R_s * slope
        rise = slope * u + i * du
        step = rise / (bend * u + 2 * slope * du - i * d.R_s * bend)
        v_d = v_d - step
        if np.all(np.abs(step) < TOLERANCE * d.a):
            break
    i = _current_of(d, v_d)[0]
    return PowerPoint(u=v_d - d.R_s * i, i=i, u_oc=u_oc)


def _current_of(d: Diode, v_d: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Current and its first two derivatives with respect to the diode voltage."""
    e = d.I_0 * np.exp(v_d / d.a)
    return d.I_L + d.I_0 - e - v_d * d.g_sh, -e / d.a - d.g_sh, -e / (d.a * d.a)
