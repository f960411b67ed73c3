"""A switched-reluctance machine that nobody tuned: its data are drawn from a seed."""

from __future__ import annotations

import numpy as np


def drawn_machine(seed: int) -> tuple[str, float]:
    """A machine file and a dc-link voltage [V], drawn from what real machines have."""
    draw = np.random.default_rng(seed)

    def between(low: float, high: float) -> float:
        return float(np.exp(draw.uniform(np.log(low), np.log(high))))

    N_s, N_r, n_phases = ((6, 4, 3), (8, 6, 4), (12, 8, 3), (10, 8, 5))[draw.integers(4)]
    u_dc = round(between(48, 600))
    i_max = float(f"{between(5, 400):.3g}")
    corner = between(200, 1500)  # of the shaft [rad/s]
    psi = np.pi * u_dc / (N_r * corner)  # flux linkage that saturates
    L_a = psi / i_max * between(3, 10)
    L_u = L_a / between(7, 35)
    L_sat = L_u * between(0.1, 0.5)
    numbers = {
        "R_ohm": u_dc / i_max * between(0.02, 0.15),
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
