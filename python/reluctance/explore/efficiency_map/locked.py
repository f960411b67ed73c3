"""A drive at one operating point: its shaft locked, its dc link stiff, a torque asked for."""

import math

import numpy as np
from numpy.typing import NDArray

from reluctance.base.arrays import FloatArray
from reluctance.drive.drive import Drive
from reluctance.drive.tables.load import Load
from reluctance.drive.tables.pv_control import PvControl
from reluctance.drive.tables.sections import Reference
from reluctance.drive.tables.source import Source

PERIODS = 6  # electrical periods of a run; its second half counts
SHORTEST = 0.02  # run [s]
RISES = 0.1  # of a step of the reference: less is the limit of the drive


def at(drive: Drive, *, u_dc: float, omega: float, tau: float, tau_max: float) -> Drive:
    """The drive on a locked shaft at one operating point; its tables reach to tau_max."""
    return drive.computed(
        converter=drive.converter.model_copy(update={"u_dc_V": u_dc}),
        source=Source(),  # stiff
        load=Load(kind="locked", speed_rpm=omega * 30 / math.pi),
        reference=Reference(kind="torque", tau_Nm=tau),
        pv_control=PvControl(),
        control=drive.control.model_copy(update={"tau_max_Nm": tau_max}),
    )


def length(drive: Drive, omega: float) -> float:
    """How long a run takes for its key figures [s]."""
    return max(PERIODS * 2 * math.pi / (drive.machine.N_r * omega), SHORTEST)


def rising(asked: FloatArray, achieved: FloatArray) -> NDArray[np.bool_]:
    """Where a higher reference (n_t,) gives more torque (n_t,) [N m]: past it the drive is at its
    limit and only wastes."""
    steps = np.diff(np.maximum.accumulate(achieved))
    return np.append(True, steps > RISES * np.diff(asked))
