"""Question: does a flux map from two measured decays give the measured static torque?

    python studies/published/micro_8_6.py

Micro motor LD20ACM-25, 8/6, four phases: github.com/radluki/Napedy_Elektryczne @ 30b29da4, ea6/ea6
(a student bench, no licence: numbers only). Masses on a lever of 21.4 mm hold the rotor of one
phase at 0.65 A; current decays after switch-off are sampled every 0.2 ms. A decay through the
freewheeling path gives the flux linkage,

    psi(i) = integral of (R i + u_d) dt,

so the inductances below (u_d = 0) say how long the current took, and with another drop u_d of the
diode the flux linkage is psi + u_d/R integral of dpsi/i. The lower end of that integral is 3 % of
the first current, where the sensor of the decays ends.

Open in the source: the rotor positions of the decays (inferred from their shape: aligned and
unaligned), the diode's drop, and every position between them (here joined by a cosine). The source
takes its friction of 5 mN m from each torque, which is done here too; its sign was not measured.
"""

from __future__ import annotations

import numpy as np
from figure import Figure, rows, show

from reluctance.machine.maps import FluxTable
from reluctance.machine.maps.check import MapReport, check_map, coenergy_torque

N_R, I_TOP, R = 6, 0.65, 22.0  # [A, ohm]
GRAMS = (475.5, 430.5, 401, 365.2, 335.2, 317.2, 287.2, 242.2, 212.2, 182.2, 152.2, 107.2)
DEGREES = (  # 240 is aligned
    *(255.54, 253.02, 251.26, 250.56, 249.5, 249.5, 247.74, 247.74, 247.39, 244.93, 241.76, 240.0),
)
LEVER, GRAVITY, FRICTION = 0.0214, 9.81, 0.005  # [m, m/s^2, N m]
CURRENTS = np.array([0.1, 0.3, 0.5, 0.65])  # [A]
ALIGNED = np.array([0.209, 0.196, 0.157, 0.136])  # psi/i without a diode's drop [H]
UNALIGNED = np.array([0.088, 0.067, 0.060, 0.056])  # [H]
THIRD = np.array([2.2, 2.1, 1.9, 1.8])  # of the third decay, whose time base must be wrong [H]
DROP = 0.7  # of a silicon diode [V]
END = 0.03  # of the first current: where a decay ends


def flux(inductance: np.ndarray, i: np.ndarray, drop: float) -> np.ndarray:
    """Flux linkage of a decay [Wb]."""
    fine = np.linspace(0, I_TOP, 1301)
    psi = np.interp(fine, np.append(0, CURRENTS), np.append(0, CURRENTS * inductance))
    middle = (fine[1:] + fine[:-1]) / 2
    longer = np.where(middle > END * I_TOP, np.diff(psi) / middle, 0.0)
    psi[1:] += drop / R * np.cumsum(longer)
    return np.asarray(np.interp(i, fine, psi))


def table(aligned: np.ndarray, drop: float) -> FluxTable:
    """The flux map: two curves, joined by a cosine."""
    i, theta_e = np.linspace(0, I_TOP, 27), np.radians(np.linspace(0, 180, 31))
    psi_a, psi_u = flux(aligned, i, drop), flux(UNALIGNED, i, drop)
    psi = np.outer((psi_a + psi_u) / 2, np.ones(31)) - np.outer(
        (psi_a - psi_u) / 2, np.cos(theta_e)
    )
    return FluxTable(N_R, i, theta_e, psi)


def measured() -> tuple[np.ndarray, np.ndarray]:
    """Angle from the aligned position [rad mechanical] and torque [N m], by rising angle."""
    angle = np.radians(np.array(DEGREES) - 240)
    torque = 1e-3 * np.array(GRAMS) * GRAVITY * LEVER - FRICTION
    order = np.argsort(angle, kind="stable")
    return angle[order], torque[order]


def third_decay() -> MapReport:
    """What `map check` says of the map with the third decay, beside the measured torque."""
    angle, torque = measured()
    given = table(THIRD, 0.0)
    curve = np.interp(np.pi - given.theta_e, N_R * angle, torque, right=torque[-1])
    part = np.linspace(0, 1, len(given.i)) ** 2  # torque rises as the square of the current
    tau = np.outer(part, curve * np.sin(given.theta_e))
    return check_map(FluxTable(N_R, given.i, given.theta_e, given.psi, tau))


def figures() -> list[Figure]:
    """Torque and its integral, without a diode's drop and with one."""
    angle, torque = measured()
    half_pitch = 2 * float(np.trapezoid(torque, angle))  # by symmetry about 15 deg
    made = []
    for text, drop in (("no diode drop", 0.0), ("0.7 V", DROP)):
        given = table(ALIGNED, drop)
        tau = np.interp(np.pi - N_R * angle, given.theta_e, coenergy_torque(given)[-1])
        psi = given.psi[:, -1] - given.psi[:, 0]
        coenergy = float(np.trapezoid(psi, given.i))
        made += [
            Figure(f"greatest static torque, {text}", "N m", "measured", torque.max(), tau.max()),
            Figure(f"torque integral, {text}", "J", "measured", half_pitch, coenergy),
        ]
    return made


if __name__ == "__main__":
    show(rows("micro_8_6", figures()))
    report = third_decay()
    print(f"third decay: {report.verdict}: {'; '.join(report.reasons)}")
