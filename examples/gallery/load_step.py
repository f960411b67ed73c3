"""Load step.

The speed loop holds the paper's machine at 1000 rpm. At 0.15 s the load torque rises from 5 to
30 N m, at 0.3 s it falls back. The speed dips until the integral of the speed loop has taken up the
load. The bandwidth of the loop decides how deep the dip is: 10 Hz and 20 Hz are shown.
`speed_bandwidth_Hz` sets it; 20 Hz is the default.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import reluctance as rl

DRIVE = Path(__file__).parents[1] / "paper_pump.toml"
TIMES, TORQUES = [0, 0.15, 0.15, 0.3, 0.3, 0.45], [5, 5, 30, 30, 5, 5]

figure, (top, bottom) = plt.subplots(2, 1, sharex=True, figsize=(8, 5.5))
for bandwidth in (10, 20):
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
            f"control.speed_bandwidth_Hz={bandwidth}",
        ],
    )
    result = rl.simulate(drive, until=0.45, record=20e-6)
    top.plot(result.t, result.omega_m * 30 / np.pi, label=f"{bandwidth} Hz")
    bottom.plot(result.t, result.tau, lw=0.4)
top.set(ylabel="speed (rpm)")
top.legend(title="bandwidth")
bottom.plot(TIMES, TORQUES, "k--", lw=1, label="load torque")
bottom.set(xlabel="time (s)", ylabel="torque (N m)")
bottom.legend()
plt.show()
