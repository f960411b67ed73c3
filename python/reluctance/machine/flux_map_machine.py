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


class FluxMapMachine(MachineFile):
    """A table of flux linkage and torque over current and angle, wherever it is from."""

    core = _core.FluxMap

    pair_factor: float = Field(1.0, ge=0)  # on what pairs of phases add

    @staticmethod
    def symbolic(machine: _core.FluxMap) -> PhaseMagnetics:
        """At a fixed angle psi is a cubic and tau a quartic in current between two knots.

        Five samples give each polynomial exactly. A piece adds what it rises by from its own knot
        to the current, or to its end: x, the part of the piece below the current, is 0 before the
        piece and 1 past it. The last piece has no end.
        """
        knots = machine.knots
        widths = np.append(np.diff(knots), knots[-1])
        nodes = np.linspace(0.0, 1.0, 5)
        from_samples = np.linalg.inv(np.vander(nodes, increasing=True))[1:]  # powers 1 to 4

        def powers(knot: float, width: float, theta_e: FloatArray, column: int) -> FloatArray:
            i, angle = np.meshgrid(knot + nodes * width, theta_e, indexing="ij")
            values = _core.magnetics(machine, i.ravel(), angle.ravel())[:, column]
            return np.asarray(from_samples @ values.reshape(i.shape))

        def magnetics(i: Any, theta_e: FloatArray) -> tuple[Any, Any]:
            import casadi as ca

            psi, tau = 0.0, 0.0
            for knot, width in zip(knots, widths, strict=True):
                x = (i - knot) / width
                if knot > 0:
                    x = ca.fmax(x, 0)
                if knot < knots[-1]:
                    x = ca.fmin(x, 1)
                a, b = (powers(knot, width, theta_e, column) for column in (0, 2))
                psi += x * (a[0] + x * (a[1] + x * a[2]))
                tau += x * (b[0] + x * (b[1] + x * (b[2] + x * b[3])))
            return psi, tau

        return magnetics

    @staticmethod
    def content(machine: _core.FluxMap) -> list[Any]:
        tables = hashlib.sha256(machine.knots.tobytes() + machine.coefficients.tobytes())
        return ["flux map", machine.N_r, machine.theta_span, tables.hexdigest()]
