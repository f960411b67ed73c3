"""The cross-section of a machine: dimensions in SI, and the meshes of its stator and rotor."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import gcd

import numpy as np

from reluctance.machine.geometry.mesh import (
    AIR,
    COIL,
    STEEL,
    Grid,
    Integers,
    Mesh,
    angles,
    mapped,
    with_middles,
)
from reluctance.machine.geometry.spacing import Spacing, away, whole
from reluctance.machine.geometry.steel import Array

N_TURNS = 181  # angles at which the cells are counted
AIR_AT_FLAT_FACE = 0.25  # of the gap length: air in the mesh before a flat face, at its middle


@dataclass(frozen=True)
class CrossSection:
    """Poles with parallel sides, slots with round floors; rotor pole 0 and stator pole 0 at 0."""

    N_s: int
    N_r: int
    r_shaft: float  # [m]
    r_rotor: float  # pole face of the rotor [m]
    r_bore: float  # pole face of the stator, at its middle [m]
    r_out: float  # [m]
    beta_s: float  # pole arcs [rad]
    beta_r: float
    h_s: float  # pole heights [m]
    h_r: float
    flat_face: bool  # stator pole faces are planes instead of arcs

    @property
    def gap(self) -> float:
        """Length of the air gap [m]."""
        return self.r_bore - self.r_rotor

    @property
    def n_sectors(self) -> int:
        """Parts of the machine that repeat."""
        return gcd(self.N_s, self.N_r)

    @property
    def half_width_s(self) -> float:
        """Half the width of a stator pole [m]."""
        return self.r_bore * float(np.sin(self.beta_s / 2))

    @property
    def half_width_r(self) -> float:
        """Half the width of a rotor pole [m]."""
        return self.r_rotor * float(np.sin(self.beta_r / 2))

    @property
    def r_slot_s(self) -> float:
        """Slot floor of the stator [m]."""
        return self.r_bore + self.h_s

    @property
    def r_slot_r(self) -> float:
        """Slot floor of the rotor [m]."""
        return self.r_rotor - self.h_r

    @property
    def r_corner_s(self) -> float:
        """Corners of the stator pole face [m]."""
        return float(np.hypot(self.r_bore, self.half_width_s)) if self.flat_face else self.r_bore

    @property
    def r_ring_s(self) -> float:
        """Where the mesh of the stator begins [m]."""
        return self.r_bore - (AIR_AT_FLAT_FACE * self.gap if self.flat_face else 0.0)

    @property
    def rotor(self) -> Poles:
        """Poles of the rotor at the gap."""
        return Poles(self.N_r, self.beta_r / 2)

    @property
    def stator(self) -> Poles:
        """Poles of the stator at the gap."""
        return Poles(self.N_s, float(np.arcsin(self.half_width_s / self.r_corner_s)))

    def spacing(self, grid: Grid, own: Poles, other: Poles, turn: float) -> Spacing:
        """Of the cells of one side along the gap, with the other side turned by an angle [rad]."""
        corners = np.concatenate([own.corners(0.0), other.corners(turn)])
        return Spacing(np.sort(corners), grid.cell * self.gap / self.r_bore, grid.growth)


@dataclass(frozen=True)
class Poles:
    """The poles of one side at the gap, the first one at angle 0."""

    n: int
    half: float  # angle [rad]

    @property
    def pitch(self) -> float:
        return 2 * np.pi / self.n

    def corners(self, turn: float) -> Array:
        """Angles of the corners over one turn and a pitch to either side at least [rad]."""
        middles = turn % self.pitch + np.arange(-3, self.n + 3) * self.pitch
        return np.concatenate([middles - self.half, middles + self.half])


@dataclass(frozen=True)
class Cells:
    """Numbers of cells of one side, the same at every angle of the rotor."""

    pole: int  # across a pole, even
    slot: int  # across a slot, even


@lru_cache(maxsize=64)
def cells_of(section: CrossSection, grid: Grid, own: Poles, other: Poles) -> Cells:
    """As many as the angle asks for that needs most."""
    pole = slot = 0.0
    middle = own.pitch / 2
    for turn in np.linspace(0, other.pitch, N_TURNS):
        count = section.spacing(grid, own, other, turn).cells
        edges = count(np.array([-own.half, own.half, middle, own.pitch - own.half]))
        across = np.diff(edges)
        pole, slot = max(pole, across[0]), max(slot, across[1], across[2])
    return Cells(whole(pole, multiple=2), 2 * whole(slot))


def columns(own: Poles, spacing: Spacing, cells: Cells, n_poles: int) -> tuple[Array, Array]:
    """Columns of nodes of the first n_poles poles, as `angles` takes them."""
    at: Array = np.arange(n_poles, dtype=np.float64) * own.pitch
    low, middle, high = at + own.half, at + own.pitch / 2, at + own.pitch - own.half
    pole = spacing.split(at - own.half, low, cells.pole) - at[:, None]
    near, far = (spacing.split(*ends, cells.slot // 2) for ends in ((low, middle), (middle, high)))
    slot = np.hstack([near, far[:, 1:]]) - low[:, None]
    across = pole / own.half, slot / (own.pitch - 2 * own.half)
    return with_middles(across[0]), with_middles(across[1])[:, 1:-1]


def half_angle(half_width: float, r: Array, r_low: float, r_high: float) -> Array:
    """Half the angle of a pole with parallel sides at radii r; in the yoke as at its root [rad]."""
    return np.asarray(np.arcsin(half_width / np.clip(r, r_low, r_high)))


def rotor_mesh(section: CrossSection, grid: Grid, alpha: float, *, odd: bool) -> Mesh:
    """The rotor with a pole centred on angle 0, from the shaft to the gap, where it is turned by
    alpha [rad]."""
    s, own = section, section.rotor
    cells = cells_of(s, grid, own, s.stator)
    pole = s.r_rotor - away(s.h_r, None, grid.cell * s.gap, grid.growth)[::-1]
    yoke = np.geomspace(s.r_shaft, s.r_slot_r, grid.yoke + 1)
    r = radii(yoke, pole)
    half = half_angle(s.half_width_r, r, s.r_slot_r, s.r_rotor)
    n_poles = s.N_r // (s.n_sectors if odd else 1)
    spacing = s.spacing(grid, own, s.stator, -alpha)
    theta = angles(half, columns(own, spacing, cells, n_poles), own.pitch)

    def region(row: Integers, column: Integers) -> Integers:
        in_pole = column % (cells.pole + cells.slot) < cells.pole
        return np.where((row < grid.yoke) | in_pole, STEEL, AIR)

    u = np.repeat(np.log(r)[:, None], theta.shape[1], axis=1)
    return mapped(u, theta, region=region, gap_first=False, odd=odd)


def stator_mesh(section: CrossSection, grid: Grid, alpha: float, *, odd: bool) -> Mesh:
    """The stator with a pole centred on angle 0, from the gap to the outer diameter, where the
    rotor is turned by alpha [rad]."""
    s, own = section, section.stator
    cells = cells_of(s, grid, own, s.rotor)
    face = [np.array([s.r_ring_s, s.r_corner_s])] if s.flat_face else []
    height = s.r_slot_s - s.r_corner_s
    pole = s.r_corner_s + away(height, None, grid.cell * s.gap, grid.growth)
    n_air, n_pole = len(face), len(pole) - 1
    r = radii(*face, pole, np.geomspace(s.r_slot_s, s.r_out, grid.yoke + 1))
    n_poles = s.N_s // (s.n_sectors if odd else 1)
    half = half_angle(s.half_width_s, r, s.r_corner_s, s.r_slot_s)
    spacing = s.spacing(grid, own, s.rotor, alpha)
    theta = angles(half, columns(own, spacing, cells, n_poles), own.pitch)
    u = np.repeat(np.log(r)[:, None], theta.shape[1], axis=1)
    if s.flat_face:
        u = _to_flat_face(s, u, theta, own.pitch, cells=cells)
    n_per_pole = cells.pole + cells.slot

    def region(row: Integers, column: Integers) -> Integers:
        pole, place = column // n_per_pole, column % n_per_pole
        after = place < cells.pole + cells.slot // 2
        coil = np.where(after, COIL + 2 * pole, COIL + 2 * ((pole + 1) % n_poles) + 1)
        inside = np.where(place < cells.pole, STEEL, coil)
        slots = np.where(row < n_air, AIR, inside)
        return np.where(row >= n_air + n_pole, STEEL, slots)

    return mapped(u, theta, region=region, gap_first=True, odd=odd)


def radii(*parts: Array) -> Array:
    """Radii of the rows of nodes, from the edges of cells of parts that meet [m]."""
    edges = np.concatenate([parts[0], *(part[1:] for part in parts[1:])])
    return np.exp(with_middles(np.log(edges)))


def _to_flat_face(s: CrossSection, u: Array, theta: Array, pitch: float, *, cells: Cells) -> Array:
    """Rows in the poles moved so that those on the face lie in the plane x = r_bore."""
    column = np.arange(theta.shape[1]) % (2 * (cells.pole + cells.slot))
    in_pole = column <= 2 * cells.pole
    face = np.log(s.r_bore / np.cos(theta[2] - np.round(theta[2] / pitch) * pitch))
    ring, corner, floor = np.log(s.r_ring_s), np.log(s.r_corner_s), np.log(s.r_slot_s)
    near = ring + (u - ring) / (corner - ring) * (face - ring)
    within = face + (u - corner) / (floor - corner) * (floor - face)
    moved = np.where(u < corner, near, np.where(u < floor, within, u))
    return np.where(in_pole, moved, u)
