"""Five phases, with all losses.

A 10/8 machine with five phases at 1000 rpm and 6 N m. At every angle two or three phases can make
torque, so cubic torque sharing has little ripple at a low switching frequency. The drive file has
the data for every loss: the winding at 100 °C, conduction and switching of the converter, iron.
The bars show where the input power goes; "devices" is the conduction loss of switches and diodes.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import reluctance as rl

result = rl.simulate(rl.load(Path(__file__).parents[1] / "five_phases_losses.toml"))
kpis = result.kpis.with_units()
PARTS = {
    "p_mech_W": "shaft",
    "p_cu_W": "copper",
    "p_dev_W": "devices",
    "p_sw_W": "switching",
    "p_fe_W": "iron",
}

figure, (left, right) = plt.subplots(1, 2, width_ratios=(3, 2), figsize=(9, 4.5))
last = result.t > result.t[-1] - 60 / 1000 / 8
time = 1e3 * (result.t[last] - result.t[last][0])
for k, current in enumerate(result.i):
    left.plot(time, current[last], lw=0.9, label=f"phase {'abcde'[k]}")
left.plot(time, result.tau[last], "k", lw=0.9, label="torque (N m)")
left.set(xlabel="time (ms)", ylabel="current (A)", ylim=(0, None))
left.legend(ncols=3, loc="upper center", bbox_to_anchor=(0.5, 1.2))
bars = right.bar(list(PARTS.values()), [kpis[name] for name in PARTS])
right.bar_label(bars, fmt="%.0f W")
right.set_ylabel("power (W)")
right.tick_params(axis="x", labelsize=8)
right.set_title(f"efficiency {kpis['efficiency']:.1%}, ripple {kpis['torque_ripple_pp']:.1%} p-p")
plt.show()
