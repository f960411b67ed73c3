"""The limit over the speeds of an efficiency map."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from reluctance.base.errors import ParameterError
from reluctance.explore.efficiency_map.map import EfficiencyMap
from reluctance.machine.optimum import Envelope, torque_speed_envelope

SPEEDS = 9  # of the line
POINTS_PER_PHASE = 60  # grid points of a period for each phase


def envelope_over(
    found: EfficiencyMap, *, progress: Callable[[float], None] | None = None
) -> Envelope:
    """The greatest torque without ripple of any controller, at the map's voltage.

    Raises
    ------
    ParameterError
        If the bridge is not one that the limit is computed for.
    """
    drive = found.drive
    if drive.converter.bridge != "asymmetric":
        raise ParameterError(
            f"[converter] bridge = {drive.converter.bridge!r}: the limit is computed for phases "
            "that share no switch; add --no-envelope"
        )
    return torque_speed_envelope(
        replace(drive.at(0.0), u_dc=found.u_dc),
        np.linspace(found.omega[0], found.omega[-1], SPEEDS),
        n_points=POINTS_PER_PHASE * drive.machine.n_phases,
        direction=1 if found.tau[0] > 0 else -1,
        progress=progress,
    )
