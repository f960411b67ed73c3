"""Question: how far does the speed pass its reference, and how far does it dip under a load?

    python studies/published/closed_form_speed.py

540 V, 0.02 kg m^2, 0.002 N m s, 10 kHz, encoder of 4096 counts, torque reference up to 20 N m,
current up to 20 A: a step to 1000 rpm from standstill, 5 N m of load from 0.8 s on. The source
(closed_form_6_4.py; firmware/README.md and firmware/sim/test_firmware.c @ f309769a) has PI control
with 0.8 N m s/rad and 8 N m/rad on the filtered difference of the encoder.

Here the speed loop is by rule (docs/control/speed_loop.md), and the order acts one sample late.
Not taken over: the capacitor of 4.7 mF behind 0.05 ohm; here the dc link is stiff.
"""

from __future__ import annotations

import numpy as np
from closed_form_6_4 import drive
from figure import Figure, rows, show

import reluctance as rl

RPM, TAU_LOAD, T_LOAD, T_END = 1000.0, 5.0, 0.8, 1.5
OVERSHOOT, DIP = 1.8, 6.1  # [% of the speed]


def figures() -> list[Figure]:
    """`deadbeat` under the speed loop by rule."""
    given = drive(
        B_Nms=0.002,
        load={
            **{"kind": "torque", "speed_rpm": 0.0},
            **{"t_s": [T_LOAD, T_LOAD], "values": [0.0, TAU_LOAD]},
        },
        reference={"kind": "speed", "speed_rpm": RPM},
        control={
            **{"law": "deadbeat", "T_s_us": 100.0},
            **{"tau_max_Nm": 20.0, "current_limit_A": 20.0},
        },
        sensing={"delay_samples": 1, "encoder_counts": 4096},
        simulation={"until_s": T_END},
    )
    result = rl.simulate(given, record=1e-4)
    rpm = result.omega_m * 30 / np.pi
    before = result.t < T_LOAD
    overshoot = 100 * (rpm[before].max() / RPM - 1)
    dip = 100 * (1 - rpm[~before].min() / RPM)
    return [
        Figure("overshoot of 1000 rpm", "%", "at most", OVERSHOOT, overshoot),
        Figure("dip under 5 N m", "%", "at most", DIP, dip),
    ]


if __name__ == "__main__":
    show(rows("closed_form_speed", figures()))
