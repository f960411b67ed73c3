"""Control period.

The rms torque error over the control period, with ideal sensors, no delay and sampled comparators.
Sampled hysteresis control reacts only once per period, so its current leaves the band by more the
longer the period is. `deadbeat` and `edge_mpc` place their edges inside the period. A longer period
degrades deadbeat control slowly, since its switching frequency falls with it; `edge_mpc` (asked for
12 kHz) is nearly unaffected up to 20 µs.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import reluctance as rl

EXAMPLES = Path(__file__).parents[1]
LAWS = {
    "sharing_cubic": ("cubic torque sharing", ["sensing.comparators=sampled"]),
    "deadbeat": ("deadbeat flux control", []),
    "edge_mpc_fpga": ("edge_mpc", ["control.f_switch_kHz=12"]),
}
PERIODS = (5, 10, 20, 30, 40)  # [us]

figure, (left, right) = plt.subplots(1, 2)
for name, (label, settings) in LAWS.items():
    found = [
        rl.simulate(
            rl.load(EXAMPLES / f"{name}.toml", [*settings, f"control.T_s_us={period}"]), record=None
        ).kpis.with_units()
        for period in PERIODS
    ]
    left.plot(PERIODS, [100 * kpis["torque_error_rms"] for kpis in found], "o-", label=label)
    right.plot(PERIODS, [kpis["f_switch_Hz"] / 1e3 for kpis in found], "o-", label=label)
left.set(xlabel="control period (µs)", ylabel="rms torque error (%)", ylim=(0, None))
right.set(xlabel="control period (µs)", ylabel="switching frequency (kHz)", ylim=(0, None))
left.legend()
plt.show()
