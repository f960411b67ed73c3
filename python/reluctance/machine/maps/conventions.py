"""From a raw map to the project's convention: which axis, which quantity, which sign."""

import numpy as np

from reluctance.base.errors import ParameterError
from reluctance.machine.maps.angles import (
    KINDS,
    UNITS,
    angle_reading,
    check_period,
    half_period,
    readings_of,
    whole_period,
    zero_of,
)
from reluctance.machine.maps.inverse import is_inverse, turned
from reluctance.machine.maps.no_current import NO_FLUX, from_zero
from reluctance.machine.maps.periods import first_period
from reluctance.machine.maps.raw import RawMap
from reluctance.machine.maps.table import Array, FluxTable

AT_REST = 0.01  # of the largest torque: less, aligned and unaligned, is none
FALLS = 0.02  # of its rise: what noise and a flat top may take from the flux at an end; at a zero
# that is 16 deg wrong it is (1 - cos 16 deg)/2
CHOICES = {
    "angle_unit": tuple(UNITS),
    "angle_kind": KINDS,
    "zero": ("unaligned", "aligned"),
    "layout": ("currents_down", "angles_down"),
}


def settled(
    raw: RawMap,
    *,
    N_r: int | None = None,
    angle_unit: str | None = None,
    angle_kind: str | None = None,
    zero: str | None = None,
    layout: str | None = None,
    aligned_at: float | None = None,
) -> FluxTable:
    """The table in the project's convention: what the user states wins, then what the file says,
    then what the numbers show; the notes tell which.

    Raises
    ------
    ParameterError
        Where the axes fit no convention, or contradict a stated one.
    """
    stated = dict(angle_unit=angle_unit, angle_kind=angle_kind, zero=zero, layout=layout)
    for name, value in stated.items():
        if name == "zero" and value is not None and aligned_at is not None:
            raise ParameterError("zero and aligned_at say the same; give one of them")
        if value is not None and value not in CHOICES[name]:
            raise ParameterError(f"{name} = {value!r}, need one of {', '.join(CHOICES[name])}")
    N_r = N_r if N_r is not None else raw.N_r
    if N_r is None:
        raise ParameterError("the file does not give the rotor poles; pass N_r (--N_r)")
    if N_r < 1:
        raise ParameterError(f"N_r = {N_r}, need the number of rotor poles; pass N_r (--N_r)")
    if min(len(raw.rows), len(raw.columns)) < 2:
        raise ParameterError(
            f"the map has {len(raw.rows)} rows and {len(raw.columns)} columns of flux, need at "
            "least two currents and two angles"
        )
    notes: list[str] = []
    i, angle, psi, tau = _oriented(raw, layout, N_r, notes)
    for name, table in (("flux", psi), ("torque", tau)):
        if table is not None and not np.isfinite(table).all():
            k, n = np.argwhere(~np.isfinite(table))[0]
            raise ParameterError(
                f"{name} at {i[k]:g} A, angle {angle[n]:g} is {table[k, n]}, need a number; fill "
                "the cell or leave its row out"
            )
    if not raw.inverse:
        _check_sense(i, psi, tau)
    unit, kind = angle_unit or raw.angle_unit, angle_kind or raw.angle_kind
    i, psi, tau = _currents(i, psi, tau, notes)
    angle, psi, tau = _rising(angle, psi, tau, notes)
    unnamed = raw.layout is None  # names would say which of the two is the current
    if tau is None and (raw.inverse or (unnamed and is_inverse(i, psi))):
        i, psi = turned(i, psi, notes)
    units = {u: size for u, size in UNITS.items() if unit in (u, None)}
    kinds = [kind] if kind else CHOICES["angle_kind"]
    given = [psi] if tau is None else [psi, tau]
    angle, (psi, *torque), found = first_period(angle, given, N_r, units, kinds, notes)
    tau, kind = torque[0] if torque else None, found or kind
    reading = angle_reading(angle, N_r, unit, kind, notes)
    check_period(psi.mean(axis=0), reading, N_r)
    if aligned_at is not None:
        theta_e, where = (angle - aligned_at) * reading.factor + np.pi, "unaligned"
        notes.append(f"angles shifted: aligned at {aligned_at:g} {reading.unit} of the file")
    else:
        theta_e = angle * reading.factor
        where = zero or raw.zero or zero_of(theta_e, psi, reading, notes)
    if where not in CHOICES["zero"]:
        raise ParameterError(f"zero = {where!r}, need one of {', '.join(CHOICES['zero'])}")
    if where == "aligned":
        theta_e = theta_e + np.pi
    if reading.halves == 1:
        theta_e, psi, tau, error = (*half_period(theta_e, psi, tau, notes), 0.0)
    else:
        theta_e, psi, tau, error = whole_period(theta_e, psi, tau, notes)
    _peak_is_aligned(theta_e, psi, tau, where)
    tau = _signed(theta_e, psi, tau, i, notes)
    if tau is None and reading.kind == "electrical":
        notes.append(f"N_r = {N_r} as stated: electrical angles without torque cannot tell")
    return FluxTable(N_r, i, theta_e, psi, tau, error, tuple(notes))


def _oriented(
    raw: RawMap, layout: str | None, N_r: int, notes: list[str]
) -> tuple[Array, Array, Array, Array | None]:
    """Currents, angles, and tables (n_i, n_theta)."""
    down = (raw.rows, raw.columns, raw.psi, raw.tau)
    across = (raw.columns, raw.rows, raw.psi.T, None if raw.tau is None else raw.tau.T)
    known = layout or raw.layout
    if raw.layout is not None and layout is not None and raw.layout != layout:
        raise ParameterError(f"layout = {layout}, but the file names its axes; leave layout out")
    fits = [_is_current(c[0], c[2]) for c in (down, across)]
    if known is None:
        periods = [bool(readings_of(c[1], N_r)) for c in (down, across)]
        fits = fits if fits[0] != fits[1] else [a and b for a, b in zip(fits, periods, strict=True)]
        if fits[0] == fits[1]:
            raise ParameterError(
                "cannot tell currents from angles, need flux 0 at 0 A and a half or whole period "
                "of angles; name the columns in a first row, as i_A, theta_deg, psi_Wb, or of a "
                "grid pass layout=currents_down or angles_down (--layout ...)"
            )
        known = "currents_down" if fits[0] else "angles_down"
        notes.append(f"{known.replace('_', ' ')} the rows, since flux vanishes there at 0 A")
    elif not fits[known == "angles_down"] and fits[known == "currents_down"]:
        raise ParameterError(
            "axes look swapped: flux vanishes along the first angle, not at 0 A; swap the two "
            "names or the layout"
        )
    taken = down if known == "currents_down" else across
    unlike = not fits[known == "angles_down"]
    if unlike and not readings_of(taken[1], N_r) and readings_of(taken[0], N_r):
        raise ParameterError(
            f"axes look swapped: {taken[0].min():g} to {taken[0].max():g} A would be a period of "
            "angles, the angles are none; swap the two names or the layout"
        )
    return taken


def _is_current(axis: Array, psi: Array) -> bool:
    """Whether flux starts from nothing along this axis and grows along it."""
    order = np.argsort(axis)
    flux = psi[order][np.isfinite(psi[order]).all(axis=1)]
    if len(flux) < 2 or axis.min() < 0:
        return False
    if axis.min() == 0:
        return bool(np.abs(flux[0]).max() <= NO_FLUX * np.abs(flux).max())
    # Without a sample at zero: flux per current must not grow, as it does along an angle.
    ratio = flux[[0, -1]].mean(axis=1) / np.sort(axis)[[0, -1]]
    return bool(ratio[1] <= 1.05 * ratio[0] and (np.diff(flux, axis=0) > 0).mean() > 0.9)


def _check_sense(i: Array, psi: Array, tau: Array | None) -> None:
    """Refuses flux linkages of the wrong sign, or those and torques under each other's names:
    a torque is zero where the rotor is aligned, and a flux linkage nowhere."""
    k = int(np.argmax(i))
    flux, most = psi[k], float(np.abs(psi[k]).max())
    if tau is not None and flux.min() < AT_REST * most and tau[k].min() > AT_REST * tau[k].max():
        raise ParameterError(
            f"the columns of flux linkage and torque look exchanged: at {i[k]:g} A the torque is "
            "zero at no angle, and the flux linkage is; exchange their two names"
        )
    if i[k] > 0 and flux.max() < 0:
        raise ParameterError(
            f"flux linkages are negative, {flux.min():.3g} Wb at {i[k]:g} A: the sense of the coil "
            "or of the current is exchanged; multiply the flux linkages by -1"
        )


def _currents(
    i: Array, psi: Array, tau: Array | None, notes: list[str]
) -> tuple[Array, Array, Array | None]:
    """Currents rising from 0."""
    if not np.isfinite(i).all():
        raise ParameterError("the current axis has a cell that is no number; fill it")
    if i.min() < 0:
        half = "keep the positive half of the map"
        if i.max() <= 0:
            half = "multiply the currents by -1, and the flux linkages where they are negative, too"
        raise ParameterError(f"current = {i.min():g} A, need >= 0; {half}")
    i, psi, tau = _sorted("current", i, psi, tau, notes)
    return from_zero(i, psi, tau, notes)


def _rising(
    angle: Array, psi: Array, tau: Array | None, notes: list[str]
) -> tuple[Array, Array, Array | None]:
    if not np.isfinite(angle).all():
        raise ParameterError("the angle axis has a cell that is no number; fill it")
    angle, flux, torque = _sorted("angle", angle, psi.T, None if tau is None else tau.T, notes)
    return angle, flux.T, None if torque is None else torque.T


def _sorted(
    name: str, axis: Array, psi: Array, tau: Array | None, notes: list[str]
) -> tuple[Array, Array, Array | None]:
    """The axis rising, with its rows of psi and tau; a falling axis is turned round."""
    steps = np.diff(axis)
    if (np.sort(axis)[1:] == np.sort(axis)[:-1]).any():
        twice = np.sort(axis)[:-1][np.diff(np.sort(axis)) == 0][0]
        raise ParameterError(f"{name} {twice:g} appears twice, need each once; remove one of them")
    if (steps > 0).all():
        return axis, psi, tau
    if (steps < 0).all():
        notes.append(f"{name} axis falls in the file; turned round")
        return axis[::-1], psi[::-1], None if tau is None else tau[::-1]
    at = int(np.argmax(steps < 0)) + 1
    raise ParameterError(
        f"{name} axis is not sorted: {axis[at]:g} follows {axis[at - 1]:g}; sort the map by {name}"
    )


def _peak_is_aligned(theta_e: Array, psi: Array, tau: Array | None, where: str) -> None:
    """Raises ParameterError where the flux linkage is not least and largest at the ends. Iron that
    saturates may bring its largest before alignment; torque that vanishes there shows the zero."""
    flux = psi.mean(axis=0)
    if flux[0] > flux[np.argmin(np.abs(theta_e - np.pi))]:
        other = "unaligned" if where == "aligned" else "aligned"
        raise ParameterError(
            f"zero = {where}, but flux falls towards what would be alignment; pass zero={other} "
            f"(--zero {other})"
        )
    half = theta_e[-1] < 1.5 * np.pi
    rise = float(np.ptp(flux))
    if tau is not None and np.abs(tau[:, [0, -1]]).max() < AT_REST * np.abs(tau).max():
        return
    if half and max(flux.max() - flux[-1], flux[0] - flux.min()) > FALLS * rise:
        least, most = (float(np.degrees(theta_e[at(flux)])) for at in (np.argmin, np.argmax))
        raise ParameterError(
            f"the flux is least {least:.0f} and largest {most:.0f} deg el. from what would be the "
            "unaligned angle, need 0 and 180: the zero of the angle is wrong; record again with "
            "the right one (firmware: run `alignment` before `pulses`). If it is right, and iron "
            "behind the poles saturates, give the torque too"
        )


def _signed(
    theta_e: Array, psi: Array, tau: Array | None, i: Array, notes: list[str]
) -> Array | None:
    """Torque with the sign of dW_c/dtheta: some tools count it against the angle."""
    if tau is None:
        return None
    coenergy = np.cumsum((psi[1:] + psi[:-1]) / 2 * np.diff(i)[:, None], axis=0)
    slope = np.gradient(coenergy, theta_e, axis=1)
    if np.nansum(slope * tau[1:]) < 0:
        notes.append("torque counted against the angle in the file; sign turned")
        return -tau
    return tau
