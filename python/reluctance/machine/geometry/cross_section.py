"""The cross-section of a machine: dimensions in SI, and the meshes of its stator and rotor."""

from __future__ import annotations

from dataclasses import dataclass
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
    graded,
    mapped,
    pole_columns,
    with_middles,
)
from reluctance.machine.geometry.steel import Array

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
    def pole_over_gap(self) -> float:
        """Width of the wider pole in lengths of the gap."""
        return 2 * max(self.half_width_s, self.half_width_r) / self.gap

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


def half_angle(half_width: float, r: Array, r_low: float, r_high: float) -> Array:
    """Half the angle of a pole with parallel sides at radii r; in the yoke as at its root [rad]."""
    return np.asarray(np.arcsin(half_width / np.clip(r, r_low, r_high)))


def rotor_mesh(section: CrossSection, grid: Grid, *, odd: bool) -> Mesh:
    """The rotor with a pole centred on angle 0, from the shaft to the gap."""
    s = section
    r = radii(
        (s.r_shaft, s.r_slot_r, grid.yoke, "none", grid.growth),
        (s.r_slot_r, s.r_rotor, grid.rotor_pole, "last", grid.growth),
    )
    n_poles = s.N_r // (s.n_sectors if odd else 1)
    half = half_angle(s.half_width_r, r, s.r_slot_r, s.r_rotor)
    theta = angles(half, pole_columns(grid), 2 * np.pi / s.N_r, n_poles)

    def region(row: Integers, column: Integers) -> Integers:
        in_pole = column % (grid.pole + grid.slot) < grid.pole
        return np.where((row < grid.yoke) | in_pole, STEEL, AIR)

    u = np.repeat(np.log(r)[:, None], theta.shape[1], axis=1)
    return mapped(u, theta, region=region, gap_first=False, odd=odd)


def stator_mesh(section: CrossSection, grid: Grid, *, odd: bool) -> Mesh:
    """The stator with a pole centred on angle 0, from the gap to the outer diameter."""
    s = section
    face = [(s.r_ring_s, s.r_corner_s, 1, "none", 1.0)] if s.flat_face else []
    r = radii(
        *face,
        (s.r_corner_s, s.r_slot_s, grid.stator_pole, "first", grid.growth),
        (s.r_slot_s, s.r_out, grid.yoke, "none", grid.growth),
    )
    n_poles = s.N_s // (s.n_sectors if odd else 1)
    pitch = 2 * np.pi / s.N_s
    half = half_angle(s.half_width_s, r, s.r_corner_s, s.r_slot_s)
    columns = pole_columns(grid)
    theta = angles(half, columns, pitch, n_poles)
    u = np.repeat(np.log(r)[:, None], theta.shape[1], axis=1)
    n_air = len(face)
    if s.flat_face:
        u = _to_flat_face(s, u, theta, pitch, n_nodes_pole=len(columns[0]), grid=grid)
    n_per_pole = grid.pole + grid.slot

    def region(row: Integers, column: Integers) -> Integers:
        pole, place = column // n_per_pole, column % n_per_pole
        after = place < grid.pole + grid.slot // 2
        coil = np.where(after, COIL + 2 * pole, COIL + 2 * ((pole + 1) % n_poles) + 1)
        inside = np.where(place < grid.pole, STEEL, coil)
        slots = np.where(row < n_air, AIR, inside)
        return np.where(row >= n_air + grid.stator_pole, STEEL, slots)

    return mapped(u, theta, region=region, gap_first=True, odd=odd)


def radii(*parts: tuple[float, float, int, str, float]) -> Array:
    """Radii of the rows of nodes over (from, to, cells, graded ends, growth), equal in ln r where
    not graded."""
    edges = [
        np.log(low) + np.log(high / low) * graded(n, growth, ends=ends)
        for low, high, n, ends, growth in parts
    ]
    return np.exp(with_middles(np.concatenate([edges[0], *(part[1:] for part in edges[1:])])))


def _to_flat_face(
    s: CrossSection, u: Array, theta: Array, pitch: float, *, n_nodes_pole: int, grid: Grid
) -> Array:
    """Rows in the poles moved so that those on the face lie in the plane x = r_bore."""
    n_per_pole = 2 * (grid.pole + grid.slot)
    column = np.arange(theta.shape[1]) % n_per_pole
    in_pole = column < n_nodes_pole
    face = np.log(s.r_bore / np.cos(theta[2] - np.round(theta[2] / pitch) * pitch))
    ring, corner, floor = np.log(s.r_ring_s), np.log(s.r_corner_s), np.log(s.r_slot_s)
    near = ring + (u - ring) / (corner - ring) * (face - ring)
    within = face + (u - corner) / (floor - corner) * (floor - face)
    moved = np.where(u < corner, near, np.where(u < floor, within, u))
    return np.where(in_pole, moved, u)
