"""Capacitor of the dc link.

Each phase takes energy from the dc link and gives a part of it back, so the capacitor of an SRM
drive carries a large current. Where phases freewheel, it is about 80 % of the rms current of a
phase, whatever the control law. Hard chopping returns current to the link in every switching
period: the capacitor then carries 1.6 times as much at 1500 rpm, and twice as much at 300 rpm.
Direct instantaneous torque control demagnetizes phases too, and lies between the two.

A larger capacitance lowers the swing of the link voltage, but not the rms current. So the current
that its data sheet allows decides first which capacitor will do. Below about 2 mF the battery of
0.2 ohm takes a part in holding the link, and the swing rises less.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import reluctance as rl

EXAMPLES = Path(__file__).parents[1]
DRIVES = {
    "torque sharing, hard chopping": ("sharing_cubic", ["control.chop=hard"]),
    "direct torque control": ("ditc", []),
    "torque sharing, soft chopping": ("sharing_cubic", []),
    "predictive law edge_mpc": ("edge_mpc_mcu", []),
}
SPEEDS = (300, 600, 900, 1200, 1500)  # [rpm]
CAPACITANCES = (0.5, 1, 2, 5, 10, 20)  # [mF]


def run(name: str, values: list[str]) -> rl.Kpis:
    return rl.simulate(rl.load(EXAMPLES / f"{name}.toml", values), until=0.2, record=None).kpis


figure, (left, right) = plt.subplots(1, 2)
for label, (name, values) in DRIVES.items():
    runs = [run(name, [*values, f"load.speed_rpm={speed}"]) for speed in SPEEDS]
    left.plot(SPEEDS, [k.i_cap_rms / k.i_rms for k in runs], "o-", label=label)
left.set(xlabel="speed (rpm)", ylabel="rms current, capacitor over phase", ylim=(0, None))
left.legend()
runs = [run("battery", [f"source.C_uF={1e3 * C}"]) for C in CAPACITANCES]
right.loglog(CAPACITANCES, [k.u_dc_max - k.u_dc_min for k in runs], "o-", label="swing (V)")
right.loglog(CAPACITANCES, [k.i_cap_rms for k in runs], "o-", label="rms current (A)")
right.set(xlabel="capacitance (mF)", ylabel="of the link on a battery")
right.legend()
plt.show()
