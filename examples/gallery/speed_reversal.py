"""Speed reversal and braking.

The speed loop takes the paper's machine from standstill to 1000 rpm, then to -1000 rpm. From 0.3 s
on the torque opposes the rotation: the machine brakes. Its copper loss takes up nearly all of the
kinetic energy, so the power from the dc link (lower panel) falls to about zero. A constant load
torque of 5 N m acts against positive rotation throughout. At -1000 rpm it drives the machine, which
then returns a little power to the dc link.

The drive file closes the speed loop around the torque reference; `tau_max_Nm` limits the torque to
±45 N m. The dc link here is stiff. On a real one the returned energy raises the voltage, unless a
chopper or a battery takes it.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import reluctance as rl

drive = rl.load(
    Path(__file__).parents[1] / "paper_pump.toml",
    [
        "load.kind=torque",
        "load.k_pump_Nms2=",
        "load.tau_Nm=5",
        "load.J_kgm2=0.02",
        "reference.speed_rpm=",
        "reference.t_s=[0, 0.05, 0.3, 0.5, 0.9]",
        "reference.values=[0, 1000, 1000, -1000, -1000]",
    ],
)
result = rl.simulate(drive, until=0.9)
speed = result.omega_m * 30 / np.pi
wanted = np.interp(result.t, [0, 0.05, 0.3, 0.5, 0.9], [0, 1000, 1000, -1000, -1000])

# With ideal switches the power from the dc link is that at the windings; u is constant in a step.
i_mean = (result.i[:, 1:] + result.i[:, :-1]) / 2
energy = np.cumsum(np.sum(result.u[:, :-1] * i_mean, axis=0) * np.diff(result.t))
ends = np.linspace(0.01, 0.9, 90)
p_mean = np.diff(np.interp([0, *ends], result.t[1:], energy)) / 0.01

figure, (top, middle, bottom) = plt.subplots(3, 1, sharex=True, figsize=(8, 6.5))
top.plot(result.t, wanted, "k--", lw=0.8, label="reference")
top.plot(result.t, speed, label="speed")
top.set(ylabel="speed (rpm)")
top.legend()
middle.plot(result.t, result.tau, lw=0.4)
middle.set(ylabel="torque (N m)")
bottom.step(ends, p_mean / 1e3)
bottom.axhline(0, color="k", lw=0.6)
bottom.set(xlabel="time (s)", ylabel="dc-link power,\n10 ms mean (kW)")
plt.show()
