"""A single sample of a flux table that is wrong, as by a digit: against its neighbours.

A sample that is off by d is off by d from the cubics through its neighbours, over the angle and
over the current alike. The cubics over the angle at the two currents next to it do not have this
misfit, nor have those over the current at the two angles next to it. What a machine has looks
otherwise. A corner over the angle, as where poles begin to overlap, is there at the currents before
and behind as well, and the knee of saturation at the angles before and behind. Noise is everywhere.
"""

from dataclasses import dataclass

import numpy as np

from reluctance.machine.maps.single_row import polynomial
from reluctance.machine.maps.table import Array, FluxTable

# Evidence (2026-11-27): of 22120 tables, of the library and of formulae with sharp corners and
# knees, also coarse (every 2nd to 9th angle, every 2nd to 4th current) and with noise of 0 to 1 %,
# the worst stands out 18.5 times. One sample that is off by 1 % in the maps of the library stands
# out more than 20 times at 9 of 10 places, with noise of 0.1 % one that is off by 8 % at 8 of 10.
STANDS_OUT = 20.0  # times from the others
APART = 0.25  # of its own: less differ the misfits before and behind it from each other
OTHERS = 0.01  # of the samples may stand out as far, as more than one may be wrong
SEVERAL = 4  # samples that may be wrong in a small table
LEAST_CURRENTS, LEAST_ANGLES, MOST_SMALL = 6, 7, 60  # a smaller table is not judged
FLOOR = 0.05  # of the largest flux linkage: errors are relative to a sample, down to this


@dataclass(frozen=True)
class WrongSample:
    """The sample that stands out most from its neighbours."""

    i: float  # [A]
    theta_e: float  # [rad]
    psi: float  # [Wb]
    expected: float  # by the cubic through its neighbours over the angle [Wb]
    error: float  # psi less expected, over expected or FLOOR of the largest flux linkage [1]
    more: int  # others that stand out as far


def wrong_sample(table: FluxTable) -> WrongSample | None:
    """The worst of the single samples that are wrong; None where there is none."""
    inside = table.theta_e < 2 * np.pi - 1e-9  # a whole period has its beginning once
    theta_e, psi = table.theta_e[inside], table.psi[:, inside]
    n_i, n_theta = psi.shape
    if n_i < LEAST_CURRENTS or n_theta < LEAST_ANGLES or (n_i - 1) * n_theta < MOST_SMALL:
        return None
    mirror = np.r_[2:0:-1]
    i = np.append(-table.i[mirror], table.i)  # flux linkage is odd in the current
    of_i, noise_i = _off(i, np.vstack([-psi[mirror], psi]), 3, n_i - 1)
    if table.half:  # and even about both ends of a half period
        x = np.concatenate([-theta_e[mirror], theta_e, 2 * np.pi - theta_e[-2:-4:-1]])
        values = np.hstack([psi[:, mirror], psi, psi[:, -2:-4:-1]])
    else:
        x = np.concatenate([theta_e[-2:] - 2 * np.pi, theta_e, theta_e[:2] + 2 * np.pi])
        values = np.hstack([psi[:, -2:], psi, psi[:, :2]])
    of_theta, noise_theta = _off(x, values[1:].T, 2, n_theta)
    psi, off = psi[1:], of_theta.T
    floor = FLOOR * np.abs(psi).max()
    a = of_i / noise_i / (np.abs(psi) + floor)
    b = off / noise_theta.T / (np.abs(psi) + floor)
    usual = np.sort(_both(a, b), axis=None)[::-1][max(SEVERAL, int(OTHERS * psi.size))]
    own_a, unlike_a = (
        v.T for v in _alone(np.pad(a, ((0, 0), (1, 1)), mode="reflect" if table.half else "wrap").T)
    )
    own_b, unlike_b = _alone(np.vstack([np.zeros(n_theta), b, b[-2]]))  # at 0 A all angles have 0
    score = _both(own_a, own_b)
    alone = (unlike_a < APART * np.abs(own_a)) & (unlike_b < APART * np.abs(own_b))
    found = alone & (score > STANDS_OUT * usual)
    if not found.any():
        return None
    k, n = np.unravel_index(int(np.where(found, score, 0.0).argmax()), score.shape)
    found[max(0, k - 2) : k + 3, max(0, n - 2) : n + 3] = False  # it touches the cubics of these
    expected = float(psi[k, n] - off[k, n])
    return WrongSample(
        i=float(table.i[1 + k]),
        theta_e=float(theta_e[n]),
        psi=float(psi[k, n]),
        expected=expected,
        error=float(off[k, n]) / max(abs(expected), float(floor)),
        more=int(found.sum()),
    )


def _off(x: Array, values: Array, first: int, count: int) -> tuple[Array, Array]:
    """Rows from `first` on minus the cubics through their four nearest neighbours, (count, m); and
    the deviation of that where all samples have one of 1, (count, 1)."""
    rows, noise = [], []
    for n in range(first, first + count):
        start = min(n - 2, len(x) - 5)
        near = [m for m in range(start, start + 5) if m != n]
        weights = polynomial(x[near], x[n])
        rows.append(values[n] - weights @ values[near])
        noise.append(np.sqrt(1 + np.dot(weights, weights)))
    return np.asarray(rows), np.asarray(noise)[:, None]


def _both(a: Array, b: Array) -> Array:
    """The smaller of two magnitudes where the signs agree, else 0."""
    return np.where(a * b > 0, np.minimum(np.abs(a), np.abs(b)), 0.0)


def _alone(values: Array) -> tuple[Array, Array]:
    """Inner rows less the mean of the rows before and behind, and how far these two differ."""
    before, behind = values[:-2], values[2:]
    return values[1:-1] - (before + behind) / 2, np.abs(before - behind)
