"""Two neighbouring phases that carry current: their co-energy less that of each alone.

Of a pair with currents a and b, the first phase at the electrical angle phi + delta/2 and the
second at phi - delta/2, delta apart as their poles stand,

    dW'(phi, a, b) = sum over p, q of C_pq(phi) f_p(a) f_q(b),

f cubic splines over the current, C cubic splines over the angle (include/srm/machine/coupling.hpp,
which simulation and control evaluate). A cross-section is its own mirror image, so dW'(phi, a, b) =
dW'(-phi, b, a): half a period is enough, and both phases have the same f. Torque and flux linkages
are derivatives of the one co-energy.

Samples have values and slopes at a few angles. C goes through the polynomials of degree 5 between
them, whose bend is that of a spline through the slopes, at CELLS equal cells of half a period or
more: there it has two continuous derivatives, as the integrator of a simulation needs.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import ceil, factorial

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import BPoly, CubicSpline, PPoly

from reluctance.machine.maps.surface import angle_coefficients

Array = NDArray[np.float64]
# What a rank may leave of the torque at the nodes, rms over the greatest change of torque: as much
# as the interpolation between the nodes leaves (docs/geometry.md) [1].
TOLERANCE = 0.002
# Columns of one co-energy differ by what splines over the nodes leave, some 2 %; a wrong unit or
# sign by 40 % and more [1].
WRONG = 0.1
# Cells of half a period, 5 deg each, a third of those of the samples of a geometry. With them the
# torque is within 0.1 % rms of its greatest value of the polynomials that the spline goes through;
# with 24 cells 0.34 % on the 6/4 machine of the library, NN.
CELLS = 36
# Past the last node the functions of the current cease within this part of it. Splines that go on
# would soon make the incremental inductance negative. No rule of the table alone can promise that
# it stays positive, for that of a phase alone is not in it. On the machines of the library it does,
# at any current, and a table that is cut foresees flux linkages to half of the greatest
# (tests/machine/test_geometry_pairs.py). With 1.0 the 8/6 machine of studies/coupling.py with like
# neighbours had none.
CEASES = 0.5  # [1]


@dataclass(frozen=True)
class PairSamples:
    """A pair at nodes, less each phase alone. Arrays are over angle, first and second current."""

    phi: Array  # (n_phi) from 0 to pi [rad]
    i: Array  # (n_i) rising, above 0 [A]
    energy: Array  # [J]
    tau: Array  # [N m]
    psi_first: Array  # [Wb]
    psi_second: Array  # [Wb]


@dataclass(frozen=True, eq=False)
class PairTable:
    """The co-energy of a pair over angle and both currents."""

    N_r: int  # rotor poles
    i: Array  # (n_i) nodes of the currents, from 0 [A]
    f: Array  # (rank, n_i) at them
    phi: Array  # (n_phi) equally spaced nodes of the angle, from -pi to pi [rad]
    C: Array  # (n_phi, rank, rank) at them [J]
    given: Array  # angles of the samples that it was made of, from 0 to pi [rad]
    slope: Array  # of theirs, (n_given, rank, rank) [J/rad]

    @property
    def rank(self) -> int:
        """Functions of one current."""
        return len(self.f)

    @property
    def numbers(self) -> int:
        """That a controller has to keep."""
        return self.angle_coefficients.size + self.current_coefficients(self.knots).size

    @property
    def knots(self) -> Array:
        """Currents at which the pieces of f begin [A]."""
        return np.concatenate([self.i, _past(self.i[-1])])

    @property
    def angle_coefficients(self) -> Array:
        """B-spline coefficients of C over half a period, (cells + 3, rank, rank) [J]."""
        half = len(self.phi) // 2
        flat = self.C.reshape(len(self.phi), -1)
        columns = angle_coefficients(flat.T, half=False).T[half:]
        return np.ascontiguousarray(columns.reshape(-1, self.rank, self.rank))

    def current_coefficients(self, knots: Array) -> Array:
        """Powers 0 to 3 of the current above each knot, (n_knots, rank, 4). `self.knots` are among
        the knots."""
        powers = [self._over_current(knots, p) / factorial(p) for p in range(4)]
        return np.ascontiguousarray(np.stack([np.asarray(x).T for x in powers], axis=-1))

    def at(self, phi: ArrayLike, a: ArrayLike, b: ArrayLike) -> PairState:
        """Angle [rad] and currents of the first and the second phase [A], broadcast."""
        phi, a, b = np.broadcast_arrays(*(np.asarray(x, dtype=np.float64) for x in (phi, a, b)))
        C, rate = self.matrices(phi)
        fa, fb = (np.moveaxis(self._over_current(x), 0, -1) for x in (a, b))
        da, db = (np.moveaxis(self._over_current(x, 1), 0, -1) for x in (a, b))
        d2a, d2b = (np.moveaxis(self._over_current(x, 2), 0, -1) for x in (a, b))

        def joined(left: Array, matrix: Array, right: Array) -> Array:
            return np.asarray(np.einsum("...p,...pq,...q->...", left, matrix, right))

        return PairState(
            energy=joined(fa, C, fb),
            tau=self.N_r * joined(fa, rate, fb),
            psi_first=joined(da, C, fb),
            psi_second=joined(fa, C, db),
            L_first=joined(d2a, C, fb),
            L_second=joined(fa, C, d2b),
            L_mutual=joined(da, C, db),
            tau_first=self.N_r * joined(da, rate, fb),
            tau_second=self.N_r * joined(fa, rate, db),
        )

    def matrices(self, phi: Array) -> tuple[Array, Array]:
        """C [J] and its derivative in phi [J/rad] at angles (...) [rad]; (..., rank, rank) each."""
        turned = np.mod(phi + np.pi, 2 * np.pi) - np.pi
        return self._over_angle(turned), self._over_angle.derivative()(turned)

    def samples(self) -> PairSamples:
        """That give this table again."""
        i = self.i[1:]
        x = self.at(*np.meshgrid(self.given, i, i, indexing="ij"))
        f = self.f[:, 1:]
        tau = self.N_r * np.einsum("npq,pa,qb->nab", self.slope, f, f)
        return PairSamples(self.given, i, x.energy, tau, x.psi_first, x.psi_second)

    @cached_property
    def _over_angle(self) -> CubicSpline:
        return CubicSpline(self.phi, self.C, bc_type="periodic")

    @cached_property
    def _over_current(self) -> PPoly:
        spline = CubicSpline(self.i, self.f, axis=1)
        past, i = _past(self.i[-1]), float(self.i[-1])
        value, slope, bend = (np.asarray(spline(i, p)) for p in range(3))
        middle = -slope / (past[0] - i) - bend / 2  # so that the slope ceases with the bend
        pieces = []
        none = np.zeros_like(value)
        for end, until in zip(past, (middle, none), strict=True):
            h, rate = end - i, (until - bend) / (end - i)
            pieces.append(np.stack([rate / 6, bend / 2, slope, value]))
            value = value + h * (slope + h * (bend / 2 + h * rate / 6))
            slope, bend, i = slope + h * (bend + until) / 2, until, end
        pieces.append(np.stack([none, none, none, value]))
        c = np.concatenate([spline.c, np.stack(pieces, axis=1)], axis=1)
        ends = np.concatenate([self.knots, [2 * self.knots[-1]]])  # the last piece goes on
        return PPoly.construct_fast(c, ends, axis=1)


def _past(i_last: float) -> Array:
    """Where the pieces past the last node begin, but the first of them [A]."""
    return np.asarray(i_last * (1 + CEASES * np.array([0.5, 1.0])))


def mean_table(tables: list[PairTable]) -> PairTable:
    """The table of the mean co-energy: the functions of all of them side by side.

    tables : up to the same last current, each as often as it counts.
    """
    kinds = list(dict.fromkeys(tables))
    i = np.unique(np.concatenate([table.i for table in kinds]))
    phi = max((table.phi for table in kinds), key=len)
    given, ends = kinds[0].given, np.cumsum([table.rank for table in kinds])
    C = np.zeros((len(phi), ends[-1], ends[-1]))
    slope = np.zeros((len(given), ends[-1], ends[-1]))
    for table, end in zip(kinds, ends, strict=True):
        weight, own = tables.count(table) / len(tables), slice(end - table.rank, end)
        C[:, own, own] = weight * table.matrices(phi)[0]
        slope[:, own, own] = weight * table.matrices(given)[1]
    f = np.concatenate([table._over_current(i) for table in kinds])
    return PairTable(kinds[0].N_r, i, f, phi, C, given, slope)


@dataclass(frozen=True)
class PairState:
    """What a pair adds to its two phases; arrays of the shape asked for."""

    energy: Array  # [J]
    tau: Array  # [N m]
    psi_first: Array  # [Wb]
    psi_second: Array
    L_first: Array  # incremental inductance [H]
    L_second: Array
    L_mutual: Array
    tau_first: Array  # torque per current [N m/A]: flux linkage per rotor angle
    tau_second: Array


def pair_table(
    samples: PairSamples, N_r: int, *, rank: int | None = None, tolerance: float = TOLERANCE
) -> PairTable:
    """The table of a pair from its samples.

    Parameters
    ----------
    samples : PairSamples
    N_r : int
        Rotor poles.
    rank : int, optional
        Functions of one current; by default as many as `tolerance` takes.
    tolerance : float
        What they may leave of the torque at the nodes, rms over its greatest value [1].
    """
    energy, tau = samples.energy, samples.tau
    parts = [x / max(np.abs(x).max(), 1e-300) for x in (energy, tau)]
    sides = [np.moveaxis(x, axis, 0).reshape(len(samples.i), -1) for x in parts for axis in (1, 2)]
    basis, _, _ = np.linalg.svd(np.concatenate(sides, axis=1), full_matrices=False)

    def kept(x: Array, U: Array) -> Array:
        return np.asarray(np.einsum("nab,ap,bq->npq", x, U, U))

    def left_out(n: int) -> float:
        U = basis[:, :n]
        miss = np.einsum("npq,ap,bq->nab", kept(tau, U), U, U) - tau
        return float(np.sqrt((miss**2).mean()) / np.abs(tau).max())

    if rank is None:
        fits = [n for n in range(1, len(samples.i)) if left_out(n) <= tolerance]
        rank = fits[0] if fits else len(samples.i)
    U = basis[:, : min(rank, len(samples.i))]
    C, slope = kept(energy, U), kept(tau, U) / N_r
    over_angle = _smooth(samples.phi, C, slope)
    given = len(samples.phi) - 1
    cells = given * max(1, ceil(CELLS / given))
    half = np.linspace(0, np.pi, cells + 1)
    C = over_angle(half)
    C[[0, -1]] = (C[[0, -1]] + C[[0, -1]].transpose(0, 2, 1)) / 2  # where both phases are alike
    return PairTable(
        N_r=N_r,
        i=np.append(0.0, samples.i),
        f=np.insert(U.T, 0, 0.0, axis=1),
        phi=np.concatenate([-half[:0:-1], half]),
        C=np.concatenate([C[:0:-1].transpose(0, 2, 1), C]),
        given=samples.phi,
        slope=slope,
    )


def _smooth(phi: Array, C: Array, slope: Array) -> PPoly:
    """Polynomials of degree 5 over half a period through values and slopes; their bend at the nodes
    is that of a spline through the slopes."""
    whole = np.concatenate([-phi[:0:-1], phi])
    slopes = np.concatenate([-slope[:0:-1].transpose(0, 2, 1), slope])
    slopes[0] = slopes[-1] = (slopes[0] + slopes[-1]) / 2  # the same angle twice
    bend = CubicSpline(whole, slopes, bc_type="periodic").derivative()(phi)
    return PPoly.from_bernstein_basis(
        BPoly.from_derivatives(phi, np.stack([C, slope, bend], axis=1))
    )


def reasons(samples: PairSamples, N_r: int) -> list[str]:
    """Why samples are not of one co-energy of a machine; empty where they are.

    A table and its neighbour table mirror each other, so at 0 and at 180 deg both phases are alike;
    torque and flux linkages are the derivatives of the co-energy.
    """
    table = pair_table(samples, N_r)
    phi, a, b = np.meshgrid(samples.phi, samples.i, samples.i, indexing="ij")
    ends = samples.energy[[0, -1]]
    over_angle = N_r * CubicSpline(samples.phi, samples.energy).derivative()(samples.phi)
    found = table.at(phi, a, b)
    tests = (
        ("at 0 and 180 deg the phases are not alike", ends, ends.transpose(0, 2, 1)),
        ("tau_Nm is not the derivative of energy_J over the angle", samples.tau, over_angle),
        (
            "psi_first_Wb is not the derivative of energy_J over its current",
            samples.psi_first,
            found.psi_first,
        ),
        (
            "psi_second_Wb is not the derivative of energy_J over its current",
            samples.psi_second,
            found.psi_second,
        ),
    )
    return [
        f"{text}: off by {100 * off:.0f} %; check the columns, their units and the sign"
        for text, given, derived in tests
        if (off := _off(given, derived)) > WRONG
    ]


def _off(given: Array, derived: Array) -> float:
    """Rms over the greatest value."""
    most = max(float(np.abs(given).max()), 1e-300)
    return float(np.sqrt(((given - derived) ** 2).mean())) / most
