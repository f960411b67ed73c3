"""A row of a flux table, at one angle or one current, that is of another run or scale.

Inside a table it is held against its neighbours. So are the first and the last angle, as flux
linkage is even about unaligned and aligned. At the ends of the current, iron tells: the incremental
inductance of no phase rises with its current. So the last row is not above the line through the two
before it, nor the first below the line from zero to the second. The line through the first two
begins at zero where nothing saturates, as unaligned, and above it elsewhere.
"""

import numpy as np

from reluctance.machine.maps.no_current import NO_FLUX
from reluctance.machine.maps.table import Array, FluxTable

NOISE = 0.003  # of the largest flux linkage; a table with more is refused
ALIKE = 1.2  # largest over least of errors that say the same
ANOTHER = "compute it again: it is of another run or scale; for noise use --repair"

Wrong = tuple[float, str, str]  # scale error of a row [1], which row, the remedy


def polynomial(x: Array, at: float) -> Array:
    """Weights (n,) of the values at x (n,) in what the polynomial through them is at another place,
    by J.-L. Lagrange."""
    return np.array([np.prod([(at - b) / (a - b) for b in x if b != a]) for a in x])


def residuals(x: Array, values: Array) -> Array:
    """Each inner row of `values` minus the cubic through its four neighbours, (n - 4, m)."""
    rows = []
    for n in range(2, len(x) - 2):
        near = [n - 2, n - 1, n + 1, n + 2]
        weights = polynomial(x[near], x[n])
        misfit = values[n] - weights @ values[near]
        rows.append(misfit / np.sqrt(1 + np.dot(weights, weights)))
    return np.asarray(rows).reshape(-1, values.shape[1])


def _from_one_side(x: Array, values: Array, side: int) -> Array:
    """Each row minus the parabola through the three rows before it (side -1) or behind it (1), of
    the row; three at each end are left out."""
    rows = []
    for n in range(3, len(x) - 3):
        near = [n + side * k for k in (1, 2, 3)]
        rows.append((values[n] - polynomial(x[near], x[n]) @ values[near]) / _size(values[n]))
    return np.asarray(rows)


def _size(values: Array) -> Array:
    """What errors are relative to: nothing is relative to nothing."""
    return np.where(values > 0, values, np.inf)


def wrong_row(table: FluxTable, noise: float) -> Wrong:
    """The row with the largest error; 0.0 and no name where there is none. noise: of the flux
    linkage, of its maximum."""
    return max(_inner(table, noise), *_end_angles(table, noise), *_end_currents(table, noise))


def _inner(table: FluxTable, noise: float) -> Wrong:
    """Against the rows on both sides.

    A row off by d leaves d in its own residual and -2/3 d in the next; the second difference of the
    residuals lifts that pattern by 5/3 above the smooth misfit of a coarse grid. A row counts where
    it stands out four times from the other rows and from the noise.

    A corner of the flux linkage, as where the poles of a machine with a short gap begin to overlap,
    leaves nearly the same pattern. But the rows of one side of it continue to it, and a row that is
    off by d is off by d, or half of it at least, from both sides.
    """
    worst, name = 0.0, ""
    inner = table.psi[1:]
    cases = (
        (np.degrees(table.theta_e), inner.T, "deg el."),
        (table.i[1:], inner, "A"),
    )
    for x, values, unit in cases:
        if len(x) < 9:
            continue
        relative = residuals(x, values) * np.sqrt(1 + 34 / 36) / _size(values[2:-2])
        pattern = (relative[1:-1] - (relative[2:] + relative[:-2]) / 2) * 3 / 5
        sides = [np.median(_from_one_side(x, values, side), axis=1) for side in (-1, 1)]
        off = np.median(pattern, axis=1)
        both = np.all([side * np.sign(off) > np.abs(off) / 2 for side in sides], axis=0)
        score = np.where(both, np.abs(off), 0.0)
        n = int(score.argmax())
        others = np.delete(score, range(max(0, n - 3), min(len(score), n + 4)))
        size = np.median(_size(values[n + 3]))
        scatter = noise * table.psi.max() / size / np.sqrt(values.shape[1])
        if others.size and score[n] > max(4 * np.median(others), 4 * scatter, worst):
            worst, name = float(score[n]), f"row at {x[n + 3]:g} {unit}"
    return worst, name, ANOTHER


def _end_angles(table: FluxTable, noise: float) -> list[Wrong]:
    """The first angle, and the last of a half period, where three continuations to it agree with
    each other and not with it: the even parabolas through the first two and the next two rows
    beside it, and the parabola through three. At or near a corner of the flux linkage they differ.
    """
    found = []
    theta, psi = table.theta_e, table.psi[1:]
    ends = (0, slice(0, 4)), (180, slice(-1, -5, -1))
    for name, order in ends if table.half else ends[:1]:
        rows, x = psi[:, order].T, np.abs(theta[order] - theta[order][0])
        near = polynomial(x[1:3] ** 2, 0.0) @ rows[1:3]
        far = polynomial(x[2:] ** 2, 0.0) @ rows[2:]
        ways = near, far, polynomial(x[1:], 0.0) @ rows[1:]
        off = [float(np.median(rows[0] - way)) for way in ways]
        least, most = sorted(map(abs, off))[:: len(off) - 1]
        alike = abs(sum(map(np.sign, off))) == len(off) and most < ALIKE * least
        if alike and least > 8 * noise * psi.max() / np.sqrt(len(psi)):
            expected = float(np.median(rows[0])) - off[0]
            found.append((abs(off[0] / expected), f"row at {name} deg el.", ANOTHER))
    return found


def _end_currents(table: FluxTable, noise: float) -> list[Wrong]:
    """The first and the last current, and all against zero."""
    i, psi = table.i, table.psi
    most = float(psi.max())

    def off(excess: Array, expected: Array) -> float:
        """The median over the angles, where it is above the noise of three rows, and more of the
        largest flux linkage than noise may be: what a repair leaves is of this size."""
        scatter = most * max(4 * noise * np.sqrt(6 / excess.size), NOISE)
        median = float(np.median(excess))
        return median / float(np.median(expected)) if median > scatter else 0.0

    line = psi[-2] + (psi[-2] - psi[-3]) * (i[-1] - i[-2]) / (i[-2] - i[-3])
    chord = psi[2] * i[1] / i[2]
    found = [
        (off(psi[-1] - line, line), f"row at {i[-1]:g} A", ANOTHER),
        (off(chord - psi[1], chord), f"row at {i[1]:g} A", ANOTHER),
    ]
    begun = psi[1] - (psi[2] - psi[1]) * i[1] / (i[2] - i[1])  # at or above zero, as iron bends
    least = float(begun.min())  # unaligned, nothing saturates
    start = least if least > 0 else min(float(np.median(begun)), 0.0)
    if abs(start) > most * max(4 * noise, NO_FLUX):
        found.append((abs(start) / most, "every row but 0 A", f"subtract {start:.2g} Wb from them"))
    return found
