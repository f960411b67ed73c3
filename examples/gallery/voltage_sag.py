"""Voltage sag.

The dc-link voltage falls from 240 V to 162 V for 30 ms, at 1500 rpm and 41.339 N m. Cubic torque
sharing needs more voltage at each commutation than is left, and the torque error grows. `edge_mpc`
has reference profiles for several speeds (`guide_speed_rpm`), and a lower voltage acts as a higher
speed: after a short transient it holds the torque with another current waveform. A deeper sag
leaves too little voltage for this torque; change `source.values` to see it.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import reluctance as rl

EXAMPLES = Path(__file__).parents[1]
SAG = [
    "source.t_s=[0, 0.04, 0.04, 0.07, 0.07, 0.1]",
    "source.values=[240, 240, 162, 162, 240, 240]",
]
LAWS = {
    "sharing_cubic": ("cubic torque sharing", []),
    "edge_mpc_mcu": ("edge_mpc", ["control.guide_speed_rpm=[1500, 1800, 2100, 2400, 2550, 2700]"]),
}

figure, axes = plt.subplots(3, 1, sharex=True, figsize=(8, 6.5), height_ratios=(1, 2, 2))
for (name, (label, settings)), ax in zip(LAWS.items(), axes[1:], strict=True):
    result = rl.simulate(rl.load(EXAMPLES / f"{name}.toml", [*SAG, *settings]), until=0.1)
    ax.plot(1e3 * result.t, result.tau, lw=0.6)
    ax.axhline(41.339, color="k", ls="--", lw=0.8)
    ax.set(ylabel="torque (N m)", title=label, ylim=(36, 47))
axes[0].plot(1e3 * result.t, result.u_dc, color="C1")
axes[0].set(ylabel="dc link (V)", ylim=(0, 260))
axes[2].set(xlabel="time (ms)", xlim=(20, 100))
plt.show()
