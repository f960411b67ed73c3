"""Sweep: dc-link voltage.

The rms torque error of cubic torque sharing over the dc-link voltage, at three speeds. Below a
certain voltage the phase currents cannot follow their references any more, and the error rises
steeply. That voltage grows with the speed: it has to overcome the back-EMF.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import reluctance as rl

DRIVE = Path(__file__).parents[1] / "sharing_cubic.toml"

volts, speeds = range(120, 401, 20), [1000, 1500, 2000]
vary = {"load.speed_rpm": speeds, "converter.u_dc_V": volts}
found = rl.sweep(rl.load(DRIVE), vary, until=0.06)
for speed, error in zip(speeds, found.figure("torque_error_rms").reshape(found.grid), strict=True):
    plt.semilogy(volts, 100 * error, ".-", label=f"{speed} rpm")
plt.xlabel("dc-link voltage (V)")
plt.ylabel("torque error, rms (%)")
plt.legend()
plt.show()
