"""The paper's equations and matrices exactly as printed, errors included.

Angles are the paper's: mechanical, 0 aligned, pi/4 unaligned. Section and equation numbers are
the paper's too; docs/paper.md lists what is wrong with each.
"""

import numpy as np

from reluctance.base.arrays import FloatArray
from reluctance.base.units import to_si

POWER = 6000.0  # Table 1 [W]
SPEED = to_si(1500.0, "rpm")  # Table 1 [rad/s]
R = 0.72  # Table 1 [ohm]
L_D, L_Q = 23.62e-3, 0.67e-3  # Table 1 [H]
J = 0.008  # Table 1 [kg m^2]
FRICTION = 0.02  # Table 1 [N m s/rad]
K_PUMP = 0.0015  # Table 1 [N m s^2]
TAU_RATED, TAU_HALF = 41.339, 20.669  # Table 1 and section 4 [N m]
RPM_RATED, RPM_HALF = 1500.0, 1060.7  # section 4
I_M, THETA_M, PSI_M = 450.0, np.radians(15), 0.468  # "maximum point", section 3 [A, rad, Wb]
N_P, N_C, R_W = 3, 2, 0.05  # section 4


def position(theta: float) -> float:
    """f(theta) of section 3 with its +48, theta in [0, pi/2] from alignment [rad]."""
    x = (theta if theta <= np.pi / 4 else np.pi / 2 - theta) / np.pi
    return 128 * x**3 + 48 * x**2 + 1


def torque(i: float, theta: float, *, L_sat: float, A: float, B: float) -> float:
    """T_e of section 3 [N m], bracket as printed: f' multiplies the last term only.

    f' is the slope of the position function with the sign mended, so that this shows the bracket
    alone; theta in [0, pi/4] from alignment [rad].
    """
    slope = 384 * theta**2 / np.pi**3 - 96 * theta / np.pi**2
    last = A / B * (1 - np.exp(-B * i)) * slope
    return float((L_sat - L_Q) / 2 * i**2 + A * i - last)


def matrices(a: float, b: float, omega_m: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A (6, 6), B (6, 3), C (1, 6) of eq. 3.1.

    Parameters
    ----------
    a, b : float
        The paper's a = dphi/di [H] and b = dphi/dtheta [Wb/rad] at the point of linearisation.
    omega_m : float
        Speed in row 4 [rad/s].
    """
    A = np.zeros((6, 6))
    A[:3, :3] = -R / a * np.eye(3)
    A[:3, 3] = -b / a
    A[3, 3] = (K_PUMP * omega_m**2 + FRICTION) / J
    A[4, 3] = 1
    A[5, 4], A[5, 5] = 1, TAU_RATED
    B = np.zeros((6, 3))
    B[:3] = np.eye(3) / a
    C = np.zeros((1, 6))
    C[0, 5] = 1
    return A, B, C


def markov(A: FloatArray, B: FloatArray, C: FloatArray, n: int) -> FloatArray:
    """C A^k B for k = 0 .. n - 1, shape (n, n_outputs, n_inputs): what inputs do to outputs."""
    return np.array([C @ np.linalg.matrix_power(A, k) @ B for k in range(n)])


def controllability_rank(A: FloatArray, B: FloatArray) -> int:
    """Rank of [B, A B, ..., A^(n-1) B]."""
    blocks = [np.linalg.matrix_power(A, k) @ B for k in range(len(A))]
    return int(np.linalg.matrix_rank(np.hstack(blocks)))


def prediction(
    A: FloatArray, B: FloatArray, C: FloatArray, *, N_p: int, N_c: int
) -> tuple[FloatArray, FloatArray]:
    """F (N_p p, n + p) and Phi (N_p p, N_c m) of the incremental form.

    n states, m inputs, p outputs.

    L. Wang, Model Predictive Control System Design and Implementation Using MATLAB, Springer 2009,
    eqs. 1.5 and 1.12.
    """
    n, m, p = len(A), B.shape[1], len(C)
    A_aug = np.block([[A, np.zeros((n, p))], [C @ A, np.eye(p)]])
    B_aug = np.vstack([B, C @ B])
    C_aug = np.hstack([np.zeros((p, n)), np.eye(p)])
    powers = [C_aug @ np.linalg.matrix_power(A_aug, k) for k in range(N_p + 1)]
    Phi = np.zeros((N_p * p, N_c * m))
    for row in range(N_p):
        for column in range(min(row + 1, N_c)):
            Phi[row * p : (row + 1) * p, column * m : (column + 1) * m] = (
                powers[row - column] @ B_aug
            )
    return np.vstack(powers[1:]), Phi


def increments(
    F: FloatArray, Phi: FloatArray, x: FloatArray, *, reference: float, r_w: float
) -> FloatArray:
    """Delta U = (Phi' Phi + r_w I)^-1 Phi' (R_s - F x), Wang's unconstrained law."""
    H = Phi.T @ Phi + r_w * np.eye(Phi.shape[1])
    return np.asarray(np.linalg.solve(H, Phi.T @ (reference - F @ x)))
