"""Encoder and ADC resolution.

The rms torque error of two laws over the resolution of the current sensors (left, with 4096 encoder
counts) and of the encoder (right, with 12 bits). Control every 20 µs, one sample late, currents
measured over a range of 200 A. Below 10 bits the quantisation of the currents raises the error.

The controller obtains angle and speed from a tracking observer. At constant speed the observer
averages over the counts, so the error hardly depends on their number from 256 on. The observer lags
when the speed changes; `sensing.tracker_bandwidth_Hz` sets by how much.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import reluctance as rl

EXAMPLES = Path(__file__).parents[1]
LAWS = {"deadbeat": "deadbeat flux control", "edge_mpc_mcu": "edge_mpc"}
BITS = (7, 8, 9, 10, 12, 14)
COUNTS = (64, 256, 1024, 4096, 16384)


def error(name: str, bits: int, counts: int) -> float:
    """Rms torque error in percent."""
    sensing = [
        "sensing.delay_samples=1",
        "sensing.i_range_A=200",
        f"sensing.adc_bits={bits}",
        f"sensing.encoder_counts={counts}",
    ]
    drive = rl.load(EXAMPLES / f"{name}.toml", sensing)
    return 100 * rl.simulate(drive, record=None).kpis.torque_error_rms


figure, (left, right) = plt.subplots(1, 2, sharey=True)
for name, label in LAWS.items():
    left.plot(BITS, [error(name, bits, 4096) for bits in BITS], "o-", label=label)
    right.plot(COUNTS, [error(name, 12, counts) for counts in COUNTS], "o-", label=label)
left.set(xlabel="bits of the current sensors", ylabel="rms torque error (%)", ylim=(0, None))
right.set(xlabel="encoder counts per revolution", xscale="log", xticks=COUNTS)
right.set_xticklabels(COUNTS)
right.minorticks_off()
right.legend()
plt.show()
