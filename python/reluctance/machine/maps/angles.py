"""The angles of a map: their unit and kind, which part of a period they are, and where zero is."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from reluctance.base.errors import ParameterError
from reluctance.machine.maps.periods import check_rises_once
from reluctance.machine.maps.table import Array

MATCH = 0.01  # how near an angle range must come to a half or whole period, of a half period [1]
ZERO_OFF = np.pi / 18  # how far the largest flux may be from a zero that is inferred [rad]
# Of the rise of the flux linkage, its change from the first angle to the last: nearly all of it
# over half a period, nothing over a whole one (a step of six samples at the steepest place is 0.5).
ONE_WAY, RETURNS = 0.75, 0.1
UNITS = {"deg": np.pi / 180, "rad": 1.0}
KINDS = ("mechanical", "electrical")


@dataclass(frozen=True)
class Reading:
    """One way to read the angle axis, and the half periods that it then covers."""

    unit: str
    kind: str
    halves: int
    factor: float  # to electrical radians


def readings_of(
    angle: Array, N_r: int, unit: str | None = None, kind: str | None = None
) -> list[Reading]:
    """Every reading of the angles that covers one half or one whole period."""
    span = float(angle.max() - angle.min())
    step = span / (len(angle) - 1)
    even = np.allclose(np.diff(np.sort(angle)), step, rtol=1e-3)
    found = []
    for u in [unit] if unit else UNITS:
        for k in [kind] if kind else KINDS:
            factor = UNITS[u] * (N_r if k == "mechanical" else 1)
            for halves in (1, 2):
                open_end = halves == 2 and even and abs((span + step) * factor / np.pi - 2) < 1e-3
                if abs(span * factor / np.pi - halves) < MATCH or open_end:
                    found.append(Reading(u, k, halves, factor))
    return found


def angle_reading(
    angle: Array, N_r: int, unit: str | None, kind: str | None, notes: list[str]
) -> Reading:
    """The one reading that fits, or why none does."""
    readings = readings_of(angle, N_r, unit, kind)
    low, high = float(angle.min()), float(angle.max())
    if len(readings) > 1:
        ways = " or ".join(f"{r.unit} {r.kind}" for r in readings)
        raise ParameterError(
            f"angles {low:g} to {high:g} read as {ways}; pass angle_unit "
            "and angle_kind (--angle_unit, --angle_kind)"
        )
    if readings:
        reading = readings[0]
        period = "half" if reading.halves == 1 else "whole"
        if unit is None or kind is None:
            notes.append(
                f"angles {low:g} to {high:g} read as {reading.unit} {reading.kind}: a {period} "
                f"period with N_r = {N_r}"
            )
        return reading
    others = readings_of(angle, N_r)
    if others:
        other = others[0]
        said = " ".join(w for w in (unit, kind) if w)
        raise ParameterError(
            f"angles {low:g} to {high:g} are no half or whole period in {said}, but in "
            f"{other.unit} {other.kind}; pass angle_unit={other.unit}, angle_kind={other.kind} "
            f"(--angle_unit {other.unit} --angle_kind {other.kind})"
        )
    unit = unit or ("deg" if high - low > 2 * np.pi else "rad")
    turn = 180 / np.pi * UNITS[unit]
    kind = kind or ("mechanical" if (high - low) * turn * N_r < 540 else "electrical")
    factor = turn * (N_r if kind == "mechanical" else 1)
    span = (high - low) * factor
    remedy = "extend the map" if span < 180 else "cut it there"
    poles = [part * N_r / span for part in (180, 360)] if kind == "mechanical" else []
    whole = [f"{n:.0f}" for n in poles if n > 1.5 and abs(n - round(n)) < MATCH * n]
    remedy += f", or correct N_r ({' or '.join(whole)})" if whole else ", or correct N_r"
    raise ParameterError(
        f"angles {low:g} to {high:g} {unit} cover {span:.4g} deg el. with N_r = {N_r}, need 180 or "
        f"360; {remedy} or the unit"
    )


def check_period(flux: Array, reading: Reading, N_r: int) -> None:
    """Raises ParameterError where the flux linkage is that of half the period which N_r makes of
    the angles, or of twice as much: a whole one ends as it begins, a half one does not."""
    if reading.kind != "mechanical":
        return
    moved = abs(flux[-1] - flux[0]) / np.ptp(flux)
    if reading.halves == 2 and moved > ONE_WAY:
        was, goes, right = "a whole period", "one way only, as over half of one", N_r / 2
    elif reading.halves == 1 and moved < RETURNS:
        was, goes, right = "half a period", "up and down, as over a whole one", 2 * N_r
    else:
        return
    n = f" ({right:g})" if right == int(right) and right > 1 else ""
    raise ParameterError(
        f"the angles are {was} with N_r = {N_r}, and the flux linkage goes {goes}; correct N_r"
        f"{n}, or the angle's unit or zero"
    )


def zero_of(theta_e: Array, psi: Array, reading: Reading, notes: list[str]) -> str:
    """Where the file's angle zero is, from where the flux is largest."""
    flux = psi.mean(axis=0)
    if reading.halves == 1:
        peak = theta_e[[0, -1]][int(flux[-1] > flux[0])]
    else:
        check_rises_once(theta_e, flux)
        turn = np.append(theta_e, theta_e[0] + 2 * np.pi)  # the end may be the start already
        wave = np.append(flux, flux[0]) * np.exp(1j * turn)
        peak = float(np.angle(np.sum((wave[1:] + wave[:-1]) * np.diff(turn))))
    from_zero = abs(np.angle(np.exp(1j * peak)))
    if ZERO_OFF < from_zero < np.pi - ZERO_OFF:
        raise ParameterError(
            f"flux is largest {np.degrees(peak):.0f} deg el. from the file's zero, need 0 or 180; "
            f"pass the file's angle of alignment, aligned_at={peak / reading.factor:.4g} "
            f"(--aligned_at {peak / reading.factor:.4g})"
        )
    where = "aligned" if from_zero < np.pi / 2 else "unaligned"
    notes.append(f"angle zero read as {where}, from where the flux is largest")
    return where


def half_period(
    theta_e: Array, psi: Array, tau: Array | None, notes: list[str]
) -> tuple[Array, Array, Array | None]:
    """A half period from unaligned to aligned: mirrored where the file has the other half.

    An end that is a sample away follows from the symmetry about it; angles that miss a half period
    by less are stretched to it.
    """
    start = float(theta_e[0]) % (2 * np.pi)
    close = MATCH * np.pi
    if abs(start - np.pi) < close:
        theta_e, psi = 2 * np.pi - (theta_e - theta_e[0] + start)[::-1], psi[:, ::-1]
        tau = None if tau is None else -tau[:, ::-1]
        notes.append("half period past alignment mirrored")
    elif min(start, 2 * np.pi - start) >= close:
        raise ParameterError(
            f"the half period starts at {np.degrees(start):.0f} deg el., need 0 or 180; sample "
            "from unaligned to aligned"
        )
    first = float(np.angle(np.exp(1j * theta_e[0])))
    theta_e = theta_e - theta_e[0]
    missing = np.pi - theta_e[-1]
    if missing < _half_step(theta_e):
        return _snapped(theta_e * (np.pi / theta_e[-1]), np.pi), psi, tau
    theta_e = theta_e + (min(first, missing) if first > _half_step(theta_e) else 0.0)
    even = np.linspace(0, np.pi, round(np.pi / float(np.median(np.diff(theta_e)))) + 1)
    low, high = np.degrees(theta_e[[0, -1]])
    notes.append(
        f"angles from {low:.4g} to {high:.4g} deg el. of a half period: {len(even)} even angles, "
        "those at its ends by symmetry"
    )
    twice = (theta_e > 1e-6) & (theta_e < np.pi - 1e-6)  # on both sides
    around = np.append(theta_e, 2 * np.pi - theta_e[twice][::-1])
    psi = _periodic(around, np.hstack([psi, psi[:, twice][:, ::-1]]))(even)
    if tau is not None:
        tau = _periodic(around, np.hstack([tau, -tau[:, twice][:, ::-1]]))(even)
    return even, psi, tau


def _half_step(theta_e: Array) -> float:
    """Of the smaller of the two steps at the ends: less is missing by rounding only."""
    return float(min(theta_e[1] - theta_e[0], theta_e[-1] - theta_e[-2])) / 2


def whole_period(
    theta_e: Array, psi: Array, tau: Array | None, notes: list[str]
) -> tuple[Array, Array, Array | None, float]:
    """A whole period from 0, without 2 pi; where both ends are given, their mean and difference.
    Where no sample is at 0, a periodic spline gives the values at as many even angles."""
    error = 0.0
    if theta_e[0] + 2 * np.pi - theta_e[-1] < _half_step(theta_e):
        error = float(np.abs(psi[:, -1] - psi[:, 0]).max() / np.abs(psi).max())
        theta_e = theta_e[:-1]
        psi = np.hstack([(psi[:, :1] + psi[:, -1:]) / 2, psi[:, 1:-1]])
        tau = None if tau is None else tau[:, :-1]
    turned = np.mod(theta_e + 1e-9, 2 * np.pi) - 1e-9
    order = np.argsort(turned)
    turned = turned[order]
    psi, tau = psi[:, order], None if tau is None else tau[:, order]
    if abs(turned[0]) > 1e-6:
        even = np.linspace(0, 2 * np.pi, len(turned), endpoint=False)
        psi = _periodic(turned, psi)(even)
        tau = None if tau is None else _periodic(turned, tau)(even)
        turned = even
        notes.append(f"no sample at angle zero: {len(even)} even angles by a periodic spline")
    return _snapped(np.append(turned, 2 * np.pi), 2 * np.pi)[:-1], psi, tau, error


def _periodic(theta_e: Array, values: Array) -> CubicSpline:
    closed = np.hstack([values, values[:, :1]])
    return CubicSpline(
        np.append(theta_e, theta_e[0] + 2 * np.pi), closed, axis=1, bc_type="periodic"
    )


def _snapped(theta_e: Array, span: float) -> Array:
    """Exact equal steps where the steps are equal to rounding: every unit gives one machine."""
    even = np.linspace(0, span, len(theta_e))
    exact = even if np.abs(theta_e - even).max() < 1e-6 else theta_e.copy()
    exact[0], exact[-1] = 0.0, span
    return exact
