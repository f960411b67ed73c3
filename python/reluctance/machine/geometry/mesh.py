"""Mapped mesh of stator or rotor in the plane (u, theta) with u = ln r.

ln r + j theta is a conformal map of the cross-section: the field equation keeps its form, arcs
about the shaft become straight lines, and the air gap becomes a strip. Rows of cells run along the
circumference, columns along the poles. Each cell is cut into two triangles of six nodes
(isoparametric, quadratic), so that pole flanks and flat pole faces are followed by parabolas. The
cuts are mirror images of one another about each pole, as the machine is.

Nodes lie on the doubled grid of cell corners and their midpoints.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reluctance.machine.geometry.steel import Array

Integers = NDArray[np.int64]

AIR, STEEL, COIL = 0, 1, 2  # regions; COIL + 2 k after and COIL + 2 k + 1 before pole k: its coil


@dataclass(frozen=True)
class Grid:
    """How fine the mesh is.

    The field changes over a gap at the corners of the poles, of both sides, and ever less away from
    them. A cell at a distance d from the nearest corner may have the length

        h(d) = cell gap + growth d
    """

    cell: float = 1.0  # at a corner, in gaps
    growth: float = 0.7
    yoke: int = 3  # cells across a yoke

    def doubled(self) -> Grid:
        """Twice as many cells in both directions."""
        return Grid(self.cell / 2, self.growth / 2, 2 * self.yoke)


@dataclass(frozen=True)
class Mesh:
    """One side of the gap, over one sector."""

    u: Array  # (n_rows, n_columns) of each node; the last column is the first one, a sector on
    theta: Array  # (n_rows, n_columns) [rad]
    unknown: Integers  # (n_rows, n_columns); -1 where the vector potential is zero
    sign: Array  # (n_rows, n_columns) of the unknown: -1 on the last column of an odd sector
    elements: Integers  # (n_e, 6) nodes of the flattened grid: corners, then middles of 01, 12, 20
    region: Integers  # (n_e)
    n_unknowns: int
    gap_row: int  # row of nodes on the gap

    @property
    def ring_theta(self) -> Array:
        """Angles of the corners on the gap, closing one included [rad]."""
        return self.theta[self.gap_row, ::2]

    @property
    def ring(self) -> Integers:
        """Unknowns on the gap in order, closing node left out."""
        return self.unknown[self.gap_row, :-1]


def with_middles(x: Array) -> Array:
    """Cell edges and the middles between them, along the last axis."""
    both = np.empty((*x.shape[:-1], 2 * x.shape[-1] - 1))
    both[..., ::2], both[..., 1::2] = x, (x[..., 1:] + x[..., :-1]) / 2
    return both


def angles(half_pole: Array, columns: tuple[Array, Array], pitch: float) -> Array:
    """Angles of all nodes of rows with these half pole angles, (n_rows, n_columns).

    columns: places (n_poles, n_nodes) across each pole, -1..1, and across the slot after it, 0..1,
    without its ends.
    """
    across_pole, across_slot = columns
    n_poles = len(across_pole)
    half = half_pole[:, None]
    rows = [
        k * pitch + np.hstack([half * across_pole[k], half + (pitch - 2 * half) * across_slot[k]])
        for k in range(n_poles)
    ]
    return np.hstack([*rows, rows[0][:, :1] + n_poles * pitch])


def mapped(
    u: Array,
    theta: Array,
    *,
    region: Callable[[Integers, Integers], Integers],
    gap_first: bool,
    odd: bool,
) -> Mesh:
    """Numbers the nodes and cuts the cells.

    Parameters
    ----------
    u, theta : ndarray, shape (n_rows, n_columns)
        Nodes; odd numbers of both, the gap on the first or the last row.
    region : callable
        Region of each cell from its row and column.
    odd : bool
        The vector potential changes its sign from one sector to the next; else it repeats, and the
        sector is the whole machine.
    """
    n_rows, n_columns = u.shape
    far = n_rows - 1 if gap_first else 0  # the row on frame or shaft
    unknown = np.full((n_rows, n_columns), -1, dtype=np.int64)
    inner = np.array([row for row in range(n_rows) if row != far])
    unknown[inner, :-1] = np.arange(len(inner) * (n_columns - 1)).reshape(len(inner), -1)
    n_unknowns = len(inner) * (n_columns - 1)
    if not odd and not gap_first:  # no flux enters the shaft, but some may pass around it
        unknown[far, :-1] = n_unknowns
        n_unknowns += 1
    unknown[:, -1] = unknown[:, 0]
    sign = np.ones((n_rows, n_columns))
    sign[:, -1] = -1 if odd else 1

    row, column = (
        x.ravel() for x in np.meshgrid(range(n_rows // 2), range(n_columns // 2), indexing="ij")
    )
    rising = (row + column) % 2 == 0  # even numbers of cells: its own mirror image about each pole

    def node(down: int, right: int) -> Integers:
        return np.asarray((2 * row + down) * n_columns + 2 * column + right)

    a, b, c, d, middle = node(0, 0), node(0, 2), node(2, 0), node(2, 2), node(1, 1)
    ab, cd, ac, bd = node(0, 1), node(2, 1), node(1, 0), node(1, 2)

    def either(one: tuple[Integers, ...], other: tuple[Integers, ...]) -> Integers:
        return np.where(rising[:, None], np.stack(one, axis=1), np.stack(other, axis=1))

    first = either((a, c, b, ac, middle, ab), (a, c, d, ac, cd, middle))
    second = either((b, c, d, middle, cd, bd), (a, d, b, middle, bd, ab))
    regions = region(row, column)
    return Mesh(
        u=u,
        theta=theta,
        unknown=unknown,
        sign=sign,
        elements=np.concatenate([first, second]),
        region=np.concatenate([regions, regions]),
        n_unknowns=n_unknowns,
        gap_row=0 if gap_first else n_rows - 1,
    )
