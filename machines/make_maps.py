"""Writes the flux maps of this folder from the data and formulae of their sources.

    python machines/make_maps.py        # from the root of the repository; needs reluctance

The files that are stored here are what it writes; tests/machine/test_machine_library.py compares
them.
"""

from pathlib import Path

import numpy as np

from reluctance.machine.maps import FluxTable, write_map

HERE = Path(__file__).parent

# NPF VECTOR, AO NIIET: V_motorParams_SRM.h, V_MotorModel.c, v 2.0 of 25/03/2017, Apache-2.0.
NPF_ALIGNED_A = [0, 1.125, 2.25, 3.375, 4.5, 6, 7.5, 9, 10.5, 12, 13.5]
NPF_ALIGNED_WB = [0, 0.45, 0.9, 1.35, 1.58, 1.7, 1.8, 1.89, 1.98, 2.06, 2.13]
NPF_UNALIGNED_A = [0, 1.35, 2.7, 4.05, 5.4, 6.75, 8.1, 9.45, 10.8, 12.15, 13.5]
NPF_UNALIGNED_WB = [0, 0.111, 0.221, 0.331, 0.44, 0.54, 0.648, 0.756, 0.863, 0.969, 1.075]


def npf_vector() -> FluxTable:
    """The source's two curves joined by its cosine, psi = (psi_a + psi_u)/2 - (psi_a - psi_u)/2
    cos(theta_e), at the currents of the aligned curve."""
    i = np.asarray(NPF_ALIGNED_A, float)
    psi_a = np.asarray(NPF_ALIGNED_WB)
    psi_u = np.interp(i, NPF_UNALIGNED_A, NPF_UNALIGNED_WB)
    theta_e = np.radians(np.linspace(0, 180, 25))
    psi = np.outer((psi_a + psi_u) / 2, np.ones(25)) - np.outer(
        (psi_a - psi_u) / 2, np.cos(theta_e)
    )
    return FluxTable(4, i, theta_e, psi)


GUC_L_MIN, GUC_L_MAX = 0.020, 0.150  # [H]
GUC_RISE = (18.0, 170.0)  # 0 to 38 deg mechanical from the source's zero, 4.5 deg past unaligned
GUC_BLEND = 4.0  # each kink becomes a parabola of this half width [deg el.]


def guc() -> FluxTable:
    """Inductance that rises in a straight line, kinks rounded; flux proportional to current."""
    degrees = np.linspace(0, 180, 91)
    fine = np.linspace(0, 180, 36001)
    low, high = (np.clip((fine - kink) / (2 * GUC_BLEND) + 0.5, 0, 1) for kink in GUC_RISE)
    slope = low - high
    rise = np.concatenate([[0], np.cumsum((slope[1:] + slope[:-1]) / 2)])
    L = GUC_L_MIN + (GUC_L_MAX - GUC_L_MIN) * np.interp(degrees, fine, rise / rise[-1])
    i = np.array([0.0, 5.0, 10.0, 15.0])
    return FluxTable(4, i, np.radians(degrees), np.outer(i, L))


MAPS = {"npf_vector_6_4.csv": npf_vector, "guc_linear_6_4.csv": guc}


def rounded(table: FluxTable) -> FluxTable:
    """Flux to 1e-8 Wb: the same text wherever it is computed."""
    return FluxTable(table.N_r, table.i, table.theta_e, np.round(table.psi, 8) + 0.0)


def main() -> None:
    for name, table in MAPS.items():
        write_map(rounded(table()), HERE / name)


if __name__ == "__main__":
    main()
