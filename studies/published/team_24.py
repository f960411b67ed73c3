"""Question: how near does the plane field come to the measured torque of TEAM workshop problem 24?

    python studies/published/team_24.py

Two poles on two, locked at 22 deg, 7.41 A. The stack of 25.4 mm is half as long as the rotor's
radius; the field at its ends, which a plane field does not have, adds torque. Nothing is tuned.
"""

from __future__ import annotations

import numpy as np
from figure import Figure, rows, show
from scipy.constants import mu_0

from reluctance.machine.geometry.cross_section import CrossSection
from reluctance.machine.geometry.mesh import Grid
from reluctance.machine.geometry.position import at_angle
from reluctance.machine.geometry.solve import solve
from reluctance.machine.geometry.steel import Steel
from reluctance.machine.geometry.system import assemble
from reluctance.machine.geometry.winding import Coil, Winding

MM = 1e-3

# EN9 steel of TEAM problem 24 above its knee [A/m, T].
BH = [
    (4000, 1.413),
    (8010, 1.594),
    (16010, 1.751),
    (24020, 1.839),
    (32030, 1.896),
    (40030, 1.936),
    (48040, 1.967),
    (64050, 2.008),
    (80070, 2.042),
    (96080, 2.073),
    (112100, 2.101),
    (128110, 2.127),
    (144120, 2.150),
    (176150, 2.197),
]
# Below: H/(a + b H) + mu_0 H through 0 and the first three points, scaled to meet the first.
LOW_A, LOW_B, SCALE = 708.7766, 0.5365555, 1.004923


def torque() -> float:
    """Locked at 22 deg, 7.41 A, 350 turns a pole [N m]."""
    section = CrossSection(
        N_s=2,
        N_r=2,
        r_shaft=25.4 * MM,
        r_rotor=51.05 * MM,
        r_bore=53.75 * MM,
        r_out=104.5 * MM,
        beta_s=2 * np.arcsin(13.9 / 53.75),
        beta_r=2 * np.arcsin(12.7 / 51.05),
        h_s=(83.1 - 53.75) * MM,
        h_r=(51.05 - 38.1) * MM,
        flat_face=False,
    )
    low = np.linspace(0, 4000, 8)[:-1]
    B_low = SCALE * (low / (LOW_A + LOW_B * low) + mu_0 * low)
    H, B = np.array(BH).T
    steel = Steel(np.append(low, H), np.append(B_low, B))
    coil = Coil(from_middle=17 * MM, width=24 * MM, r_inner=54.5 * MM, height=17 * MM)
    winding = Winding(1, (1, -1), turns=350, parallel_paths=1, coil=coil)
    system = assemble(section, steel, winding, stack=25.4 * MM, grid=Grid())
    return solve(at_angle(system, np.radians(-22)), np.array([7.41])).tau


def figures() -> list[Figure]:
    """The measured torque."""
    return [Figure("TEAM 24: torque at 22 deg", "N m", "measured", 3.22, torque())]


if __name__ == "__main__":
    show(rows("team_24", figures()))
