"""Flux linkage and torque of one phase as functions that CasADi can differentiate."""

import hashlib
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reluctance import _core
from reluctance.machine.operating_point import Magnetics

FloatArray = NDArray[np.float64]
PhaseMagnetics = Callable[[Any, FloatArray], tuple[Any, Any]]


def phase_magnetics(machine: Magnetics) -> PhaseMagnetics:
    """Flux linkage and torque of one phase, ready for a programme in which only i is unknown.

    The returned function maps i (n,) [A], a CasADi vector, and theta_e (n,), numbers in
    [0, 2 pi), to the CasADi vectors psi (n,) [Wb] and tau (n,) [N m]. As the angles are numbers,
    the mirror at alignment is no branch in the programme, and a flux map is a polynomial spline in
    current at each of them. Both kinds are exact, not sampled.
    """
    return _flux_map(machine) if isinstance(machine, _core.FluxMap) else _le_huy(machine)


def content(machine: Magnetics) -> list[Any]:
    """What a machine's results depend on, for a cache key."""
    if isinstance(machine, _core.FluxMap):
        tables = hashlib.sha256(machine.knots.tobytes() + machine.coefficients.tobytes())
        return ["flux map", machine.N_r, machine.theta_span, tables.hexdigest()]
    return [machine.N_r, machine.L_u, machine.L_sat, machine.A, machine.B]


def _le_huy(machine: _core.LeHuy) -> PhaseMagnetics:
    """Formulae: include/srm/machine/lehuy.hpp."""
    N_r, L_u, L_sat = machine.N_r, machine.L_u, machine.L_sat
    A, B = machine.A, machine.B

    def magnetics(i: Any, theta_e: FloatArray) -> tuple[Any, Any]:
        import casadi as ca  # here: it is slow to import, and a cached result does without

        past = theta_e > np.pi
        x = np.where(past, 2 - theta_e / np.pi, theta_e / np.pi)
        f = x * x * (3 - 2 * x)
        df = np.where(past, -1.0, 1.0) * N_r * 6 / np.pi * x * (1 - x)
        E = ca.exp(-B * i)
        psi = L_u * i + ((L_sat - L_u) * i + A * (1 - E)) * f
        tau = ((L_sat - L_u) * i * i / 2 + A * i - A / B * (1 - E)) * df
        return psi, tau

    return magnetics


def _flux_map(machine: _core.FluxMap) -> PhaseMagnetics:
    """At a fixed angle psi is a cubic and tau a quartic in current between two knots.

    Five samples give each polynomial exactly. A piece adds what it rises by from its own knot to
    the current, or to its end: x, the part of the piece below the current, is 0 before the piece
    and 1 past it. The last piece has no end.
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
