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
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from reluctance.machine.geometry.steel import Array

Integers = NDArray[np.int64]

AIR, STEEL, COIL = 0, 1, 2  # regions; COIL + 2 k after and COIL + 2 k + 1 before pole k: its coil


@dataclass(frozen=True)
class Grid:
    """How fine the mesh is.

    The numbers are a compromise of a search over 27 grids on the 8/6 and 12/8 machines of the
    tests: with the same unknowns spread evenly over rows and columns the error of torque is four
    times as large. Cells across pole and slot decide it, since the field changes at the corners.
    """

    pole: int = 12  # cells across a pole, even
    slot: int = 12  # across a slot, even
    rotor_pole: int = 6  # along a rotor pole
    stator_pole: int = 6  # along a stator pole
    yoke: int = 2
    growth: float = 10.0  # largest over smallest cell along a pole,
    growth_pole: float = 4.0  # across a pole,
    growth_slot: float = 15.0  # across a slot

    def doubled(self) -> Grid:
        """Twice as many cells in both directions."""
        return replace(self, **{name: 2 * getattr(self, name) for name in COUNTS})


COUNTS = ("pole", "slot", "rotor_pole", "stator_pole", "yoke")


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


def graded(n: int, growth: float, *, ends: str) -> Array:
    """n cells on 0..1, the largest `growth` times the smallest; small at `both` ends, `first`,
    `last`, or equal at `none`."""
    x = np.linspace(0, 1, n + 1)
    d = np.arccosh(np.sqrt(growth))
    if ends == "none" or d == 0:
        return x
    if ends == "both":
        return np.asarray((1 + np.tanh(d * (2 * x - 1)) / np.tanh(d)) / 2)
    if ends == "first":
        return np.asarray(1 + np.tanh(d * (x - 1)) / np.tanh(d))
    return np.asarray(np.tanh(d * x) / np.tanh(d))


def with_middles(x: Array) -> Array:
    """Cell edges and the middles between them."""
    both = np.empty(2 * len(x) - 1)
    both[::2], both[1::2] = x, (x[1:] + x[:-1]) / 2
    return both


def pole_columns(grid: Grid) -> tuple[Array, Array]:
    """Columns of nodes over one pole pitch, its end left out: place across the pole, -1..1, and
    across the slot after it, 0..1."""
    pole = 2 * with_middles(graded(grid.pole, grid.growth_pole, ends="both")) - 1
    slot = with_middles(graded(grid.slot, grid.growth_slot, ends="both"))[1:-1]
    return pole, slot


def angles(half_pole: Array, columns: tuple[Array, Array], pitch: float, n_poles: int) -> Array:
    """Angles of all nodes of rows with these half pole angles, (n_rows, n_columns)."""
    across_pole, across_slot = columns
    half = half_pole[:, None]
    one = np.hstack([half * across_pole, half + (pitch - 2 * half) * across_slot])
    rows = np.hstack([one + k * pitch for k in range(n_poles)])
    return np.hstack([rows, rows[:, :1] + n_poles * pitch])


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
