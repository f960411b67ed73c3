"""From a flux table to the machine: one co-energy spline whose flux provably rises with current.

The unknown is the incremental inductance, as a tensor of B-splines, quadratic in current and cubic
in angle:

    L_inc(i, theta) = sum_jm l_jm N_j(i) B_m(theta),   psi = int_0^i L_inc,   W_c = int_0^i psi

B-splines are positive, so l_jm > 0 proves L_inc > 0 everywhere, and psi and W_c vanish at zero
current by construction. Past the last current L_inc keeps its last value at every angle.

References
----------
J. O. Ramsay, "Monotone regression splines in action", Statistical Science 3(4), 1988: integrals of
B-splines with positive weights. C. de Boor, A Practical Guide to Splines, 2001, ch. XII: knots that
share the error out evenly.
"""

from dataclasses import dataclass
from functools import cached_property
from math import ceil, factorial

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline
from scipy.linalg import solve_banded
from scipy.optimize import nnls

from reluctance import _core
from reluctance.machine.maps.table import Array, FluxTable, around, fold

# Degrees of the spline through a table, the first that its samples resolve: where it agrees midway
# between samples with the spline two degrees lower to this share of the largest flux. The paper's
# machine on 31 currents to 450 A has 0.4 % (5 against 3) and 0.08 % (7 against 5); the sharp knee
# of the curves of NPF VECTOR (11 currents) has 1.3 % and gets the cubic.
RESOLVED = ((7, 0.002), (5, 0.01))
L_TOLERANCE = 2e-3  # of the incremental inductance, from fitting fewer pieces than samples [1]
L_FLOOR = 1e-3  # least inductance coefficient, of the largest in the table [1]
MIN_CELLS = 16  # angle cells in half a period: fewer make the proof of monotony pessimistic
MAX_CELLS = 96


@dataclass(frozen=True)
class Surface:
    """Co-energy as piecewise polynomials in current, cubic B-splines in angle.

    Attributes
    ----------
    knots : ndarray, shape (n_i,)
        Start of each current piece; the last piece has no end [A].
    coefficients : ndarray, shape (n_i, n_theta + 3, 5)
        Powers 0..4 of the current above the knot [J/A^p].
    theta_span : float
        pi where even about unaligned and aligned, else 2 pi [rad].
    psi_error_rms, psi_error_max : float
        Distance from the table, of its largest flux [1].
    notes : tuple of str
        What the fit had to change.
    """

    N_r: int
    knots: Array
    coefficients: Array
    theta_span: float
    psi_error_rms: float
    psi_error_max: float
    notes: tuple[str, ...]

    @cached_property
    def machine(self) -> _core.FluxMap:
        """The machine of the core."""
        return _core.FluxMap(
            N_r=self.N_r,
            knots=self.knots,
            coefficients=self.coefficients,
            theta_span=self.theta_span,
        )


def surface(table: FluxTable, *, symmetric: bool = True) -> _core.FluxMap:
    """The machine that a flux table describes; see `fit_surface`."""
    return fit_surface(table, symmetric=symmetric).machine


def fit_surface(table: FluxTable, *, symmetric: bool = True) -> Surface:
    """Fit the co-energy spline through the samples of a flux table.

    Parameters
    ----------
    table : FluxTable
        The samples. Its torque plays no part.
    symmetric : bool
        Even about unaligned and aligned. False keeps the two halves of a whole period apart.

    Returns
    -------
    Surface
        Through the samples where the table resolves the machine, else as near as rising flux
        allows.
    """
    half = fold(table) if symmetric else table
    span = np.pi if half.half else 2 * np.pi
    n_theta = angle_cells(half.theta_e, span)
    nodes = np.linspace(0, span, n_theta + 1)
    values = angle_coefficients(around(half, half.psi)(nodes), half.half)
    inductance, notes = _inductance(half.i, values)
    knots, coefficients = piece_coefficients(inductance)
    return assembled(table, half, knots, coefficients, span, notes)


def assembled(
    table: FluxTable,
    half: FluxTable,
    knots: Array,
    coefficients: Array,
    span: float,
    notes: tuple[str, ...],
) -> Surface:
    """The surface with its distance from the table it was fitted to."""
    machine = _core.FluxMap(
        N_r=table.N_r, knots=knots, coefficients=coefficients, theta_span=float(span)
    )
    i, theta_e = (x.ravel() for x in np.meshgrid(half.i, half.theta_e, indexing="ij"))
    error = (_core.magnetics(machine, i, theta_e)[:, 0] - half.psi.ravel()) / np.abs(half.psi).max()
    return Surface(
        N_r=table.N_r,
        knots=knots,
        coefficients=coefficients,
        theta_span=float(span),
        psi_error_rms=float(np.sqrt(np.mean(error**2))),
        psi_error_max=float(np.abs(error).max()),
        notes=notes,
    )


def angle_coefficients(values: Array, half: bool) -> Array:
    """B-spline coefficients (n, n_theta + 3) of a spline through `values` (n, n_theta + 1) at equal
    angles: (c[m-1] + 4 c[m] + c[m+1])/6 = value[m], mirrored at both ends or closed on itself."""
    if half:
        n = values.shape[1]
        bands = np.ones((3, n))
        bands[1] = 4
        bands[0, 1] = bands[2, n - 2] = 2  # c[-1] = c[1] and c[n] = c[n-2]
        inner = solve_banded((1, 1), bands, 6 * values.T).T
        return np.hstack([inner[:, 1:2], inner, inner[:, -2:-1]])
    n = values.shape[1] - 1
    eigenvalues = (4 + 2 * np.cos(2 * np.pi * np.arange(n // 2 + 1) / n)) / 6  # of the circulant
    ring = np.fft.irfft(np.fft.rfft(values[:, :-1], axis=1) / eigenvalues, n, axis=1)
    return np.hstack([ring[:, -1:], ring, ring[:, :2]])


def piece_coefficients(inductance: BSpline) -> tuple[Array, Array]:
    """Knots and coefficients (n_i, n, 5) of W_c from L_inc, its second derivative in current."""
    coenergy = inductance.antiderivative(2)
    knots = np.unique(inductance.t)
    powers = [coenergy.derivative(p)(knots) / factorial(p) for p in range(5)]
    coefficients = np.stack(powers, axis=-1)
    coefficients[0, :, :2] = 0.0  # no flux and no co-energy at zero current
    coefficients[-1, :, 3:] = 0.0  # the open piece keeps its last slope
    return knots, np.ascontiguousarray(coefficients)


def rise_problem(i: Array, t: Array, *, level: Array | float = 1.0) -> tuple[Array, Array]:
    """Flux at i[1:] of each inductance coefficient on the knots t, and third differences of them.

    The differences count each coefficient by the flux that it adds, so that narrow and wide pieces
    weigh alike, and in units of its `level`, so that the flat saturated part is held flat.
    """
    n = len(t) - 3
    design = BSpline(t, np.eye(n), 2).antiderivative()(i[1:])
    return design, np.diff(np.diag(design.max(axis=0) / level), 3, axis=0)


def rising(
    i: Array,
    values: Array,
    t: Array,
    *,
    weight: Array | float = 1.0,
    level: Array | float = 1.0,
    smoothing: float = 0.0,
) -> BSpline:
    """Inductance spline on the knots t with coefficients above the floor, nearest to flux `values`.

    Minimises |weight (psi - values)|^2 + smoothing |third differences|^2 column by column, each a
    non-negative least-squares problem (Lawson and Hanson 1974).
    """
    design, penalty = rise_problem(i, t, level=level)
    weights = np.broadcast_to(weight, len(i) - 1)[:, None]
    floor = L_FLOOR * float((values[1:] / i[1:, None]).max())
    matrix = np.vstack([weights * design, np.sqrt(smoothing) * penalty])
    samples = weights * (values[1:] - floor * i[1:, None])
    aim = np.vstack([samples, np.zeros((len(penalty), values.shape[1]))])
    columns = [nnls(matrix, column)[0] for column in aim.T]
    return BSpline(t, np.stack(columns, axis=1) + floor, 2)


def angle_cells(theta_e: Array, span: float) -> int:
    """Equal angle cells whose edges fall on the samples where these have a common spacing."""
    base = max(1, round(span / float(np.diff(theta_e).min())))
    least = MIN_CELLS * round(span / np.pi)
    return min(base * ceil(least / base), MAX_CELLS * round(span / np.pi))


def _inductance(i: Array, values: Array) -> tuple[BSpline, tuple[str, ...]]:
    """Inductance spline of the flux `values` (n_i, n) at the currents i."""
    floor = L_FLOOR * float((values[1:] / i[1:, None]).max())
    between = (i[1:] + i[:-1]) / 2
    for degree, agreement in RESOLVED:
        if len(i) > degree + 1:
            spline, lower = (make_interp_spline(i, values, k=k) for k in (degree, degree - 2))
            gap = np.abs(spline(between) - lower(between)).max() / np.abs(values).max()
            fitted = _few_pieces(spline, floor) if gap < agreement else None
            if fitted is not None:
                return fitted, ()
    fitted = _slope(make_interp_spline(i, values, k=3))
    if fitted.c.min() > floor:
        return fitted, ()
    ends = [0.0, 0.0, *i, i[-1], i[-1]]
    note = "flux does not rise with current by itself; nearest rising surface taken"
    return rising(i, values, np.asarray(ends), smoothing=1e-6), (note,)


def _few_pieces(target: BSpline, floor: float) -> BSpline | None:
    """Fewest pieces that keep the inductance of `target`; None where that is not positive."""
    i = np.linspace(0, target.t[-1], 1001)
    slope = _slope(target)
    wanted = slope(i)
    if wanted.min() < floor:
        return None
    # A cubic on a piece of width h misses the slope by h^3 |psi''''|/24 or so: knots are spread so
    # that this, relative to L_inc, is the same on all; the mean keeps neighbours of similar width.
    density = np.cbrt(np.abs(target.derivative(4)(i) / wanted).max(axis=1))
    density = density + density.mean() / 4 + 1e-9
    share = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2)])
    for n in (8, 12, 16, 20, 24, 32, 40, 48, 64):
        knots = np.interp(np.linspace(0, share[-1], n + 1), share, i)
        ends = [(1, slope(knots[0]))], [(1, slope(knots[-1]))]
        fitted = _slope(make_interp_spline(knots, target(knots), k=3, bc_type=ends))
        if fitted.c.min() > floor and np.abs(fitted(i) / wanted - 1).max() < L_TOLERANCE:
            return fitted
    return None


def _slope(spline: BSpline) -> BSpline:
    """Derivative without the zero coefficients that SciPy pads it with."""
    slope = spline.derivative()
    return BSpline(slope.t, slope.c[: len(slope.t) - slope.k - 1], slope.k)
