"""What a drive leaves of the power of its array, and why."""

from __future__ import annotations

import numpy as np

from reluctance.base.units import from_si
from reluctance.drive.run.kpis import evaluated
from reluctance.drive.run.result import Result

TRACKS = 0.98  # of the energy available: a drive below it leaves more than tracking costs
AT_TOP = 0.999  # of the greatest speed, which the speed loop holds to 0.01 %


def left(result: Result) -> list[str]:
    """Why the array gives less than it could, on one line, where the pump needs no more."""
    drive, tracking = result.drive, result.kpis.tracking
    if tracking is None or tracking > TRACKS:
        return []
    top = drive.omega_nominal
    window = evaluated(result.periods, drive.machine.N_r)[0]
    t, turned = np.diff(window["t"]), np.diff(window["theta_m"])
    held = float(t[turned >= AT_TOP * top * t].sum())
    if held < (1 - TRACKS) * t.sum():
        return []
    return [
        f"the drive is at its greatest speed, {from_si(top, 'rpm'):.4g} rpm, for {held:.2g} of "
        f"{t.sum():.2g} s, and leaves what the array gives beyond: see [pump] speed_max_rpm, or "
        "take fewer modules"
    ]
