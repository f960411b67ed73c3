"""Question: what do coupled phases change in the torque of the 12/8 e-bike drive?

    python studies/published/tanala_coupled.py

Currents of a drive whose phases do not couple are applied to the field of all three phases at 24
angles of a stroke, and to the map of one phase. Source: the repository of tanala_12_8.py,
results/revision2/coupled.json; angles and currents of its three points with hysteresis and a held
current in results/revision/revision_all.json (drive, tsf), its torque sharing in tanala_sharing.py.

As there, the waveform of one phase is shifted for the others, and the ripple is that of the 24
angles. The last figures are of fields with 15 A and with 30 A in two neighbouring phases, the first
of them 11 deg from unaligned (mutual of revision_all.json); flux linkages with end windings.
Open in the source: how far its fields with several currents have converged.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from figure import Figure, rows, show
from tanala_12_8 import estimates, system
from tanala_sharing import N_R, POINTS, STROKE, Point, drive, last_period, trimmed

import reluctance as rl
from reluctance.drive.run.result import Result
from reluctance.machine.geometry.position import at_angle
from reluctance.machine.geometry.solve import solve

ANGLES = 24  # of a stroke
ALIGNED = 22.5  # mechanical, from unaligned [deg]
PAIR_ANGLE = 11.0  # [deg]
# Of a current [A]: torque of each alone, summed, and of both [N m]; flux linkage of the first alone
# and with both [mWb].
PAIRS = {15: (1.662, 1.486, 55.59, 52.75), 30: (5.913, 5.263, 85.51, 81.72)}


@dataclass(frozen=True)
class Pulse:
    """A held current between two mechanical angles from unaligned, with soft chopping [A, deg]."""

    i_ref: float
    on: float
    off: float


@dataclass(frozen=True)
class Case:
    """What the source has: mean torque alone and coupled [N m], ripple alone and coupled [%]."""

    name: str
    point: Point
    pulse: Pulse | None  # None: torque sharing
    published: tuple[float, float, float, float]


CASES = (
    Case("start", Point(80.456, 6.6), Pulse(29.192, -0.824, 21.676), (6.637, 6.686, 55.71, 54.18)),
    Case(
        "200 rpm, held current",
        Point(200, 3.0),
        Pulse(21.471, 6.0207, 15.0843),
        (3.004, 3.004, 193.8, 193.7),
    ),
    Case("200 rpm, shared torque", POINTS[1], None, (3.002, 2.987, 6.442, 7.324)),
    Case(
        "1608 rpm, held current",
        Point(1607.6257, 1.48),
        Pulse(14.5125, -2.9157, 15.0843),
        (1.482, 1.460, 86.04, 87.84),
    ),
)


def waveform(case: Case) -> Result:
    """Of the drive."""
    if case.pulse is None:
        return trimmed(case.point)[0]
    p = case.pulse
    control = {
        **{"law": "angles", "i_ref_A": p.i_ref, "i_band_A": 0.5 * max(0.2, 0.02 * p.i_ref)},
        **{"theta_on_deg": N_R * p.on, "theta_off_deg": N_R * p.off},
    }
    given = drive(case.point, control)
    return rl.simulate(given, record=given.control.T_s)


def current_of(case: Case) -> Callable[[np.ndarray], np.ndarray]:
    """Of phase a over the mechanical angle from unaligned [deg]."""
    result = waveform(case)
    period = last_period(result, case.point)
    angle = np.degrees(result.theta_m[period]) % (360 / N_R)
    order = np.argsort(angle)
    known, i = angle[order], result.i[0, period][order]
    return lambda at: np.interp(at, known, i, period=360 / N_R)


def torques(case: Case) -> tuple[np.ndarray, np.ndarray]:
    """Of each phase alone, summed, and of the field of all three, at the angles [N m]."""
    i_at = current_of(case)
    machine = drive(case.point, {"law": "torque_sharing"}).machine
    begin = case.pulse.on if case.pulse is not None else 3.0
    angles = begin + STROKE * np.arange(ANGLES) / ANGLES
    alone, coupled = np.zeros(ANGLES), np.zeros(ANGLES)
    for j, angle in enumerate(angles):
        of_poles = angle + STROKE * np.array([0, 1, -1])  # of neighbouring poles, in their order
        i = i_at(of_poles)
        theta_e = np.radians(N_R * of_poles) % (2 * np.pi)
        alone[j] = machine.tau(i, theta_e).sum()
        coupled[j] = solve(at_angle(system(), np.radians(angle - ALIGNED)), i).tau
    return alone, coupled


def pair(current: int) -> list[Figure]:
    """Of two phases with the same current [A]."""
    one, other, both = (
        solve(at_angle(system(), np.radians(PAIR_ANGLE - ALIGNED)), current * np.array(on))
        for on in ((1, 0, 0), (0, 1, 0), (1, 1, 0))
    )
    end = estimates().L_end_H * current
    ours = (one.tau + other.tau, both.tau, *(1e3 * (f.psi[0] + end) for f in (one, both)))
    words = [f"{word}, {of}" for word in ("torque", "flux linkage") for of in ("alone", "coupled")]
    return [
        Figure(f"{current} A in two phases: {word}", unit, "computed", theirs, float(own))
        for word, unit, theirs, own in zip(
            words, ("N m", "N m", "mWb", "mWb"), PAIRS[current], ours, strict=True
        )
    ]


def figures() -> list[Figure]:
    """Mean torque and ripple of every case, and two pairs."""
    made = []
    for case in CASES:
        both = torques(case)
        means = [float(tau.mean()) for tau in both]
        ripples = [float(100 * (tau.max() - tau.min()) / tau.mean()) for tau in both]
        words = [
            f"{word}, {of}" for word in ("mean torque", "ripple") for of in ("alone", "coupled")
        ]
        for word, unit, theirs, ours in zip(
            words, ("N m", "N m", "%", "%"), case.published, [*means, *ripples], strict=True
        ):
            made.append(Figure(f"{case.name}: {word}", unit, "computed", theirs, ours))
    return [*made, *pair(15), *pair(30)]


if __name__ == "__main__":
    show(rows("tanala_coupled", figures()))
