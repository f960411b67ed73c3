"""Own flux map.

The script writes a table of flux linkage over current and angle, as finite elements or a bench
would give it, here from a formula for an 8/6 machine. `reluctance map check` states how it read the
table and whether the data are consistent. `reluctance map import` makes a machine file of it. After
that any drive file runs with the machine: here cubic torque sharing at 600 rpm and 2 N m.

[Your own machine](../your_machine.md) explains the commands and the file formats.
"""

import subprocess
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import reluctance as rl

DRIVE = Path(__file__).parents[1] / "sharing_cubic.toml"


def psi(i: np.ndarray, theta_deg: np.ndarray) -> np.ndarray:
    """Flux linkage [Wb]; 0 degrees (mechanical) is unaligned, 30 is aligned."""
    x = theta_deg / 30
    aligned = 0.45 * (1 - np.exp(-i / 3.0)) + 0.012 * i
    unaligned = 0.018 * i
    return unaligned + (aligned - unaligned) * x**2 * (3 - 2 * x)


current, angle = np.arange(0, 10.5, 0.5), np.arange(0, 31, 1.0)
table = psi(current[:, None], angle[None, :])

with tempfile.TemporaryDirectory() as name:
    folder = Path(name)
    lines = ["i_A,theta_m_deg,psi_Wb"]
    lines += [f"{i},{a},{psi(i, a)}" for i in current for a in angle]
    (folder / "fe.csv").write_text("\n".join(lines))
    check = ["reluctance", "map", "check", "fe.csv", "--N_r", "6"]
    made = ["reluctance", "map", "import", "fe.csv", "--N_s", "8", "--N_r", "6"]
    made += ["--R_ohm", "2.15", "--J_kgm2", "0.004", "--out", "motor.toml"]
    print(subprocess.run(check, cwd=folder, check=True, capture_output=True, text=True).stdout)
    subprocess.run(made, cwd=folder, check=True, capture_output=True)
    drive = rl.load(
        DRIVE,
        [
            f"machine={(folder / 'motor.toml').as_posix()}",
            "converter.u_dc_V=300",
            "load.speed_rpm=600",
            "reference.tau_Nm=2",
            "control.i_band_A=0.1",
        ],
    )
    result = rl.simulate(drive, until=0.1)

figure, (left, right) = plt.subplots(1, 2)
left.plot(current, table[:, ::5])
left.set(xlabel="current (A)", ylabel="flux linkage (Wb)", title="the table, every 5 degrees")
last = result.t > result.t[-1] - 60 / 600 / 6
right.plot(1e3 * (result.t[last] - result.t[last][0]), result.tau[last], label="torque (N m)")
right.plot(1e3 * (result.t[last] - result.t[last][0]), result.i[0][last], label="current a (A)")
right.set(xlabel="time (ms)", title="one electrical period on this machine", ylim=(0, None))
right.legend()
plt.show()
