"""The Pareto front of two figures: the points that no other point beats in both."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from reluctance.base.arrays import FloatArray


def front(x: FloatArray, y: FloatArray, most: Sequence[bool] = (False, False)) -> NDArray[np.intp]:
    """Rows of the front, by rising x.

    Parameters
    ----------
    x, y : ndarray, shape (n,)
        Both better when less. Points with NaN are on no front.
    most : two of bool
        True where more is better.

    Examples
    --------
    >>> front(np.array([1.0, 2.0, 3.0]), np.array([5.0, 6.0, 1.0])).tolist()
    [0, 2]
    """
    a, b = (np.asarray(v, float) * (-1 if m else 1) for v, m in zip((x, y), most, strict=True))
    rows = np.flatnonzero(~(np.isnan(a) | np.isnan(b)))
    order = rows[np.lexsort((b[rows], a[rows]))]
    least = np.minimum.accumulate(b[order])
    first = np.append(True, least[1:] < least[:-1])[: len(order)]
    kept = order[first]
    return np.asarray(kept[np.argsort(np.asarray(x, float)[kept], kind="stable")])
