"""Sweep: tolerances.

A Monte Carlo study of series production: 200 drives whose machine and angle sensor differ at random
from what the control knows, flux linkage by 5 %, resistance by 20 %, the angle by 2 deg electrical.
The histogram says how many drives of the series have which torque error.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import reluctance as rl

DRIVE = Path(__file__).parents[1] / "sharing_cubic.toml"

tolerances = {
    "mismatch.flux_factor": (0.95, 1.05),
    "mismatch.R_factor": (0.8, 1.2),
    "mismatch.angle_offset_deg": (-2.0, 2.0),
}
found = rl.sweep(rl.load(DRIVE), tolerances, random=200, until=0.06)
plt.hist(100 * found.figure("torque_error_rms"), bins=25)
plt.xlabel("torque error, rms (%)")
plt.ylabel("drives")
plt.show()
