"""The angles of a table with the current that each torque takes: what the core interpolates.

Currents are inverted from the mean torque over the current, as for fixed angles (current_table.py),
at each speed of the table and at torques that lie closer where they are small.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from reluctance import _core
from reluctance.base.arrays import FloatArray
from reluctance.base.cache import cached
from reluctance.drive.laws.angle_table import AngleTable
from reluctance.drive.laws.pulses import chopped, pulses
from reluctance.drive.tables.known import Known
from reluctance.machine.optimum.magnetics import content

ALGORITHM = 3  # raised when the same table gives other currents
TORQUES = 12  # between 0 and the top, in equal steps of their square root, besides the table's
FAR = 1 / 8  # of the top speed: between speeds farther apart currents are computed too
NEAR = 0.02  # of the top: a torque this close to one of the table's is left out
CURRENTS = 28  # of a curve that is inverted


@dataclass(frozen=True)
class Currents:
    """At speeds and torques, (n_speeds, n_torques) [A]."""

    i_ref: FloatArray


def pulse_table(known: Known, angles: AngleTable, half: float, *, hard: bool) -> _core.PulseTable:
    """The table of the core: for the speeds of the file and the one that the drive works at, up to
    the greatest torque of the two.

    Parameters
    ----------
    half : of the current band [A].
    hard : above it the leg demagnetizes.
    """
    omega, tau = _speeds(angles, known.omega_m), _torques(angles, known.tau_max)
    nodes = np.array([[angles.at(speed, torque) for torque in tau] for speed in omega])
    on, off = nodes[..., 0], nodes[..., 1]

    def compute() -> Currents:
        rows = [
            _currents(replace(known, omega_m=float(speed)), on[j], off[j], tau, half, hard)
            for j, speed in enumerate(omega)
        ]
        return Currents(np.array(rows))

    inputs = [
        *content(known.magnetics),
        *(known.n_phases, known.R, known.i_max, known.u_dc),
        *(values.tolist() for values in (omega, tau, on, off)),
        half,
        hard,
    ]
    found = cached(Currents, inputs, compute, algorithm=ALGORITHM)
    return _core.PulseTable(
        omega=omega.tolist(),
        tau=tau.tolist(),
        theta_on=on.ravel().tolist(),
        theta_off=off.ravel().tolist(),
        i_ref=found.i_ref.ravel().tolist(),
    )


def _speeds(angles: AngleTable, working: float) -> FloatArray:
    """Those of the table, the working one if it lies between them, and others where these are far
    apart."""
    ends = np.unique(np.clip([*angles.omega, working], angles.omega[0], angles.omega[-1]))
    parts = np.ceil(np.diff(ends) / (FAR * ends[-1])).astype(int)
    rows = [np.linspace(a, b, n + 1) for (a, b), n in zip(pairwise(ends), parts, strict=True)]
    return np.unique(np.concatenate(rows))


def _torques(angles: AngleTable, tau_max: float) -> FloatArray:
    """Zero, those of the table, and others between them."""
    top = max(angles.tau[-1], tau_max)
    more = top * np.linspace(0, 1, TORQUES + 1) ** 2
    apart = np.abs(more[:, None] - angles.tau).min(axis=1) > NEAR * top
    return np.unique([0.0, *angles.tau, *more[apart], top])


def _currents(
    known: Known,
    on: FloatArray,
    off: FloatArray,
    tau: FloatArray,
    half: float,
    hard: bool,
) -> FloatArray:
    """The current for each torque with its angles; where the angles do not reach it, i_max."""
    i = known.i_max * np.linspace(0, 1, CURRENTS) ** 1.5
    law = chopped(known, half, brakes=False, hard=hard)
    mean = pulses(law, on[:, None], off[:, None], i).tau
    rising = np.sqrt(np.maximum(np.maximum.accumulate(mean, axis=1), 0))  # about as the current
    found = []
    for wanted, curve in zip(np.sqrt(tau), rising, strict=True):
        steps = np.flatnonzero(np.diff(curve, prepend=-1.0) > 0)
        found.append(float(np.interp(wanted, curve[steps], i[steps])))
    return np.array(found)
