"""Sweep: wrong machine model.

Deadbeat control computes with a model of the machine. Here the model has too much or too little
flux linkage and resistance, from 70 % to 130 %. The torque error depends on the flux linkage, which
therefore is worth measuring; a wrong resistance, as of a warm winding, has little effect.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import reluctance as rl

DRIVE = Path(__file__).parents[1] / "deadbeat.toml"

factors = [0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3]
vary = {"mismatch.R_factor": factors, "mismatch.flux_factor": factors}
found = rl.sweep(rl.load(DRIVE), vary, until=0.06)
error = 100 * found.figure("torque_error_rms").reshape(found.grid)
plt.pcolormesh(factors, factors, error)
plt.colorbar(label="torque error, rms (%)")
plt.xlabel("flux linkage: model over machine")
plt.ylabel("resistance: model over machine")
plt.show()
