"""Triangles of six nodes: gradients, weights and loads at three Gauss points of each.

In the plane (u, theta) of mesh.py, with r = exp(u), the flux density is

    B_r = (1/r) dA/dtheta,    B_theta = -(1/r) dA/du,

and an area dS = r^2 du dtheta.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reluctance.machine.geometry.mesh import Mesh
from reluctance.machine.geometry.steel import Array

# Gauss points of degree 2 inside the triangle, as coordinates of its corners; equal weights.
POINTS = np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6
EDGES = ((0, 1), (1, 2), (2, 0))
CORNERS = np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])  # gradients of the corner coordinates


@dataclass(frozen=True)
class Elements:
    """What all integrals over a mesh need."""

    gradient: Array  # (n_e, 3, 2, 6): (dA/du, dA/dtheta)/r at the Gauss points, of the unknowns
    weight: Array  # (n_e, 3) areas of the Gauss points [m^2]
    shape: Array  # (n_e, 3, 6) shape functions at the Gauss points, with the same signs
    r: Array  # (n_e, 3) [m]
    theta: Array  # (n_e, 3) [rad]


def shapes() -> tuple[Array, Array]:
    """Shape functions (3, 6) at the Gauss points and their derivatives (3, 2, 6)."""
    value, slope = np.zeros((3, 6)), np.zeros((3, 2, 6))
    value[:, :3] = POINTS * (2 * POINTS - 1)
    slope[:, :, :3] = (4 * POINTS - 1)[:, None, :] * CORNERS.T
    for n, (a, b) in enumerate(EDGES):
        value[:, 3 + n] = 4 * POINTS[:, a] * POINTS[:, b]
        slope[:, :, 3 + n] = 4 * (POINTS[:, a, None] * CORNERS[b] + POINTS[:, b, None] * CORNERS[a])
    return value, slope


def elements(mesh: Mesh) -> Elements:
    """Gradients with the signs of the unknowns of an odd sector in them."""
    value, slope = shapes()
    u, theta = mesh.u.ravel()[mesh.elements], mesh.theta.ravel()[mesh.elements]
    sign = mesh.sign.ravel()[mesh.elements]
    jacobian = np.stack(
        [np.einsum("qdi,ei->eqd", slope, x) for x in (u, theta)], axis=-1
    )  # (n_e, 3, reference, (u, theta))
    area = np.linalg.det(jacobian)
    r = np.exp(u @ value.T)
    plane = np.linalg.solve(jacobian, np.broadcast_to(slope, (len(u), 3, 2, 6)))
    weight = area * r**2 / 6
    return Elements(
        gradient=plane / r[:, :, None, None] * sign[:, None, None, :],
        weight=weight,
        shape=value * sign[:, None, :],
        r=r,
        theta=theta @ value.T,
    )
