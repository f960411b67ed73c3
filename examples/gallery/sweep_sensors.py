"""Sweep: sensor resolution.

The rms torque error over the bits of the current converter and the counts of the encoder, with
sampled comparators. The map shows which of the two sensors limits the drive: here the current
converter up to 12 bits. More than 256 counts a revolution bring next to nothing, since the tracker
of the angle smooths their steps.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import reluctance as rl

DRIVE = Path(__file__).parents[1] / "sharing_cubic.toml"

bits, counts = [7, 8, 9, 10, 12, 14], [256, 512, 1024, 2048, 4096]
fixed = ["sensing.i_range_A=200", "sensing.comparators=sampled", "control.T_s_us=5"]
vary = {"sensing.encoder_counts": counts, "sensing.adc_bits": bits}
found = rl.sweep(rl.load(DRIVE, fixed), vary, until=0.06)
plt.imshow(100 * found.figure("torque_error_rms").reshape(found.grid), origin="lower")
plt.colorbar(label="torque error, rms (%)")
plt.xticks(range(6), [f"{n} bits" for n in bits])
plt.yticks(range(5), [f"{n} counts" for n in counts])
plt.show()
