"""Dead time.

A switch turns on later than ordered by the dead time; it turns off at once. Laws that time their
turn-ons inside a sample (`deadbeat`, `edge_mpc`, `pwm_current`) have dead-time compensation: they
order each turn-on earlier by the dead time. Up to 3 µs of the 20 µs sample their torque hardly
changes. From 4 µs on too many edges would have to come before the start of the sample, and the
error grows. Comparators cannot anticipate: every turn-on of torque sharing is late, and its mean
torque falls in proportion to the dead time.

An asymmetric half bridge with plain diodes needs no dead time. Synchronous rectification does.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import reluctance as rl

EXAMPLES = Path(__file__).parents[1]
LAWS = {
    "sharing_cubic": "cubic torque sharing",
    "deadbeat": "deadbeat flux control",
    "edge_mpc_mcu": "edge_mpc",
}
DEAD_TIMES = (0, 1, 2, 3, 4, 5)  # [us]

figure, (left, right) = plt.subplots(1, 2)
for name, label in LAWS.items():
    runs = [
        rl.simulate(
            rl.load(EXAMPLES / f"{name}.toml", [f"converter.dead_time_us={dead}"]), record=None
        )
        for dead in DEAD_TIMES
    ]
    left.plot(DEAD_TIMES, [run.kpis.tau_mean for run in runs], "o-", label=label)
    right.plot(DEAD_TIMES, [100 * run.kpis.torque_error_rms for run in runs], "o-", label=label)
left.axhline(41.339, color="k", ls="--", lw=0.8)
left.set(xlabel="dead time (µs)", ylabel="mean torque (N m)")
right.set(xlabel="dead time (µs)", ylabel="rms torque error (%)", ylim=(0, None))
right.legend()
plt.show()
