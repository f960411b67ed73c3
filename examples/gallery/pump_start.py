"""Start of a pump.

The source paper's application: a centrifugal pump, whose torque grows with the square of the
speed. The speed loop takes the drive from standstill to 1500 rpm. The torque reference stays at its
limit of 45 N m until the speed approaches its reference. Then it falls to the torque of pump and
friction.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import reluctance as rl

result = rl.simulate(rl.load(Path(__file__).parents[1] / "paper_pump.toml"), record=20e-6)
figure, (top, bottom) = plt.subplots(2, 1, sharex=True, figsize=(8, 5))
top.plot(result.t, result.omega_m * 30 / np.pi)
top.axhline(1500, color="k", ls="--", lw=0.8)
top.set(ylabel="speed (rpm)")
bottom.plot(result.t, result.tau, lw=0.5, label="torque of the machine")
bottom.plot(result.t, 0.0015 * result.omega_m**2, label="torque of the pump")
bottom.set(xlabel="time (s)", ylabel="torque (N m)")
bottom.legend()
plt.show()
