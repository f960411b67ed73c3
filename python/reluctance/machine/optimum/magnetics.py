"""Flux linkage and torque of one phase as functions that CasADi can differentiate."""

from typing import Any

from reluctance.machine.library import model_of
from reluctance.machine.models import Magnetics, PhaseMagnetics


def phase_magnetics(machine: Magnetics) -> PhaseMagnetics:
    """Flux linkage and torque of one phase, ready for a programme in which only i is unknown.

    The returned function maps i (n,) [A], a CasADi vector, and theta_e (n,), numbers in
    [0, 2 pi), to the CasADi vectors psi (n,) [Wb] and tau (n,) [N m]. As the angles are numbers,
    the mirror at alignment is no branch in the programme, and a flux map is a polynomial spline in
    current at each of them. All models are exact, not sampled.
    """
    return model_of(machine).symbolic(machine)


def content(machine: Magnetics) -> list[Any]:
    """What a machine's results depend on, for a cache key."""
    return model_of(machine).content(machine)
