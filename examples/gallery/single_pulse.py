"""Single pulse at high speed.

At 3000 rpm the back-EMF of the paper's machine is so high that the current cannot be held in a
band. Each phase gets one voltage pulse per electrical period, from the turn-on to the turn-off
angle. Earlier turn-on gives the current more time to rise before the poles overlap: the peak
current and the torque grow. Turn-off stays at 110 degrees (electrical; 0 is unaligned).

The current that turns on before the unaligned position first makes a little negative torque.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import reluctance as rl

DRIVE = Path(__file__).parents[1] / "single_pulse.toml"
N_R = 4  # rotor poles: electrical degrees per mechanical degree

figure, (left, right) = plt.subplots(1, 2, sharex=True)
for theta_on in (-30, -15, 0, 15, 30):
    drive = rl.load(DRIVE, [f"control.theta_on_deg={theta_on}"])
    result = rl.simulate(drive)
    angle = np.degrees(N_R * result.theta_m)
    start = 360 * (angle[-1] // 360 - 1) - 60
    shown = (angle > start) & (angle < start + 360)
    label = f"{theta_on}°: {result.kpis.tau_mean:.1f} N m"
    left.plot(angle[shown] - start - 60, result.i[0][shown])
    right.plot(angle[shown] - start - 60, result.tau_ph[0][shown], label=label)
left.set(ylabel="current of phase a (A)", xticks=range(-60, 301, 60))
right.set(ylabel="torque of phase a (N m)")
figure.supxlabel("electrical angle (deg)")
right.legend(title="turn-on: mean torque")
plt.show()
