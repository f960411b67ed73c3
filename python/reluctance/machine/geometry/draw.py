"""The cross-section as a drawing, and the field in it as a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.collections import PolyCollection

from reluctance.machine.geometry.mesh import COIL, STEEL
from reluctance.machine.geometry.position import Side, at_angle
from reluctance.machine.geometry.solve import Field
from reluctance.machine.geometry.steel import Array
from reluctance.machine.geometry.system import System

if TYPE_CHECKING:
    from matplotlib.axes import Axes

STEEL_COLOUR = "0.75"
B_SHOWN = 2.2  # end of the colour scale [T]
N_LINES = 24  # field lines between the extremes of the potential
OUTLINE = [0, 3, 1, 4, 2, 5]  # of an element: corners and middles in order


def draw(system: System, axes: Axes, *, alpha: float = 0.0) -> Axes:
    """Cross-section with the coils of each phase in a colour; the rotor turned by alpha [rad].
    Lengths in mm."""
    n_phases = system.winding.n_phases
    position = at_angle(system, alpha)
    for side, turn in ((position.rotor, alpha), (position.stator, 0.0)):
        region = side.mesh.region
        for copy in range(_copies(system)):
            outline = _outlines(side, turn + copy * position.gap.sector)
            _fill(axes, outline[region == STEEL], STEEL_COLOUR)
            first = copy * system.section.N_s // _copies(system)
            for k in range(n_phases):
                of_phase = (region >= COIL) & ((first + (region - COIL) // 2) % n_phases == k)
                _fill(axes, outline[of_phase], f"C{k}")
    return _finished(axes, system)


def draw_field(field: Field, axes: Axes) -> Axes:
    """|B| in colours, and lines of the vector potential, along which the field runs; over the
    sector that was solved. Lengths in mm."""
    position = field.position
    system = position.system
    potential = np.append(field.A, 0.0)
    levels = np.linspace(potential.min(), potential.max(), N_LINES + 2)[1:-1]
    drawn = None
    for side, numbers, turn in (
        (position.rotor, system.rotor, position.alpha),
        (position.stator, system.stator, 0.0),
    ):
        of_elements = potential[numbers.of_elements]
        B = np.einsum("eqdi,ei->eqd", side.elements.gradient, of_elements)
        drawn = PolyCollection(list(_outlines(side, turn)), rasterized=True, linewidths=0.4)
        drawn.set_array(np.hypot(B[..., 0], B[..., 1]).mean(axis=1))
        drawn.set_edgecolor("face")
        drawn.set_clim(0, B_SHOWN)
        axes.add_collection(drawn)
        x, y = _places(side, turn)
        nodes = potential[numbers.unknown] * side.mesh.sign
        axes.contour(x, y, nodes, levels=levels, colors="white", linewidths=0.6, linestyles="solid")
    if drawn is not None:
        axes.figure.colorbar(drawn, ax=axes, label="|B| [T]", shrink=0.8)
    return _finished(axes, system)


def _copies(system: System) -> int:
    """Sectors in the machine."""
    return system.section.n_sectors if system.odd else 1


def _places(side: Side, turn: float) -> tuple[Array, Array]:
    """Nodes, turned [mm]."""
    r, theta = 1e3 * np.exp(side.mesh.u), side.mesh.theta + turn
    return r * np.cos(theta), r * np.sin(theta)


def _outlines(side: Side, turn: float) -> Array:
    """(n_e, 6, 2) of the elements [mm]."""
    nodes = side.mesh.elements[:, OUTLINE]
    x, y = (part.ravel()[nodes] for part in _places(side, turn))
    return np.stack([x, y], axis=-1)


def _fill(axes: Axes, outlines: Array, colour: str) -> None:
    axes.add_collection(
        PolyCollection(list(outlines), facecolor=colour, edgecolor=colour, linewidths=0.3)
    )


def _finished(axes: Axes, system: System) -> Axes:
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_xlabel("x [mm]")
    axes.set_ylabel("y [mm]")
    return axes
