"""Piecewise polynomials in one current, in a form that CasADi can differentiate.

A piece adds what it rises by from its own knot to the current, or to its end: x, the part of the
piece below the current, is 0 before the piece and 1 past it. The last piece has no end.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np

from reluctance.base.arrays import FloatArray


def widths(knots: FloatArray) -> FloatArray:
    """Of the pieces that begin at the knots; the last is as wide as it is far from zero."""
    return np.append(np.diff(knots), knots[-1])


def parts(i: Any, knots: FloatArray) -> list[Any]:
    """The part of each piece below the currents i, a CasADi vector."""
    import casadi as ca

    found = []
    for knot, width in zip(knots, widths(knots), strict=True):
        x = (i - knot) / width
        if knot > 0:
            x = ca.fmax(x, 0)
        if knot < knots[-1]:
            x = ca.fmin(x, 1)
        found.append(x)
    return found


def risen(x: Iterable[Any], coefficients: Iterable[Any]) -> Any:
    """The sum of all pieces: coefficients[k] of piece k, of the powers 1, 2, ... of x[k]."""
    total = 0.0
    for part, powers in zip(x, coefficients, strict=True):
        inner = 0.0
        for factor in reversed(list(powers)):
            inner = part * (factor + inner)
        total += inner
    return total
