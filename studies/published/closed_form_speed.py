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
PUBLISHED = {4: (1.8, 6.1), 6: (1.0, 4.3)}  # of N_r: overshoot and dip [% of the speed]


def figures() -> list[Figure]:
    """`deadbeat` under the speed loop by rule, on the 6/4 and on the 8/6 machine."""
    found = []
    for N_r, limits in PUBLISHED.items():
        of = "" if N_r == 4 else f" on {N_r + 2}/{N_r}"
        names = f"overshoot of 1000 rpm{of}", f"dip under 5 N m{of}"
        for name, limit, ours in zip(names, limits, overshoot_and_dip(N_r), strict=True):
            found.append(Figure(name, "%", "at most", limit, ours))
    return found


def overshoot_and_dip(N_r: int) -> tuple[float, float]:
    """In per cent of the speed."""
    given = drive(
        B_Nms=0.002,
        N_r=N_r,
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
    return 100 * (rpm[before].max() / RPM - 1), 100 * (1 - rpm[~before].min() / RPM)


if __name__ == "__main__":
    show(rows("closed_form_speed", figures()))
