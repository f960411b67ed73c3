"""Load step.

The speed loop holds the paper's machine at 1000 rpm. At 0.15 s the load torque rises from 5 to
30 N m, at 0.3 s it falls back. The speed dips until the speed loop has taken up the load. By
default an observer finds the load torque, and the gain follows from the lags of the drive. The
other curve is a proportional and integral controller of 20 Hz, set by `speed_bandwidth_Hz`.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import reluctance as rl

DRIVE = Path(__file__).parents[1] / "paper_pump.toml"
TIMES, TORQUES = [0, 0.15, 0.15, 0.3, 0.3, 0.45], [5, 5, 30, 30, 5, 5]

figure, (top, bottom) = plt.subplots(2, 1, sharex=True, figsize=(8, 5.5))
for name, loop in (("by rule", []), ("20 Hz", ["control.speed_bandwidth_Hz=20"])):
    drive = rl.load(
        DRIVE,
        [
            "load.kind=torque",
            "load.k_pump_Nms2=",
            f"load.t_s={TIMES}",
            f"load.values={TORQUES}",
            "load.speed_rpm=1000",
            "load.J_kgm2=0.02",
            "reference.speed_rpm=1000",
            *loop,
        ],
    )
    result = rl.simulate(drive, until=0.45, record=20e-6)
    top.plot(result.t, result.omega_m * 30 / np.pi, label=name)
    bottom.plot(result.t, result.tau, lw=0.4)
top.set(ylabel="speed (rpm)")
top.legend(title="speed loop")
bottom.plot(TIMES, TORQUES, "k--", lw=1, label="load torque")
bottom.set(xlabel="time (s)", ylabel="torque (N m)")
bottom.legend()
plt.show()
