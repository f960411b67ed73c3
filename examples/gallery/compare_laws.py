"""Comparison of control laws.

The picture shows the torque of one electrical period at the rated point of the paper's machine:
1500 rpm, 41.339 N m, 240 V. Flat current pulses leave a dip at each commutation. A torque sharing
function removes most of it. The predictive law `edge_mpc` plans the switching instants themselves.

The four drives sample at different rates and switch at different frequencies, which the titles
state. `reluctance compare` tunes every law to one switching frequency; the page on
[control laws](../control/laws.md) has its tables.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import reluctance as rl

EXAMPLES = Path(__file__).parents[1]
LAWS = {
    "pwm_current": "flat current pulses, PWM",
    "sharing_cubic": "cubic torque sharing",
    "deadbeat": "deadbeat flux control",
    "edge_mpc_mcu": "edge_mpc, 20 µs, one sample late",
}
PERIOD = 60 / 1500 / 4  # one electrical period, with four rotor poles [s]

figure, axes = plt.subplots(2, 2, sharex=True, sharey=True, figsize=(9, 5))
for ax, (name, title) in zip(axes.flat, LAWS.items(), strict=True):
    result = rl.simulate(rl.load(EXAMPLES / f"{name}.toml"))
    kpis = result.kpis.with_units()
    last = result.t > result.t[-1] - PERIOD
    ax.plot(1e3 * (result.t[last] - result.t[last][0]), result.tau[last], lw=0.8)
    ax.axhline(41.339, color="k", ls="--", lw=0.8)
    error, f_switch = kpis["torque_error_rms"], kpis["f_switch_Hz"]
    ax.set_title(f"{title}\nrms error {error:.2%} at {f_switch / 1e3:.1f} kHz per switch")
axes[0, 0].set(ylim=(20, 50), xticks=range(0, 11, 2))
figure.supxlabel("time (ms)")
figure.supylabel("torque (N m)")
plt.show()
