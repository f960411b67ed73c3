"""Sweep: torque over speed.

The mean torque that three control laws hold when they are asked for 41.339 N m, over speed, each
with its default values. Above 2500 rpm the dc link cannot move the current along its reference any
more: cubic torque sharing and deadbeat control lose torque first. `ditc` switches its legs by the
torque itself; it stays a little below its reference, and holds more torque at high speed.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import reluctance as rl

DRIVE = Path(__file__).parents[1] / "sharing_cubic.toml"

speeds = range(500, 3501, 250)
laws = ["torque_sharing", "ditc", "deadbeat"]
found = rl.sweep(rl.load(DRIVE), {"control.law": laws, "load.speed_rpm": speeds}, until=0.06)
for law, tau in zip(laws, found.figure("tau_mean").reshape(found.grid), strict=True):
    plt.plot(speeds, tau, ".-", label=law)
plt.xlabel("speed (rpm)")
plt.ylabel("mean torque (N m)")
plt.legend()
plt.show()
