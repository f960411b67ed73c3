"""The paper's machine at an operating point, and profiles of given currents."""

import numpy as np

from reluctance import _core
from reluctance.machine.optimum import OperatingPoint, Profile

PAPER = _core.LeHuy(N_r=4, L_u=0.67e-3, L_a=23.62e-3, L_sat=0.15e-3, i_m=450.0, psi_m=0.468)
POINT = OperatingPoint(PAPER, n_phases=3, R=0.72, i_max=150.0, u_dc=240.0, omega_m=50 * np.pi)


def profile(i, psi=None, **values):
    theta_e = 2 * np.pi * np.arange(i.shape[-1]) / i.shape[-1]
    usual = {"tau_error_max": 0.0, "tau_error_rms": 0.0, "i_rms": 1.0, "p_cu": 1.0, "u_dc": 240.0}
    usual |= {"tau_ref": 0.0, "omega_m": 0.0, "u": 0 * i, "i_peak": float(i.max())}
    return Profile(theta_e=theta_e, i=i, psi=0 * i if psi is None else psi, **usual | values)
