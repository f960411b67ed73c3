"""Sweep: Pareto front.

Mean torque against copper loss of 400 combinations of turn-on angle, turn-off angle and current on
a 60 kW machine, spread evenly by a Sobol sequence. The upper edge of the cloud is the best that
fixed angles can do: no other point has more torque for the same loss.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import reluctance as rl

DRIVE = Path(__file__).parents[1] / "hysteresis_200A.toml"

ranges = {
    "control.theta_on_deg": (-30, 40),
    "control.theta_off_deg": (90, 160),
    "control.i_ref_A": (40, 300),
}
found = rl.sweep(rl.load(DRIVE), ranges, sobol=400, until=0.1)
plt.scatter(found.figure("p_cu"), found.figure("tau_mean"), c=found.values["control.theta_on_deg"])
plt.colorbar(label="turn-on angle (deg el.)")
plt.gca().set(xlabel="copper loss (W)", ylabel="mean torque (N m)", xscale="log")
plt.show()
