"""Question: how closely is a phase current held with a control period of 100 us?

    python studies/published/closed_form_current.py

540 V, 600 rpm, 15 A from 10 to 150 deg. The source (closed_form_6_4.py; autograder/check_lab.py,
lab 3) asks for an rms error of at most 1.0 A from the first time the current reaches its reference
until the window ends, of a predictive control with one voltage a period (+540 V, 0, -540 V). It
also has hysteresis control at the same samples.

Here `pwm_current` gives a duty cycle, so that its current does not saw; `angles` with sampled
comparison is the hysteresis control. Open in the source: the error of its own controls.
"""

from __future__ import annotations

import numpy as np
from closed_form_6_4 import N_R, drive
from figure import Figure, rows, show

import reluctance as rl

RPM, I_REF, ON, OFF = 600.0, 15.0, 10.0, 150.0
WITHIN = 1.0  # [A]
BAND = 0.8  # of the hysteresis [A]
RECORD = 2e-6  # [s]


def error(law: str, **control: object) -> float:
    """The worst rms error of a period [A], the first left out."""
    sensing = {"comparators": "sampled"} if law == "angles" else {}
    given = drive(
        load={"kind": "locked", "speed_rpm": RPM},
        reference={"kind": "none"},
        control={
            **{"law": law, "T_s_us": 100.0, "i_ref_A": I_REF},
            **{"theta_on_deg": ON, "theta_off_deg": OFF},
            **control,
        },
        sensing=sensing,
        simulation={"until_s": 0.1},
    )
    result = rl.simulate(given, record=RECORD)
    theta_e = N_R * result.theta_m
    period = np.floor(theta_e / (2 * np.pi)).astype(int)
    conducts = (np.degrees(theta_e) % 360 > ON) & (np.degrees(theta_e) % 360 < OFF)
    i = result.i[0]
    worst = 0.0
    for n in range(1, period.max()):
        reached = np.flatnonzero((period == n) & (i >= I_REF))[0]
        held = (period == n) & conducts & (np.arange(len(i)) > reached)
        worst = max(worst, float(np.sqrt(np.mean((i[held] - I_REF) ** 2))))
    return worst


def figures() -> list[Figure]:
    """Both controls."""
    hysteresis = error("angles", i_band_A=BAND)
    return [
        Figure("rms error, PI and PWM", "A", "at most", WITHIN, error("pwm_current")),
        Figure("rms error, sampled hysteresis", "A", "at most", WITHIN, hysteresis),
    ]


if __name__ == "__main__":
    show(rows("closed_form_current", figures()))
