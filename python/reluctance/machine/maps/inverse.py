"""Inverse tables: current over flux linkage, as some tools export it."""

import numpy as np
from scipy.interpolate import CubicSpline

from reluctance.base.errors import ParameterError
from reluctance.machine.maps.table import Array

STRAIGHT, BENDS = 0.02, 0.05  # slopes: no saturation, and its opposite
EXCHANGED = (
    "the columns of current and flux linkage look exchanged: the flux linkage rises ever faster "
    "with the current, which no iron does; exchange their two names, each with its unit"
)


def is_inverse(i: Array, psi: Array) -> bool:
    """Whether a table bends upwards as current over flux linkage does: at no angle is the slope of
    its last third below that of its first, as it is in every machine that saturates."""
    third = len(i) // 3
    return third > 1 and bool(i[0] == 0) and _steepens(*_slopes(i, psi, third))


def _slopes(x: Array, y: Array, third: int) -> tuple[Array, Array]:
    """Over the first and the last `third` steps of x, at each angle."""
    first = (y[third] - y[0]) / (x[third] - x[0])
    return first, (y[-1] - y[-1 - third]) / (x[-1] - x[-1 - third])


def _steepens(first: Array, last: Array) -> bool:
    if not (first > 0).all():
        return False
    return bool((last / first).min() > 1 - STRAIGHT and (last / first).max() > 1 + BENDS)


def turned(levels: Array, currents: Array, notes: list[str]) -> tuple[Array, Array]:
    """Flux linkage over current, from current over flux linkage (`currents`, a row a level), up to
    the current that every angle reaches."""
    first, last = _slopes(levels, currents, max(1, len(levels) // 3))
    if _steepens(last, first):  # the other way round: it is flux linkage over current
        raise ParameterError(EXCHANGED)
    if levels[0] != 0 or not (np.diff(currents, axis=0) > 0).all():
        raise ParameterError(
            "current over flux linkage, an inverse table, whose current does not rise from 0 with "
            "the flux linkage at every angle; mend it, or export flux linkage over current"
        )
    top = float(currents[-1].min())
    i = np.linspace(0, top, len(levels))
    psi = np.stack([CubicSpline(of_angle, levels)(i) for of_angle in currents.T], axis=1)
    notes.append(
        f"an inverse table, current over flux linkage: turned, up to the {top:.4g} A that every "
        f"angle reaches (of {currents.max():.4g} A; {levels[-1]:.4g} Wb at the most)"
    )
    return i, psi
