"""A drive in Python.

A drive needs no file: each table of [the drive file](../drive_file.md) is an object with the same
keys, checked in the same way. This script builds a 6/4 drive from a machine of the library, draws
the magnetisation of one phase, runs two control laws at 500 rpm and 30 N m, and compares their
ripple. `drive.save("my_drive.toml")` writes the drive as a file.
"""

import matplotlib.pyplot as plt
import numpy as np

import reluctance as rl

drive = rl.Drive(
    machine="paper_6_4",
    converter=rl.Converter(u_dc_V=240, R_switch_ohm=0.01, R_diode_ohm=0.01),
    load=rl.Load(kind="locked", speed_rpm=500),
    reference=rl.Reference(kind="torque", tau_Nm=30),
    control=rl.EdgeMpc(T_s_us=20),
    simulation=rl.SimulationSettings(until_s=0.06),
)
hysteresis = drive.with_values({"control.law": "torque_sharing", "control.i_band_A": 1.0})
runs = {"torque sharing, band 1 A": rl.simulate(hysteresis), "edge_mpc": rl.simulate(drive)}

figure, (magnetisation, torque) = plt.subplots(1, 2)
i = np.linspace(0, drive.machine.i_max_A, 151)
for theta_e in np.radians([0, 60, 90, 120, 180]):
    psi = drive.machine.psi(i, theta_e)
    magnetisation.plot(i, psi, label=f"{np.degrees(theta_e):.0f}°")
magnetisation.set(xlabel="current (A)", ylabel="flux linkage (Wb)")
magnetisation.legend(title="angle, electrical")
for name, run in runs.items():
    late = run.since(0.05)
    label = f"{name}: {run.kpis.torque_ripple_rms:.1%} rms"
    torque.plot(1e3 * late.t, late.tau, lw=0.8, label=label)
torque.set(xlabel="time (ms)", ylabel="torque (N m)", ylim=(28.5, 32.5))
torque.legend(title="torque ripple", loc="upper right")
plt.show()
