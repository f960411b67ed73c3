"""Question: has an 8/6 machine from its dimensions the torque of a commercial 2-D field solver?

    python studies/published/emdlab_8_6.py

EMDLAB's example (examples/switched-reluctance-machine at commit 0e0a752): 3.6 A in one phase, 30
angles from unaligned to aligned. Figures are cited, not copied from data files. The source does not
state how fine its mesh is.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from figure import Figure, rows, show

from reluctance.machine.geometry.cross_section import CrossSection
from reluctance.machine.geometry.mesh import Grid
from reluctance.machine.geometry.position import at_angle
from reluctance.machine.geometry.solve import solve
from reluctance.machine.geometry.steel import Steel
from reluctance.machine.geometry.system import System, assemble
from reluctance.machine.geometry.winding import Winding

MM = 1e-3

# H [A/m] and B [T] of M530-50A in EMDLAB's library, every eighth point or so.
BH = [
    (0, 0),
    (6.407, 0.005965),
    (16.63, 0.01756),
    (26.81, 0.03269),
    (48.21, 0.08646),
    (64.98, 0.176),
    (75.7, 0.2764),
    (83.8, 0.3745),
    (91.25, 0.4753),
    (100.3, 0.5908),
    (109.4, 0.6966),
    (119.2, 0.7943),
    (130.3, 0.8862),
    (146, 0.9883),
    (166.6, 1.084),
    (200.3, 1.186),
    (264.1, 1.288),
    (369.1, 1.366),
    (606.9, 1.436),
    (1211, 1.504),
    (2135, 1.562),
    (3809, 1.638),
    (5523, 1.697),
    (8674, 1.77),
    (15170, 1.849),
    (25770, 1.908),
    (47910, 1.968),
    (92220, 2.042),
    (128100, 2.093),
    (261700, 2.268),
]
# At 0 (unaligned) to 30 deg in equal steps, 3.6 A [N m].
# fmt: off
TAU = [
    0.0006, 0.0931, 0.1886, 0.2920, 0.4080, 0.5496, 0.7256, 0.9651,
    1.3035, 1.8675, 2.8423, 4.2402, 4.9754, 5.1522, 5.2360, 5.3053,
    5.2940, 5.2276, 5.2168, 5.2058, 5.0334, 4.7788, 4.5359, 4.1158,
    3.5088, 2.9798, 2.4959, 1.7555, 0.5478, 0.0050,
]
# fmt: on


@cache
def system() -> System:
    """8/6: 74 mm bore, 0.5 mm gap, 70 mm stack, 278 turns a coil."""
    section = CrossSection(
        N_s=8,
        N_r=6,
        r_shaft=10 * MM,
        r_rotor=36.5 * MM,
        r_bore=37 * MM,
        r_out=62.5 * MM,
        beta_s=np.radians(17.1),
        beta_r=np.radians(19.8),
        h_s=(62.5 - 37 - 7.7) * MM,
        h_r=(36.5 - 10 - 7.53) * MM,
        flat_face=False,
    )
    coils = Winding(4, (1, 1, 1, 1, -1, -1, -1, -1), turns=278, parallel_paths=1)
    H, B = np.array(BH).T
    return assemble(section, Steel(H, B), coils, stack=70 * MM, grid=Grid())


@cache
def torque() -> np.ndarray:
    """At the angles of TAU [N m]."""
    i = np.array([3.6, 0, 0, 0])
    positions = (at_angle(system(), np.radians(x)) for x in np.linspace(-30, 0, 30))
    return np.array([solve(position, i, tolerance=1e-5).tau for position in positions])


def figures() -> list[Figure]:
    """Mean and peak over the angles."""
    tau, own = np.array(TAU), torque()
    return [
        Figure("EMDLAB 8/6: mean torque", "N m", "computed", tau.mean(), own.mean()),
        Figure("EMDLAB 8/6: peak torque", "N m", "computed", tau.max(), own.max()),
    ]


if __name__ == "__main__":
    show(rows("emdlab_8_6", figures()))
