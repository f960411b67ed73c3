"""Sweep: current band.

The band of hysteresis current control trades torque ripple for switching frequency. Each point is a
band between 0.3 and 4 A, at three dc-link voltages. A higher voltage costs switching frequency at
the same ripple, and lets the narrowest bands reach less ripple.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import reluctance as rl

DRIVE = Path(__file__).parents[1] / "sharing_cubic.toml"

bands = [0.3, 0.5, 0.75, 1, 1.5, 2, 3, 4]
vary = {"converter.u_dc_V": [200, 240, 300], "control.i_band_A": bands}
found = rl.sweep(rl.load(DRIVE), vary)
for n, u_dc in enumerate([200, 240, 300]):
    f, ripple = (found.figure(x).reshape(found.grid)[n] for x in ("f_switch", "torque_ripple_rms"))
    plt.plot(f / 1e3, 100 * ripple, "o-", label=f"{u_dc} V")
plt.xlabel("switching frequency (kHz)")
plt.ylabel("torque ripple, rms (%)")
plt.legend()
plt.show()
