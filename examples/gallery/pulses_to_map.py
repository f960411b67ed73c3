"""From pulses to a machine.

The commissioning routine of the firmware clamps a simulated machine at 31 angles and sends four
voltage pulses through one phase at each, with 12-bit current sensors and 8 LSB of noise. The
integral of u - R i is the flux linkage. `identify` makes a flux table of the recordings, and the
machine made of it is compared with the one that was measured: curves are the machine's own torque
over the angle, dots that of the identified map.

[Commissioning](../commissioning.md) describes the routines and states their accuracy.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import reluctance as rl
from reluctance import commission, maps

SENSORS = {
    "sensing.adc_bits": 12,
    "sensing.i_range_A": 240.0,
    "sensing.i_noise_LSB": 8.0,
    "sensing.encoder_counts": 4096,
}
drive = rl.load(Path(__file__).parents[1] / "paper_rated.toml").with_values(SENSORS)
recorded = [
    commission.commission(drive, "pulses", theta_e_deg=angle, pulses=4)
    for angle in np.linspace(0, 180, 31)
]
R = np.mean(commission.commission(drive, "resistance", clamped=True).R)
with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "pulses.csv"
    commission.write_pulses(path, recorded, drive)
    found = maps.identify(maps.read_pulses([path]), N_r=drive.machine.N_r, R=R)
identified = maps.surface(found.table)

theta_e = np.linspace(0, np.pi, 121)
figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4))
pulse = recorded[15].rows[recorded[15].rows[:, 0] == 0]
left.plot(1e3 * drive.control.T_s * pulse[:, 1], pulse[:, 3], ".", ms=2)
left.set(xlabel="time (ms)", ylabel="current (A)", title="one pulse, halfway to alignment")
for i in (25.0, 50.0, 100.0, 150.0):
    current = np.full_like(theta_e, i)
    (line,) = right.plot(
        np.degrees(theta_e), drive.machine.magnetics.magnetics(current, theta_e)[:, 2], lw=0.8
    )
    dots = identified.magnetics(current[::6], theta_e[::6])[:, 2]
    right.plot(np.degrees(theta_e[::6]), dots, ".", color=line.get_color(), label=f"{i:g} A")
right.set(xlabel="electrical angle (deg)", ylabel="torque of a phase (N m)")
right.set_title(f"identified with R = {R:.4f} $\\Omega$")
right.legend()
plt.show()
