"""Sweep: conduction angles.

Efficiency of single pulses at 3000 rpm over turn-on and turn-off angle, from 17 x 13 runs. White
lines are equal mean torque. Along each line one turn-off angle has the highest efficiency, and it
moves later as the torque grows: 120 deg at 10 N m, 145 deg at 40 N m.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import reluctance as rl

DRIVE = Path(__file__).parents[1] / "single_pulse.toml"

on, off = range(-30, 51, 5), range(90, 151, 5)
found = rl.sweep(rl.load(DRIVE), {"control.theta_on_deg": on, "control.theta_off_deg": off})
eta, tau = (found.figure(name).reshape(found.grid) for name in ("efficiency", "tau_mean"))
plt.pcolormesh(off, on, 100 * eta)
plt.colorbar(label="efficiency (%)")
plt.clabel(plt.contour(off, on, tau, colors="white"), fmt="%g N m")
plt.xlabel("turn-off angle (deg el.)")
plt.ylabel("turn-on angle (deg el.)")
plt.show()
