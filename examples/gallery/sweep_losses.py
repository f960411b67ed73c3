"""Sweep: where the losses are.

Losses of a five-phase drive by kind over speed, at constant torque: copper and conduction of the
devices depend on the current alone, switching and iron losses grow with the speed. One sweep gives
all of them, because every key figure of a run is stored.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import reluctance as rl

DRIVE = Path(__file__).parents[1] / "five_phases_losses.toml"

speeds = range(200, 2401, 200)
found = rl.sweep(rl.load(DRIVE), {"load.speed_rpm": speeds}, until=0.06)
kinds = {"copper": "p_cu", "devices": "p_dev", "switching": "p_sw", "iron": "p_fe"}
losses = [found.figure(name) for name in kinds.values()]
plt.stackplot(speeds, losses, labels=list(kinds))
plt.xlabel("speed (rpm)")
plt.ylabel("loss (W)")
plt.legend(loc="upper left")
plt.show()
