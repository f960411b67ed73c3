"""The machine models, each named once. Its class stands in a file of its own, which is read when a
machine asks for it."""

from collections.abc import Callable
from typing import Any, TypeAlias

from reluctance import _core
from reluctance.base.arrays import FloatArray

MODELS = {
    "lehuy": "lehuy_machine.LeHuyMachine",
    "map": "map_machine.MapMachine",
    "geometry": "geometry.geometry_machine.GeometryMachine",
}

# Of a phase, in the core (include/srm/machine/machines.hpp), and as functions of i (n,) [A], a
# CasADi vector, and theta_e (n,), numbers in [0, 2 pi): psi (n,) [Wb] and tau (n,) [N m].
Magnetics: TypeAlias = "_core.LeHuy | _core.FluxMap"
PhaseMagnetics = Callable[[Any, FloatArray], tuple[Any, Any]]
