"""Where the cells of a mesh lie: short at the corners of the poles, longer away from them.

The field changes over a gap at the corners of the poles, of both sides, and ever less away from
them. At a distance d from the nearest corner a cell has the length

    h(d) = least + growth d,

so that ln(1 + growth d/least)/growth cells lie between a corner and d: a few more for a gap half as
long, whatever the machine.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import ceil

import numpy as np

from reluctance.machine.geometry.steel import Array


@dataclass(frozen=True)
class Spacing:
    """Cells along a line with corners at these places."""

    corners: Array  # rising
    least: float  # length of a cell at a corner
    growth: float  # of its length over the distance

    @cached_property
    def _knots(self) -> tuple[Array, Array]:
        """Corners, the middles between them, and the number of cells from the first corner."""
        x = np.empty(2 * len(self.corners) - 1)
        x[::2], x[1::2] = self.corners, (self.corners[1:] + self.corners[:-1]) / 2
        return x, np.append(0.0, np.cumsum(self._cells(np.diff(x))))

    def _cells(self, d: Array) -> Array:
        return np.asarray(np.log1p(self.growth * d / self.least) / self.growth)

    def _distance(self, cells: Array) -> Array:
        return np.asarray(self.least / self.growth * np.expm1(self.growth * cells))

    def cells(self, x: Array) -> Array:
        """Number of cells from the first corner to places x between the first and the last one."""
        knots, count = self._knots
        piece = np.clip(np.searchsorted(knots, x, side="right") - 1, 0, len(knots) - 2)
        up = count[piece] + self._cells(np.maximum(x - knots[piece], 0))
        down = count[piece + 1] - self._cells(np.maximum(knots[piece + 1] - x, 0))
        return np.where(piece % 2 == 0, up, down)

    def places(self, cells: Array) -> Array:
        """The inverse of `cells`."""
        knots, count = self._knots
        piece = np.clip(np.searchsorted(count, cells, side="right") - 1, 0, len(knots) - 2)
        up = knots[piece] + self._distance(np.maximum(cells - count[piece], 0))
        down = knots[piece + 1] - self._distance(np.maximum(count[piece + 1] - cells, 0))
        return np.where(piece % 2 == 0, up, down)

    def split(self, low: Array, high: Array, n: int) -> Array:
        """n cells on each interval, in the proportions of h: their edges (n_intervals, n + 1)."""
        first, last = self.cells(low)[:, None], self.cells(high)[:, None]
        edges = self.places(first + (last - first) * np.linspace(0, 1, n + 1))
        edges[:, 0], edges[:, -1] = low, high  # no rounding
        return edges


def whole(cells: float, *, multiple: int = 1) -> int:
    """The next whole number of cells, at least one."""
    return multiple * max(1, ceil(cells / multiple - 1e-9))


def away(length: float, n: int | None, least: float, growth: float) -> Array:
    """Edges of cells from a corner at 0 to a length; as many as h asks for, or n."""
    spacing = Spacing(np.array([0.0, 2 * length]), least, growth)
    low, high = np.zeros(1), np.full(1, length)
    cells = float(spacing.cells(high)[0])
    edges: Array = spacing.split(low, high, n or whole(cells))[0]
    return edges
