"""Question: what do coupled phases change in the torque of the 12/8 e-bike drive?

    python studies/published/tanala_coupled.py

Currents of a drive whose phases do not couple are applied to the field of all three phases at 24
angles of a stroke, and to the map of one phase. Source: the repository of tanala_12_8.py,
results/revision2/coupled.json; angles and currents of its three points with hysteresis and a held
current in results/revision/revision_all.json (drive, tsf), its torque sharing in tanala_sharing.py.

As there, the waveform of one phase is shifted for the others, and the ripple is that of the 24
angles. The last figures are of fields with 15 A and with 30 A in two neighbouring phases, the first
of them 11 deg from unaligned (mutual of revision_all.json).

Each field is computed twice: with the yoke of 7 mm, in which the fluxes of neighbouring phases add
up and saturate it, and with one of 89 mm, which does not saturate. The published figures are those
of the second. The source's solver asks for no flux through the frame at nodes that it selects by
their distance from the axis, within 1e-6 m; the middles of straight edges along a circle are
nearer to the axis than that. So flux leaves its yoke through the frame. One phase does not
saturate the yoke, so that the source's flux linkages of one phase are right.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from figure import Figure, rows, show
from tanala_12_8 import system
from tanala_sharing import N_R, POINTS, STROKE, Point, drive, last_period, trimmed

import reluctance as rl
from reluctance.drive.run.result import Result
from reluctance.machine.geometry.position import at_angle
from reluctance.machine.geometry.solve import solve

ANGLES = 24  # of a stroke
ALIGNED = 22.5  # mechanical, from unaligned [deg]
YOKES = None, 300.0  # outer diameters: the machine's, and of a yoke that does not saturate [mm]
PAIR_ANGLE = 11.0  # [deg]
PAIRS = {15: (1.662, 1.486), 30: (5.913, 5.263)}  # of a current: torque alone and coupled [N m]


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


def torques(case: Case) -> list[np.ndarray]:
    """Of each phase alone, summed, and of the field of all three with either yoke, at the angles
    [N m]."""
    i_at = current_of(case)
    machine = drive(case.point, {"law": "torque_sharing"}).machine
    begin = case.pulse.on if case.pulse is not None else 3.0
    found = []
    for angle in begin + STROKE * np.arange(ANGLES) / ANGLES:
        of_poles = angle + STROKE * np.array([0, 1, -1])  # of neighbouring poles, in their order
        i = i_at(of_poles)
        theta_e = np.radians(N_R * of_poles) % (2 * np.pi)
        found.append([machine.tau(i, theta_e).sum(), *(torque(angle, i, D) for D in YOKES)])
    return list(np.array(found).T)


def torque(angle: float, i: np.ndarray, outer_diameter_mm: float | None) -> float:
    """Of the field with currents in the phases of poles 1, 2 and 3 [N m]."""
    return solve(at_angle(system(outer_diameter_mm), np.radians(angle - ALIGNED)), i).tau


def figures() -> list[Figure]:
    """Mean torque and ripple of every case, and the torque of two pairs."""
    made = []
    for case in CASES:
        found = torques(case)
        means = [float(tau.mean()) for tau in found]
        ripples = [float(100 * (tau.max() - tau.min()) / tau.mean()) for tau in found]
        made += lines(f"{case.name}: mean torque", "N m", case.published[:2], means)
        made += lines(f"{case.name}: ripple", "%", case.published[2:], ripples)
    for current, published in PAIRS.items():
        one, other, both = (current * np.array(on) for on in ((1, 0, 0), (0, 1, 0), (1, 1, 0)))
        alone = torque(PAIR_ANGLE, one, None) + torque(PAIR_ANGLE, other, None)
        coupled = [torque(PAIR_ANGLE, both, D) for D in YOKES]
        made += lines(f"{current} A in two phases: torque", "N m", published, [alone, *coupled])
    return made


def lines(name: str, unit: str, published: tuple[float, ...], ours: list[float]) -> list[Figure]:
    """Alone, and coupled with either yoke."""
    alone, coupled = published
    return [
        Figure(f"{name}, {of}", unit, "computed", theirs, own)
        for of, theirs, own in zip(
            ("alone", "coupled", "coupled, thick yoke"),
            (alone, coupled, coupled),
            ours,
            strict=True,
        )
    ]


if __name__ == "__main__":
    show(rows("tanala_coupled", figures()))
