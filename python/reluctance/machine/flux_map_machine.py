"""What machines whose core is a flux map have in common."""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np
from pydantic import Field

from reluctance import _core
from reluctance.base.arrays import FloatArray
from reluctance.machine.machine_file import MachineFile
from reluctance.machine.models import PhaseMagnetics
from reluctance.machine.piecewise import parts, risen, widths


class FluxMapMachine(MachineFile):
    """A table of flux linkage and torque over current and angle, wherever it is from."""

    core = _core.FluxMap

    pair_factor: float = Field(1.0, ge=0)  # on what pairs of phases add

    @staticmethod
    def symbolic(machine: _core.FluxMap) -> PhaseMagnetics:
        """At a fixed angle psi is a cubic and tau a quartic in current between two knots, of which
        five samples give each polynomial exactly."""
        knots = machine.knots
        nodes = np.linspace(0.0, 1.0, 5)
        from_samples = np.linalg.inv(np.vander(nodes, increasing=True))[1:]  # powers 1 to 4

        def powers(theta_e: FloatArray, column: int, most: int) -> list[FloatArray]:
            found = []
            for knot, width in zip(knots, widths(knots), strict=True):
                i, angle = np.meshgrid(knot + nodes * width, theta_e, indexing="ij")
                values = _core.magnetics(machine, i.ravel(), angle.ravel())[:, column]
                found.append(np.asarray(from_samples @ values.reshape(i.shape))[:most])
            return found

        def magnetics(i: Any, theta_e: FloatArray) -> tuple[Any, Any]:
            x = parts(i, knots)
            return risen(x, powers(theta_e, 0, 3)), risen(x, powers(theta_e, 2, 4))

        return magnetics

    @staticmethod
    def content(machine: _core.FluxMap) -> list[Any]:
        tables = hashlib.sha256(machine.knots.tobytes() + machine.coefficients.tobytes())
        return ["flux map", machine.N_r, machine.theta_span, tables.hexdigest()]
