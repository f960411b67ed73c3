"""Model mismatch.

The controller's flux map is wrong by a factor from 0.8 to 1.2, while the machine stays the same.
Every law that computes the torque from the map loses or gains mean torque in proportion: a map
that is too high makes the controller apply too little current. The torque ripple of `edge_mpc` and
of deadbeat control hardly changes.

The other entries of the `[mismatch]` table are `R_factor` and `angle_offset_deg`.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import reluctance as rl

EXAMPLES = Path(__file__).parents[1]
LAWS = {
    "sharing_cubic": "cubic torque sharing",
    "deadbeat": "deadbeat flux control",
    "edge_mpc_mcu": "edge_mpc",
}
FACTORS = np.linspace(0.8, 1.2, 5)

figure, (left, right) = plt.subplots(1, 2)
for name, label in LAWS.items():
    runs = [
        rl.simulate(
            rl.load(EXAMPLES / f"{name}.toml", [f"mismatch.flux_factor={factor}"]), record=None
        )
        for factor in FACTORS
    ]
    left.plot(FACTORS, [run.kpis.tau_mean for run in runs], "o-", label=label)
    right.plot(FACTORS, [100 * run.kpis.torque_ripple_rms for run in runs], "o-", label=label)
left.axhline(41.339, color="k", ls="--", lw=0.8)
left.set(ylabel="mean torque (N m)")
right.set(ylabel="rms torque ripple (% of mean)")
figure.supxlabel("flux of the model over flux of the machine")
right.set_ylim(bottom=0)
right.legend()
plt.show()
