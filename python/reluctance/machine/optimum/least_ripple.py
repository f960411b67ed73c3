"""Profiles that leave less ripple when legs switch, for somewhat more copper loss.

Where two phases share the torque, one profile out of many has the least copper. Another leaves less
ripple at the same switching frequency: the phase that comes in is magnetized early, at full
voltage, while it makes little torque, and then waits at zero voltage, so that mostly one phase at a
time switches. Both deviate from the first profile by flux linkages d_k that make no torque,

    minimise    sum_j b_j + price sum_k i_k d_k/L_k
    subject to  the programme of switching_programme.py
                d_k(j + 1) - d_k(j) = h (sum_v p_jv v_k u_dc - u*_k)     at every angle, h in time
                sum_k g_k d_k(j) = 0                                     the torque, to first order

where 2 i d/L is the change of i^2 to first order. The deviations are then smoothed over some
degrees, and Newton's method takes out the torque error that is left.
"""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from reluctance import _core
from reluctance.base.arrays import FloatArray
from reluctance.base.cache import cached
from reluctance.base.errors import Unsolved
from reluctance.machine.operating_point import OperatingPoint
from reluctance.machine.optimum.coupled import at_once, solved
from reluctance.machine.optimum.magnetics import content
from reluctance.machine.optimum.programme import ALGORITHM, FEASIBLE
from reluctance.machine.optimum.ripple import AT_REST
from reluctance.machine.optimum.switching_programme import SwitchingProgramme
from reluctance.machine.optimum.table import Table

# Of half the relative rise of the copper loss, in parts of the sum of b; chosen at rated torque of
# the paper's machine (studies/least_ripple.py measures the result) [1].
PRICE = 20.0
# Width of the smoothing, electrical [deg]: a few pulses follow no sharper corner. The second where
# the first takes more than the voltage.
SMOOTH = (18.0, 9.0)
LACKS = 0.02  # of the peak flux linkage: what the voltage may lack for the smoothed profile [1]
ROUNDS = 8  # of Newton's method


def least_ripple_table(point: OperatingPoint, table: Table) -> Table:
    """The table with profiles for less switching ripple.

    A profile stays as it is where it has ripple itself, or where no other one is found.

    Parameters
    ----------
    point : where the table belongs.
    table : from `profile_table`; n_points a multiple of n_phases.

    Returns
    -------
    Table
        Of the same shape, with other i [A], psi [Wb] and i_rms [A].
    """

    def compute() -> Table:
        found = [_replanned(point, table, level) for level in range(len(table.tau_ref))]
        i, psi = (np.array(rows) for rows in zip(*found, strict=True))
        return replace(table, i=i, psi=psi, i_rms=np.sqrt(np.mean(i * i, axis=1)))

    numbers = [point.n_phases, point.R, table.u_dc, table.omega_m, *table.psi.shape]
    numbers += [point.i_max, PRICE, *SMOOTH, LACKS]
    rows = (table.tau_ref, table.i, table.psi, table.tau_error_max, table.tau_error_rms)
    profiles = b"".join(row.tobytes() for row in rows)
    numbers += [] if point.coupling is None else point.coupling.content
    inputs = [*content(point.magnetics), *numbers, hashlib.sha256(profiles).hexdigest()]
    return cached(Table, inputs, compute, algorithm=ALGORITHM)


def _replanned(point: OperatingPoint, table: Table, level: int) -> tuple[FloatArray, FloatArray]:
    """Current and flux linkage of one level, (n,) each."""
    i, psi, tau_ref = table.i[level], table.psi[level], float(table.tau_ref[level])
    same = i, psi
    if table.omega_m == 0 or tau_ref == 0 or table.tau_error_max[level] > FEASIBLE * tau_ref:
        return same
    h = table.theta_e[1] / (point.N_r * table.omega_m)
    flows = i > AT_REST * i.max()
    try:
        d = _deviation(point, table, i, psi, flows, h)
    except Unsolved:
        return same
    start = np.where(flows, i, 0.0)
    for width in SMOOTH:
        near = psi + np.where(flows, _smoothed(d, width), 0.0)
        found = _without_ripple(point, table.theta_e, start, near, flows, tau_ref)
        if found is None:
            continue
        lacks = np.maximum(np.abs(_voltage(point.R, *found, h)) - table.u_dc, 0.0).sum() * abs(h)
        if lacks <= LACKS * found[1].max() and found[0].max() <= point.i_max:
            return found
    return same


@dataclass(frozen=True)
class _State:
    """A phase along its current, the others a stroke behind each other; (n,) each."""

    psi: FloatArray  # [Wb]
    mutual: FloatArray  # what the neighbours add to it [Wb]
    tau: FloatArray  # a sum over the phases is the torque [N m]
    gain: FloatArray  # dtau/dpsi of those that flow [N m/Wb]
    L: FloatArray  # incremental inductance [H]
    rise: Callable[[FloatArray], FloatArray]  # of the currents that flow, with flux linkages [A]


def _state(
    point: OperatingPoint, i: FloatArray, theta_e: FloatArray, flows: NDArray[np.bool_]
) -> _State:
    at = _core.magnetics(point.magnetics, i, theta_e)
    psi, L, tau_i = (at[:, column] for column in (0, 3, 4))
    tau = np.where(flows, at[:, 2], 0.0)
    if point.coupling is None:
        gain = np.where(flows, tau_i / L, 0.0)
        return _State(psi, np.zeros_like(psi), tau, gain, L, lambda flux: flux / L)
    n_phases, pairs = point.n_phases, point.coupling
    i_all, flow = at_once(i, n_phases), at_once(flows, n_phases)
    L_all = pairs.inductance(point.magnetics, i_all, theta_e)

    def rise(flux: FloatArray) -> FloatArray:
        return solved(L_all, flow, at_once(flux, n_phases))[:, 0]

    mutual = pairs.psi(i_all, theta_e)[:, 0]
    gain = rise(tau_i + pairs.tau_i(i_all, theta_e)[:, 0])
    tau = tau + pairs.tau(i_all, theta_e) / n_phases
    return _State(psi + mutual, mutual, tau, gain, L_all[:, 0, 0], rise)


def _voltage(R: float, i: FloatArray, psi: FloatArray, h: float) -> FloatArray:
    """Mean over each interval, (n,) [V]."""
    return (np.roll(psi, -1) - psi) / h + R * (i + np.roll(i, -1)) / 2


def _deviation(
    point: OperatingPoint,
    table: Table,
    i: FloatArray,
    psi: FloatArray,
    flows: NDArray[np.bool_],
    h: float,
) -> FloatArray:
    """Deviations of the flux linkage, (n,) [Wb]."""
    n, u_dc = len(i), table.u_dc
    stroke = n // point.n_phases
    at = _state(point, i, table.theta_e, flows)
    i_mid = (i + np.roll(i, -1)) / 2
    flows_mid = i_mid > AT_REST * i.max()
    gain_mid = _state(point, i_mid, table.theta_e + table.theta_e[1] / 2, flows_mid).gain
    u = _voltage(point.R, i, psi, h)
    programme = SwitchingProgramme(
        np.where(flows_mid, u, 0.0),
        gain_mid,
        flows_mid,
        n_phases=point.n_phases,
        u_dc=u_dc,
    )
    alone = np.clip(np.abs(u) / u_dc, 0.0, 1.0)
    size = (np.abs(gain_mid) * u_dc * alone * (1 - alone)) ** (2 / 3)
    of_all = size.reshape(point.n_phases, -1).max(axis=0).sum()  # about the sum of b
    price = PRICE * of_all / np.sum(i * i)
    free = flows & np.roll(flows, 1)
    column = np.full(n, -1)
    for k in np.flatnonzero(free):
        no_less = -0.9 * float(psi[k] - at.mutual[k])  # that of the phase stays above zero
        column[k] = programme.unknowns(np.array([price * i[k] / at.L[k]]), no_less)[0]

    def terms(k: int, factor: float) -> list[tuple[int, float]]:
        return [(int(column[k]), factor)] if column[k] >= 0 else []

    per_flux = 1 / (h * u_dc)
    for j, angle in enumerate(programme.angles):
        for m, phase in enumerate(angle.on.tolist()):
            here = phase * stroke + j
            after = (here + 1) % n
            shares = zip(angle.shares, -angle.vectors[:, m], strict=True)
            programme.require(
                [*terms(after, per_flux), *terms(here, -per_flux), *shares], -angle.mean[m]
            )
        phases = [k * stroke + j for k in range(point.n_phases)]
        torque = [term for k in phases for term in terms(k, float(at.gain[k]))]
        if torque:
            programme.require(torque, 0.0)
    return np.where(column >= 0, programme.solve()[column], 0.0)


def _smoothed(d: FloatArray, degrees: float) -> FloatArray:
    width = max(round(len(d) * degrees / 360), 1)
    kernel = np.hanning(width + 2)[1:-1]
    around = np.concatenate([d[-width:], d, d[:width]])
    return np.convolve(around, kernel / kernel.sum(), "same")[width:-width]


def _without_ripple(
    point: OperatingPoint,
    theta_e: FloatArray,
    i: FloatArray,
    psi: FloatArray,
    flows: NDArray[np.bool_],
    tau_ref: float,
) -> tuple[FloatArray, FloatArray] | None:
    """Currents near these flux linkages with all of the torque; None where none are found. A torque
    error is shared by the gains."""

    def over_phases(x: FloatArray) -> FloatArray:
        return np.tile(x.reshape(point.n_phases, -1).sum(axis=0), point.n_phases)

    for _ in range(ROUNDS):  # the currents of the flux linkages
        at = _state(point, i, theta_e, flows)
        i = np.where(flows, np.maximum(i + at.rise(psi - at.psi), 0.0), 0.0)
    for _ in range(ROUNDS):
        at = _state(point, i, theta_e, flows)
        missing = tau_ref - over_phases(at.tau)
        share = missing * at.gain / np.maximum(over_phases(at.gain * at.gain), 1e-12)
        i = np.where(flows, np.maximum(i + at.rise(share), 0.0), 0.0)
    at = _state(point, i, theta_e, flows)
    error = np.abs(over_phases(at.tau) - tau_ref).max()
    return (i, at.psi) if error <= FEASIBLE * tau_ref else None
