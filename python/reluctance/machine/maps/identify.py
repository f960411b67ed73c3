"""From voltage pulses at standstill to a flux table: psi = integral of (u - R i) dt.

The integral is nearly exact; the noise is in the current. So i and psi, each as a share of its
largest value, are turned by 45 degrees: the sum s and the difference d. The curve d(s) has a slope
between -1 and 1 also where the iron saturates, and is odd, since psi(-i) = -psi(i). A penalised
spline (P. Eilers, B. Marx, Statistical Science 11(2), 1996) smooths it at each angle; the repair of
flux tables (repair.py) then smooths along the angles.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import BSpline
from scipy.linalg import eigh

from reluctance.base.errors import ParameterError
from reluctance.machine.maps.conventions import settled
from reluctance.machine.maps.pulses import REST_ROWS, Recording, Trace, trace
from reluctance.machine.maps.raw import RawMap
from reluctance.machine.maps.repair import SMOOTHING, repair_map
from reluctance.machine.maps.table import Array, FluxTable
from reluctance.machine.maps.units import implausible

CURRENTS = 31  # of the table, with zero: test_identify.py bounds what this resolves
BINS = 120  # of s at an angle: ten times as wide as the noise of a 12-bit sensor with 8 LSB
CELLS = 40  # of the spline over s
SAME_ANGLE = 0.01  # of a half period: pulses nearer than this are of one clamped position
STEEPEST = 0.95  # slope beyond which the weight of a sample does not grow
LEVELS = np.linspace(0.3, 0.8, 6)  # of a pulse's top: where rise and fall are compared
NEAR = 0.1  # of the top: samples nearer to a level than this tell its flux linkage
FEWEST = 3  # of them
R_DISAGREES = 0.05  # between the resistance that closes the pulses and the given one: a note
R_REFUSED = 0.5  # likewise: one of the two is wrong
NEAR_1000 = (500.0, 2000.0)  # times the other: the unit of a column is wrong


@dataclass(frozen=True)
class Identified:
    """A flux table from pulses.

    Attributes
    ----------
    table : FluxTable
        Smoothed, flux rising with current; its notes say what was inferred and changed.
    R_closing : float or None
        The resistance with which the flux linkages of rising and falling current agree [ohm]; None
        where no pulse has both.
    n_pulses, n_angles : int
    i_noise : float
        Of the current readings before the pulses, rms [A].
    """

    table: FluxTable
    R_closing: float | None
    n_pulses: int
    n_angles: int
    i_noise: float


def identify(
    recording: Recording,
    *,
    N_r: int,
    R: float,
    i_max: float | None = None,
    angle_unit: str | None = None,
    angle_kind: str | None = None,
    zero: str | None = None,
    aligned_at: float | None = None,
) -> Identified:
    """The flux table behind recorded pulses.

    Parameters
    ----------
    recording : Recording
    N_r : int
        Rotor poles.
    R : float
        Resistance between the points where the voltage was measured [ohm].
    i_max : float, optional
        Last current of the table [A]; by default the largest that every angle reached.
    angle_unit, angle_kind, zero, aligned_at
        As in `read_map`.

    Raises
    ------
    ParameterError
        One line: what is wrong, and what to do.
    """
    if not 0 <= R < np.inf:
        raise ParameterError(f"R_ohm = {R:g}, need the resistance of the phase; pass --R_ohm")
    at: dict[float, list[Trace]] = {}
    for pulse in recording.pulses:
        try:
            at.setdefault(pulse.angle, []).append(trace(pulse))
        except ParameterError as fault:
            raise ParameterError(f"angle {pulse.angle:g}: {fault}") from None
    angles, groups = _positions(at)
    reached = min(max(float(t.i.max()) for t in traces) for traces in groups)
    i_top = reached if i_max is None else i_max
    if not 0 < i_top <= 1.02 * reached:
        raise ParameterError(
            f"i_max_A = {i_top:g}, but not every angle reached more than {reached:.4g} A; record "
            "longer pulses or lower --i_max_A"
        )
    i = np.linspace(0.0, i_top, CURRENTS)
    psi = np.stack([_flux(traces, R, i) for traces in groups], axis=1)
    angles, psi = _closed(
        angles, psi, N_r, angle_unit or recording.unit, angle_kind or recording.kind
    )
    raw = RawMap(i, angles, psi, None, "currents_down", N_r, recording.unit, recording.kind)
    R_closing = _closing([t for traces in groups for t in traces])
    doubt = ""
    if R_closing is not None and abs(R_closing - R) > R_DISAGREES * R:
        apart = max(R, R_closing) / max(min(R, R_closing), 1e-12)
        check = "the resistance, the voltage's offset, and the drops of the devices"
        if NEAR_1000[0] < apart < NEAR_1000[1]:
            check = (
                "the units of current, voltage and resistance, which are a factor of some 1000 "
                "apart: a column names its own, as i_mA, u_mV"
            )
        doubt = (
            f"rising and falling currents agree with {R_closing:.4g} ohm, not with R_ohm = {R:g}: "
            f"check {check}"
        )
        if abs(R_closing - R) > R_REFUSED * max(R, R_closing):  # before it bends the flux linkage
            raise ParameterError(doubt)
    table = settled(
        raw, angle_unit=angle_unit, angle_kind=angle_kind, zero=zero, aligned_at=aligned_at
    )
    if (size := implausible(i_top, float(np.abs(table.psi).max()))) is not None:
        raise ParameterError(
            f"{size}; check the units of time, voltage and current: a column names its own, as "
            "t_ms, u_mV, i_mA"
        )
    smooth = repair_map(table)
    short = [t for traces in groups for t in traces if not t.rested]
    noted = [doubt] if doubt else []
    if short:
        noted.append(
            f"{len(short)} of {len(recording.pulses)} pulses have fewer than {REST_ROWS + 1} rows "
            "at rest before them: the offsets of their voltage and current are left in; record "
            "more rows before each"
        )
    notes = (*table.notes, *smooth.notes, *noted)
    return Identified(
        table=replace(smooth.table, notes=notes),
        R_closing=R_closing,
        n_pulses=len(recording.pulses),
        n_angles=len(angles),
        i_noise=float(np.median([t.noise for traces in groups for t in traces])),
    )


def _positions(at: dict[float, list[Trace]]) -> tuple[Array, list[list[Trace]]]:
    """The clamped positions, rising, with their pulses: angles that differ by the encoder's last
    count only are one."""
    written = np.array(sorted(at))
    apart = SAME_ANGLE * (written[-1] - written[0])
    parts = np.split(written, np.flatnonzero(np.diff(written) > apart) + 1)
    groups = [[t for angle in part for t in at[float(angle)]] for part in parts]
    means = [np.average(part, weights=[len(at[float(angle)]) for angle in part]) for part in parts]
    return np.array(means), groups


def _closed(
    angles: Array, psi: Array, N_r: int, unit: str | None, kind: str | None
) -> tuple[Array, Array]:
    """A whole period whose last angle is left out, closed by its first: clamped positions are not
    even, as `settled` would want them. Others, and angles of which too little is said, as given."""
    if len(angles) < 2:
        return angles, psi
    period = {"deg": 360.0, "rad": 2 * np.pi}.get(unit or "", np.nan)
    period /= N_r if kind == "mechanical" else 1.0 if kind == "electrical" else np.nan
    gap = period - (angles[-1] - angles[0])
    if not 0.5 < gap / np.diff(angles).mean() < 1.5:
        return angles, psi
    return np.append(angles, angles[0] + period), np.hstack([psi, psi[:, :1]])


def _flux(traces: list[Trace], R: float, i: Array) -> Array:
    """Flux linkage at the currents i, of all pulses at one angle [Wb]."""
    psi = np.concatenate([t.volt_seconds - R * t.charge for t in traces])
    current = np.concatenate([t.i for t in traces])
    i_top, psi_top = float(current.max()), float(psi.max())
    if not psi_top > 0:
        raise ParameterError("the flux linkage never rises: R_ohm is too large, or u is reversed")
    s, d, count = _means(current / i_top + psi / psi_top, current / i_top - psi / psi_top)
    curve = _odd_spline(s, d, count)
    steep = np.minimum(curve.derivative()(s), STEEPEST)
    curve = _odd_spline(s, d, count / (1 - steep) ** 2)  # noise of i moves d by 1 - slope
    fine = np.linspace(0, 2.0, 4001)
    along = np.maximum.accumulate((fine + curve(fine)) / 2 * i_top)
    rising = np.maximum.accumulate((fine - curve(fine)) / 2 * psi_top)
    values: Array = np.interp(i, along, rising)
    return values


def _means(s: Array, d: Array) -> tuple[Array, Array, Array]:
    """Means of s and d in equal bins of s, and how many samples these have."""
    place = np.clip((s / 2.0 * BINS).astype(int), 0, BINS - 1)
    kept = s > 0
    count = np.bincount(place[kept], minlength=BINS).astype(float)
    sums = [np.bincount(place[kept], weights=x[kept], minlength=BINS) for x in (s, d)]
    full = count > 0
    return sums[0][full] / count[full], sums[1][full] / count[full], count[full]


def _odd_spline(s: Array, d: Array, weight: Array) -> BSpline:
    """The odd cubic spline nearest to d(s), as smooth as cross-validation says."""
    step = 2.0 / CELLS
    knots = step * np.arange(-CELLS - 3, CELLS + 4)
    n = len(knots) - 4
    half = n // 2  # the spline in the middle is even: its coefficient is zero
    odd = np.zeros((n, half))
    odd[n - half :] = np.eye(half)
    odd[:half] = -np.eye(half)[::-1]
    root = np.sqrt(weight / weight.max())
    basis = root[:, None] * (BSpline.design_matrix(s, knots, 3) @ odd)
    c = _smoothed(basis, np.diff(odd, 3, axis=0), root * d)
    return BSpline(knots, odd @ c, 3)


def _smoothed(basis: Array, penalty: Array, row: Array) -> Array:
    """x that minimises |basis x - row|^2 + w |penalty x|^2, with the w that predicts left-out
    samples best: generalised cross-validation (G. Golub, M. Heath, G. Wahba, Technometrics 21(2),
    1979).

    In the coordinates where both forms are diagonal every w costs a few additions: a map has
    hundreds of these problems.
    """
    rough, fit = penalty.T @ penalty, basis.T @ basis
    scale = float(np.trace(fit) / np.trace(rough))
    share, vectors = eigh(scale * rough, fit + scale * rough)  # of the roughness, 0 to 1
    aim = vectors.T @ (basis.T @ row)
    left = (1 - share) + np.maximum(SMOOTHING[:, None], 1e-9) * share
    x = aim / left
    error = row @ row - 2 * x @ aim + (x**2 * (1 - share)).sum(axis=1)
    free = len(row) - ((1 - share) / left).sum(axis=1)
    best = int(np.argmin(np.where(free > 0.5, error / np.maximum(free, 0.5) ** 2, np.inf)))
    values: Array = vectors @ x[best]
    return values


def _closing(traces: list[Trace]) -> float | None:
    """R with which psi is the same at a current while it rises and while it falls [ohm]."""
    rises: list[float] = []
    charges: list[float] = []
    for t in traces:
        top = int(t.i.argmax())
        up, down = slice(0, top), slice(top + 1, None)
        for level in LEVELS * t.i[top]:
            both = [_at(t, part, level, NEAR * t.i[top]) for part in (up, down)]
            if both[0] is not None and both[1] is not None:
                rises.append(both[1][0] - both[0][0])
                charges.append(both[1][1] - both[0][1])
    if not rises:
        return None
    return float(np.dot(rises, charges) / np.dot(charges, charges))


def _at(t: Trace, part: slice, level: float, near: float) -> tuple[float, float] | None:
    """Volt-seconds and charge at a current, by a straight line through the samples near it."""
    i = t.i[part] - level
    close = np.abs(i) < near
    if close.sum() < FEWEST or np.ptp(i[close]) < near / 2:
        return None
    i = i[close]
    share = (i - i.mean()) / ((i - i.mean()) ** 2).sum()
    values = (
        float(x.mean() - i.mean() * (share @ x))
        for x in (t.volt_seconds[part][close], t.charge[part][close])
    )
    return next(values), next(values)
