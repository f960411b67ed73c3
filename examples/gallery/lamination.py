"""From a lamination to a drive.

The left panel is the cross-section of a 12/8 machine of the library, drawn from its geometry file;
each colour is a phase. The middle panel is the field of one phase in the quarter that is solved:
flux density in colours, and lines along which the field runs. `rl.machine_from_geometry` solves it
over current and angle. The right panel shows two results: the torque of one phase, and the radial
force on one of its poles, which grows up to alignment and deforms the stator.

[From a drawing to a running drive](../geometry.md) explains the file and the command.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import reluctance as rl

GEOMETRY = Path(__file__).parents[2] / "machines" / "geometry" / "own_12_8.toml"

found = rl.machine_from_geometry(GEOMETRY)
print("\n".join(found.lines()))

figure, (left, middle, right) = plt.subplots(1, 3, figsize=(13, 4.2), layout="constrained")
found.draw(left)
found.draw_field(middle)
solution = found.solution
angle = np.degrees(solution.theta_e)
for row, style in ((len(solution.i) // 2, "--"), (-1, "-")):
    label = f"{solution.i[row]:g} A"
    right.plot(angle, solution.tau[row], style, color="C0", label=f"torque (N m), {label}")
    force = solution.pole_force[row] / 100
    right.plot(angle, force, style, color="C1", label=f"radial force (100 N), {label}")
right.set(xlabel="angle from unaligned (deg el.)", xticks=range(0, 181, 45))
figure.legend(loc="outside lower center", ncols=4, fontsize=7)
plt.show()
