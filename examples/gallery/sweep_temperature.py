"""Sweep: winding temperature.

Efficiency over torque of a five-phase machine with a cold, a warm and a hot winding. Its resistance
rises by 39 % from 20 to 120 degC, and copper loss with it; conduction, switching and iron losses
stay.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import reluctance as rl

DRIVE = Path(__file__).parents[1] / "five_phases_losses.toml"

torques, temperatures = [0.5, 1, 2, 3, 4, 5, 6], [20, 70, 120]
vary = {"machine.temp_w_degC": temperatures, "reference.tau_Nm": torques}
found = rl.sweep(rl.load(DRIVE), vary, until=0.06)
for T, eta in zip(temperatures, found.figure("efficiency").reshape(found.grid), strict=True):
    plt.plot(torques, 100 * eta, "o-", label=f"{T} degC")
plt.xlabel("torque (N m)")
plt.ylabel("efficiency (%)")
plt.legend()
plt.show()
