"""Energy loop.

Flux linkage over current, for one phase and one electrical period. The area of the loop is the
energy that the phase turns into mechanical work in one stroke. The grey lines are the
magnetisation curves of the machine at the unaligned and the aligned position: no loop can leave
the field between them. The script compares the area with the integral of torque over angle.

Current regulation at 1500 rpm uses less of the field than a single pulse at 3000 rpm.
`reluctance run DRIVE.toml --energy-loop loop.png` draws the same figure for any drive.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import reluctance as rl

EXAMPLES = Path(__file__).parents[1]
DRIVES = {"sharing_cubic": "cubic torque sharing, 1500 rpm", "single_pulse": "one pulse, 3000 rpm"}
N_R = 4


def integral(y: np.ndarray, x: np.ndarray) -> float:
    """By the trapezoidal rule."""
    return float(np.sum((y[1:] + y[:-1]) / 2 * np.diff(x)))


figure, ax = plt.subplots(figsize=(7, 5))
for name, label in DRIVES.items():
    result = rl.simulate(rl.load(EXAMPLES / f"{name}.toml"))
    turns = N_R * result.theta_m / (2 * np.pi)
    end = np.floor(turns[-1])
    kept = (turns >= end - 1) & (turns <= end)
    i, psi, theta_m = result.i[0][kept], result.psi[0][kept], result.theta_m[kept]
    tau = result.tau_ph[0][kept]
    area = integral(i, psi)
    work = integral(tau, theta_m)
    ax.plot(i, psi, label=f"{label}: {area:.2f} J")
    print(f"{label}: area {area:.3f} J, torque over angle {work:.3f} J")

machine = rl.load(EXAMPLES / "sharing_cubic.toml").machine
current = np.linspace(0, 115, 100)
A = machine.psi_m_Wb - machine.L_sat_H * machine.i_m_A
B = (machine.L_a_H - machine.L_sat_H) / A
ax.plot(current, machine.L_u_H * current, color="0.7", zorder=0)
ax.plot(current, machine.L_sat_H * current + A * (1 - np.exp(-B * current)), color="0.7", zorder=0)
ax.text(112, machine.L_u_H * 112, "unaligned", ha="right", va="bottom", color="0.5")
ax.text(112, 0.425, "aligned", ha="right", color="0.5")
ax.set(xlabel="current of phase a (A)", ylabel="flux linkage (Wb)")
ax.legend(loc="lower right")
plt.show()
