"""The machine over current and angle: one solved field at each node, from unaligned to aligned.

The potential at the next current is predicted from this one and its derivatives, which leaves two
to three Newton steps a node.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from reluctance.machine.geometry.position import at_angle
from reluctance.machine.geometry.solve import Field, solve
from reluctance.machine.geometry.steel import Array
from reluctance.machine.geometry.system import System

# Residual of the field equations at which a node is solved: a tenth of the steps fewer than 1e-5,
# and 3e-6 of the largest torque from a solution to 1e-9 (8/6 and 12/8 machines of the tests).
TOLERANCE = 1e-4


@dataclass(frozen=True)
class Samples:
    """Exact derivatives of one discrete co-energy at the nodes; arrays are (n_i, n_theta)."""

    i: Array  # (n_i) from 0 [A]
    theta_e: Array  # (n_theta) from 0 to pi [rad]
    coenergy: Array  # [J]
    psi: Array  # [Wb]
    tau: Array  # [N m]
    L_inc: Array  # d psi/di [H]
    psi_theta: Array  # d psi/dtheta_m = d tau/di [Wb/rad]


def sample(
    system: System,
    i: Array,
    theta_e: Array,
    *,
    k: int = 0,
    look: Callable[[int, int, Field], None] | None = None,
) -> Samples:
    """One phase carries current.

    Parameters
    ----------
    system : System
    i : ndarray, shape (n_i,)
        Rising from 0 [A].
    theta_e : ndarray, shape (n_theta,)
        Electrical angles of that phase [rad].
    k : int
        The phase.
    look : callable, optional
        Gets the two indices and the field of each node: for progress and for the forces.
    """
    values = np.zeros((5, len(i), len(theta_e)))
    unit = np.eye(system.winding.n_phases)[k]
    for column, angle in enumerate(theta_e):
        position = at_angle(system, rotor_angle(system, angle, k))
        predicted = np.zeros(system.n)
        dA_before: Array | None = None
        for row, current in enumerate(i):
            field = solve(position, current * unit, start=predicted, tolerance=TOLERANCE)
            dA, dpsi, dtau = field.tangent(k)
            values[:, row, column] = field.coenergy, field.psi[k], field.tau, dpsi[k], dtau
            if look is not None:
                look(row, column, field)
            if row + 1 < len(i):
                step = i[row + 1] - current
                predicted = field.A + step * dA
                if dA_before is not None and row > 1:  # the curve bends sharply at zero current
                    predicted += (dA - dA_before) * step**2 / (2 * (current - i[row - 1]))
                dA_before = dA
    W, psi, tau, L_inc, psi_theta = values + 0.0  # no -0
    return Samples(i, theta_e, W, psi, tau, L_inc, psi_theta)


def rotor_angle(system: System, theta_e: float, k: int = 0) -> float:
    """Angle of the rotor from where pole 0 of the rotor faces pole 0 of the stator [rad], at an
    electrical angle of phase k."""
    section = system.section
    return float(theta_e - np.pi) / section.N_r + 2 * np.pi * k / section.N_s
