"""Switched-reluctance machines that nobody tuned: their data are drawn from a seed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Ranges:
    """What is drawn, each number from a logarithmic range; i_max (A) is from 5 to 400."""

    u_dc: tuple[float, float]  # [V]
    corner: tuple[float, float]  # speed of the shaft with a flux that fits in half a period [rad/s]
    i_over_knee: tuple[float, float]  # i_max over the current at which an unsaturated phase has psi
    L_a_over_L_u: tuple[float, float]
    L_sat_over_L_u: tuple[float, float]
    drop: tuple[float, float]  # R i_max / u_dc


USUAL = Ranges((48, 600), (200, 1500), (3, 10), (7, 35), (0.1, 0.5), (0.02, 0.15))
# Independent of the first: small inductance ratios, much resistance, battery to rail voltages.
WIDE = Ranges((24, 800), (100, 1200), (2, 4), (6, 14), (0.2, 0.8), (0.01, 0.15))


def drawn_machine(seed: int, ranges: Ranges = USUAL) -> tuple[str, float]:
    """A machine file and a dc-link voltage [V], drawn from what real machines have."""
    draw = np.random.default_rng(seed)

    def between(low: float, high: float) -> float:
        return float(np.exp(draw.uniform(np.log(low), np.log(high))))

    N_s, N_r, n_phases = ((6, 4, 3), (8, 6, 4), (12, 8, 3), (10, 8, 5))[draw.integers(4)]
    u_dc = round(between(*ranges.u_dc))
    i_max = float(f"{between(5, 400):.3g}")
    corner = between(*ranges.corner)
    psi = np.pi * u_dc / (N_r * corner)  # flux linkage that saturates
    L_a = psi / i_max * between(*ranges.i_over_knee)
    L_u = L_a / between(*ranges.L_a_over_L_u)
    L_sat = L_u * between(*ranges.L_sat_over_L_u)
    numbers = {
        "R_ohm": u_dc / i_max * between(*ranges.drop),
        "L_u_H": L_u,
        "L_a_H": L_a,
        "L_sat_H": L_sat,
        "i_m_A": i_max,
        "psi_m_Wb": psi + L_sat * i_max,
        "J_kgm2": 1e-5 * u_dc * i_max / corner * 100,
    }
    text = f"""[machine]
name = "drawn from seed {seed}"
source = "studies/drawn_machine.py"
licence = "Apache-2.0"
N_s = {N_s}
N_r = {N_r}
n_phases = {n_phases}
i_max_A = {i_max:g}
model = "lehuy"
"""
    return text + "".join(f"{key} = {value:.4g}\n" for key, value in numbers.items()), u_dc
