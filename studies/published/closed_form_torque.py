"""Question: can a closed-form 6/4 machine give the published torque within its current limits?

    python studies/published/closed_form_torque.py

540 V, 1500 rpm, conduction angles with a current band of +-0.8 A. The source (closed_form_6_4.py;
autograder/check_lab.py, lab 2) asks for a mean of at least 22 N m with a peak current of at most
21 A and an rms current of at most 12.5 A, and has an example with 20 A from 20 to 145 deg.

Open in the source: the time step of its check is 5 us by Euler's rule; here switching is located.
"""

from __future__ import annotations

import numpy as np
from closed_form_6_4 import U_DC, R, drive
from figure import Figure, rows, show

import reluctance as rl
from reluctance.machine.optimum import OperatingPoint, torque_speed_envelope

RPM, TAU, I_PEAK, I_RMS = 1500.0, 22.0, 21.0, 12.5
BAND = 0.8
T_S_US = 20.0  # of the torque reference; angles and currents are compared as they pass


def run(reference: dict[str, object], control: dict[str, object]) -> rl.Kpis:
    """Key figures of the angles law."""
    given = drive(
        load={"kind": "locked", "speed_rpm": RPM},
        reference=reference,
        control={"law": "angles", "T_s_us": T_S_US, "i_band_A": BAND, **control},
        simulation={"until_s": 0.2},
    )
    return rl.simulate(given, record=None).kpis


def smooth_torque() -> float:
    """The greatest torque without ripple that any control reaches within the peak current."""
    magnetics = drive(
        load={"kind": "locked", "speed_rpm": RPM},
        reference={"kind": "torque", "tau_Nm": 1.0},
        control={"law": "angles", "T_s_us": T_S_US, "i_band_A": BAND},
        simulation={"until_s": 0.1},
    ).machine.magnetics
    omega_m = RPM * np.pi / 30
    point = OperatingPoint(magnetics, 3, R, I_PEAK, U_DC, omega_m)
    return float(torque_speed_envelope(point, [omega_m]).tau_max[0])


def figures() -> list[Figure]:
    """The example's angles, the least current by rule, and the limit without ripple."""
    example: dict[str, object] = {"i_ref_A": 20.0, "theta_on_deg": 20.0, "theta_off_deg": 145.0}
    given = run({"kind": "none"}, example)
    least = run({"kind": "torque", "tau_Nm": TAU}, {})
    return [
        Figure("mean torque, angles of the source", "N m", "at least", TAU, given.tau_mean),
        Figure("peak current, angles of the source", "A", "at most", I_PEAK, given.i_peak),
        Figure("rms current, angles of the source", "A", "at most", I_RMS, given.i_rms),
        Figure("peak current at 22 N m, angles by rule", "A", "at most", I_PEAK, least.i_peak),
        Figure("rms current at 22 N m, angles by rule", "A", "at most", I_RMS, least.i_rms),
        Figure("greatest torque without ripple", "N m", "at least", TAU, smooth_torque()),
    ]


if __name__ == "__main__":
    show(rows("closed_form_torque", figures()))
