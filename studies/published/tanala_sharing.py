"""Question: has the published cubic torque sharing of a 12/8 e-bike drive the same ripple here?

    python studies/published/tanala_sharing.py

36 V, switches of 4 mohm, diodes of 0.8 V, at most 29.19 A, a held speed. A phase begins at 3 deg
mechanical from unaligned and takes over within 4.5 deg, which the source's search over twelve pairs
found best at every point; its torque reference is raised until the mean torque is the one asked.
Each phase follows a reference of current with three levels of voltage: magnetized until the
reference, then freewheeling, and demagnetized above a band of +-0.1 A or 1 %. Ripple is
(max - min)/mean of the torque over an electrical period. The source finds no torque reference, up
to 2.5 times the torque, at three more points.

Source: the repository of tanala_12_8.py @ ed33e25, results/revision/revision_all.json, tsf;
conditions in srm_ebike/tsf.py, drive.py, losses.py. Its currents of references are of a table every
0.1 deg mechanical, taken without interpolation; so here. It steps plant and control by the same
steps, 1800 to an electrical period or 25 us if that is less, by Euler's rule; here the plant is
solved between the samples. It computes one phase and shifts it; here all phases run. Its machine
is its own field table; here it is the field of this program.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
from figure import Figure, rows, show
from scipy.optimize import brentq
from tanala_12_8 import I_MAX, OUT, machine_file

import reluctance as rl
from reluctance import _core
from reluctance.drive.drive import Drive, drive_from
from reluctance.drive.run.result import Result
from reluctance.machine.library import machine_table

N_R, N_PHASES, STROKE = 8, 3, 15.0  # mechanical [deg]
F_SAMPLE, LEAST_STEPS = 40e3, 1800  # [Hz], to an electrical period
ON, OVERLAP = 3.0, 4.5  # mechanical [deg]
GRID = (3.0, 4.5, 6.0, 7.5), (1.5, 3.0, 4.5)  # of the source's search
TABLE_STEP, TABLE_CURRENTS = 0.1, 241  # of its references [deg mechanical]
PERIODS = 6  # of a run; the last one is evaluated
MOST = 2.5  # of the torque asked: its greatest torque reference


@dataclass(frozen=True)
class Point:
    """An operating point of the source, with ripple [%], rms current [A] and changes of state of a
    phase in a period; those without ripple are the ones where it finds no torque reference."""

    rpm: float
    tau: float
    ripple: float = math.nan
    i_rms: float = math.nan
    changes: float = math.nan

    @property
    def name(self) -> str:
        return f"{self.rpm:.0f} rpm, {self.tau:g} N m"

    @property
    def period(self) -> float:
        """Electrical [s]."""
        return 60 / (self.rpm * N_R)

    @property
    def steps(self) -> int:
        """Samples of a period, a multiple of the phases."""
        least = max(LEAST_STEPS, math.ceil(self.period * F_SAMPLE - 1e-9))
        return N_PHASES * math.ceil(least / N_PHASES)


POINTS = (
    Point(200, 1.5, 13.40, 7.061, 350),
    Point(200, 3.0, 10.39, 11.86, 376),
    Point(500, 3.0, 32.77, 12.31, 169),
    Point(800, 1.5, 39.15, 7.533, 68),
)
NONE_FOUND = Point(800, 3.0), Point(1200, 1.5), Point(1608, 1.48)


def drive(point: Point, control: dict[str, Any], *, tau: float | None = None) -> Drive:
    """The source's drive, with a law of this program; by default at the source's samples."""
    OUT.mkdir(parents=True, exist_ok=True)
    return drive_from(
        {
            "machine": machine_table(str(machine_file(OUT)), OUT),
            "converter": {"u_dc_V": 36.0, "R_switch_ohm": 4e-3, "v_diode_V": 0.8},
            "load": {"kind": "locked", "speed_rpm": point.rpm},
            "reference": {"kind": "torque", "tau_Nm": point.tau if tau is None else tau}
            if control["law"] != "angles"
            else {"kind": "none"},
            "control": {"T_s_us": point.period / point.steps * 1e6, **control},
            "sensing": {"comparators": "sampled"},
            "simulation": {"until_s": PERIODS * point.period},
        },
        name=point.name,
    )


@cache
def currents(step: float) -> tuple[np.ndarray, np.ndarray]:
    """Currents [A], and the torque at each of them at the angles of the table, (n_angles, n_i)."""
    machine = drive(POINTS[0], {"law": "torque_sharing"}).machine
    theta_e = np.radians(N_R * np.arange(0, 360 / N_R - step / 2, step))
    i = np.linspace(0, I_MAX, TABLE_CURRENTS)
    tau = np.array([machine.tau(i, np.full_like(i, angle)) for angle in theta_e])
    return i, np.maximum.accumulate(tau, axis=1)


def share(angle: float, on: float, overlap: float) -> float:
    """Cubic share of a phase at a mechanical angle from unaligned [deg]."""
    past = (angle - on) % (360 / N_R)
    rise = [min(max(x / overlap, 0.0), 1.0) for x in (past, past - STROKE)]
    into, out = (x * x * (3 - 2 * x) for x in rise)
    return into - out


@dataclass
class Published:
    """The published control: a function for `_core.controller_from`, and its memory."""

    i_ref: np.ndarray  # at the samples of a period, of a phase [A]
    legs: list[int] = field(default_factory=lambda: [-1] * N_PHASES)
    changes: list[int] = field(default_factory=list)  # at each sample, of all phases

    def __call__(self, y: _core.Measurement, reference: float) -> list[float]:
        """One sample. Returns the ORDER_COLUMNS of each phase, of which the leg alone matters, and
        the torque reference."""
        n = len(self.i_ref)
        changes = 0
        for k, last in enumerate(self.legs):
            j = round(y.theta_e / (2 * math.pi) * n - k * n / N_PHASES) % n
            i, i_ref = y.i[k], self.i_ref[j]
            leg = level(last, i, i_ref)
            changes += leg != last and i > 0
            self.legs[k] = leg
        self.changes.append(changes)
        timer = float(_core.Gate.timer.value)
        return [*[x for leg in self.legs for x in (*5 * [leg], timer, *13 * [0.0])], reference]


def level(last: int, i: float, i_ref: float) -> int:
    """Of the voltage, with hysteresis on a current."""
    if i_ref <= 0:
        return -1
    band = 0.5 * max(0.2, 0.02 * max(i_ref, 1.0))
    if i < i_ref - band:
        return 1
    if i > i_ref + band:
        return -1
    return 0 if last == 1 and i >= i_ref else last


def run(
    point: Point,
    tau: float,
    *,
    on: float = ON,
    overlap: float = OVERLAP,
    table_step: float = TABLE_STEP,
) -> tuple[Result, Published]:
    """The published control with a torque reference [N m]."""
    i, torques = currents(table_step)
    angles = 360 / N_R * np.arange(point.steps) / point.steps
    at = (angles / table_step + 1e-9).astype(int)
    wanted = [tau * share(angle, on, overlap) for angle in angles]
    i_ref = np.array([np.interp(t, torques[a], i) for t, a in zip(wanted, at, strict=True)])
    control = Published(np.where(np.array(wanted) > 0, i_ref, 0.0))
    given = drive(point, {"law": "torque_sharing"}, tau=tau)
    controller = _core.controller_from(N_PHASES, control)
    return rl.simulate(given, record=given.control.T_s, controller=controller), control


def last_period(result: Result, point: Point) -> slice:
    """Its samples, without the end."""
    end = round(PERIODS * point.period / (result.t[1] - result.t[0]))
    return slice(end - point.steps, end)


def mean_torque(result: Result, point: Point) -> float:
    return float(result.tau[last_period(result, point)].mean())


@cache
def trimmed(point: Point, table_step: float = TABLE_STEP) -> tuple[Result, Published]:
    """With the torque reference at which the mean torque is the one asked."""
    tau = reference(point, table_step)
    return run(point, tau, table_step=table_step)


def reference(point: Point, table_step: float = TABLE_STEP) -> float:
    """Of the torque, for a mean torque [N m]."""

    def lack(tau: float) -> float:
        return mean_torque(run(point, tau, table_step=table_step)[0], point) - point.tau

    return float(brentq(lack, 0.9 * point.tau, MOST * point.tau, xtol=1e-3 * point.tau))


def greatest(point: Point) -> float:
    """Mean torque with the greatest torque reference, of all pairs of angles [N m]."""
    pairs = [(on, overlap) for on in GRID[0] for overlap in GRID[1]]
    tau = MOST * point.tau
    return max(mean_torque(run(point, tau, on=a, overlap=b)[0], point) for a, b in pairs)


def ripple_pct(tau: np.ndarray) -> float:
    return float(100 * (tau.max() - tau.min()) / tau.mean())


def figures() -> list[Figure]:
    """Ripple, current and changes of state where the source has them; and the torque elsewhere."""
    made = []
    for point in POINTS:
        result, control = trimmed(point)
        period = last_period(result, point)
        ours = (
            ripple_pct(result.tau[period]),
            float(np.sqrt(np.mean(result.i[:, period] ** 2))),
            sum(control.changes[-point.steps :]) / N_PHASES,
        )
        published = (point.ripple, point.i_rms, point.changes)
        words = ("ripple", "%"), ("rms current", "A"), ("changes of a phase in a period", "1")
        made += [
            Figure(f"{point.name}: {word}", unit, "computed", theirs, own)
            for (word, unit), theirs, own in zip(words, published, ours, strict=True)
        ]
    return [
        *made,
        *(
            Figure(f"{point.name}: greatest mean torque", "N m", "at most", point.tau, most)
            for point, most in ((point, greatest(point)) for point in NONE_FOUND)
        ),
    ]


if __name__ == "__main__":
    show(rows("tanala_sharing", figures()))
