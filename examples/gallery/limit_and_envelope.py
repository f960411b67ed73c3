"""Limit and envelope.

`reluctance limit` computes what the machine can do under any controller. The left panel shows the
phase current with minimum copper loss that gives the rated torque without ripple, within 240 V.
The right panel shows the greatest torque without ripple over speed. The dots are simulated runs of
deadbeat control with cubic torque sharing, which follows the torque up to a part of the limit only:
its sharing function does not use the voltage as well as the optimal current does.
"""

import csv
import subprocess
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import reluctance as rl

DRIVE = Path(__file__).parents[1] / "deadbeat.toml"


def columns(path: Path) -> dict[str, np.ndarray]:
    """A CSV file, by column."""
    with path.open() as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def run(speed_rpm: float, tau: float) -> rl.Result:
    """The drive at another operating point."""
    drive = rl.load(DRIVE, [f"load.speed_rpm={speed_rpm}", f"reference.tau_Nm={tau}"])
    return rl.simulate(drive, until=0.1, record=None)


with tempfile.TemporaryDirectory() as folder:
    profile, envelope = Path(folder) / "profile.csv", Path(folder) / "envelope.csv"
    subprocess.run(
        ["reluctance", "limit", DRIVE, "--out", profile, "--envelope", envelope],
        check=True,
        capture_output=True,
    )
    profile, envelope = columns(profile), columns(envelope)

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4.5))
left.plot(profile["theta_e_deg"], profile["i_A"], label="current (A)")
left.plot(profile["theta_e_deg"], profile["tau_ph_Nm"], label="torque of the phase (N m)")
left.set(xlabel="electrical angle (deg)", xticks=range(0, 361, 60))
left.legend()
right.plot(envelope["speed_rpm"], envelope["tau_max_Nm"], label="greatest torque without ripple")
for speed in (750, 1500, 2250, 2625):
    for tau in (20, 40, 60, 80):
        kpis = run(speed, tau).kpis
        follows = kpis.torque_error_rms < 0.02
        right.plot(speed, tau, "o", color="C2" if follows else "C1")
right.plot([], [], "o", color="C2", label="deadbeat: rms error below 2 %")
right.plot([], [], "o", color="C1", label="deadbeat: above 2 %")
right.set(xlabel="speed (rpm)", ylabel="torque (N m)", ylim=(0, 110))
right.legend(loc="upper right")
plt.show()
