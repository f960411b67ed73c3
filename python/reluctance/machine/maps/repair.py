"""Repair a noisy flux table: smooth it, make flux rise with current, say what changed."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from reluctance.machine.maps.surface import angle_cells, rise_problem, rising
from reluctance.machine.maps.table import Array, FluxTable, fold

SMOOTHING = np.logspace(-12, 6, 73)  # candidates


@dataclass(frozen=True)
class Repair:
    """The repaired table, and what the repair did.

    Attributes
    ----------
    table : FluxTable
        On the same currents and angles, half a period; torque as given.
    psi_change_rms, psi_change_max : float
        Change of flux, of the largest flux [1].
    i_worst, theta_e_worst : float
        Where the change is largest [A], [rad].
    falling_before : int
        Current steps along which flux fell.
    notes : tuple of str
        The same in words.
    """

    table: FluxTable
    psi_change_rms: float
    psi_change_max: float
    i_worst: float
    theta_e_worst: float
    falling_before: int
    notes: tuple[str, ...]


def repair_map(table: FluxTable) -> Repair:
    """Smooth the random part of flux and make flux rise with current.

    Over the angle each current row becomes a penalised cubic spline (P. Eilers, B. Marx,
    Statistical Science 11(2), 1996), over the current a monotone one (`surface.rising`). Weights
    and order of the penalties are those under which the table is most likely, so that a clean one
    stays as it is.

    Parameters
    ----------
    table : FluxTable

    Returns
    -------
    Repair
    """
    half = fold(table)
    flux = half.psi[1:]
    weight = 1 / (flux.mean(axis=1) + 0.05 * flux.max())  # noise grows with flux, down to a floor
    rows = (flux * weight[:, None]).T
    basis, penalties = _even_basis(half.theta_e)
    found = [(*likeliest(basis, penalty, rows), penalty) for penalty in penalties]
    _, smoothing, penalty = max(found, key=lambda each: each[0])
    smooth = basis @ penalised(basis, penalty, rows, smoothing)
    psi = np.vstack([np.zeros((1, len(half.theta_e))), smooth.T / weight[:, None]])

    psi = _rising_flux(half.i, psi, weight)
    psi[0] = 0.0
    change = (psi - half.psi) / np.abs(half.psi).max()
    k, n = np.unravel_index(int(np.abs(change).argmax()), change.shape)
    falling = int((np.diff(half.psi, axis=0) <= 0).sum())
    rms, worst = float(np.sqrt(np.mean(change**2))), float(np.abs(change).max())
    theta_e = float(half.theta_e[n])
    note = (
        f"repaired: flux changed by {100 * rms:.2g} % rms, at most {100 * worst:.2g} % of its "
        f"maximum at {half.i[k]:g} A, {np.degrees(theta_e):.4g} deg el.; {falling} falling current "
        "steps removed"
    )
    repaired = replace(half, psi=psi, notes=(*half.notes, note))
    return Repair(repaired, rms, worst, float(half.i[k]), theta_e, falling, (note,))


def penalised(basis: Array, penalty: Array, rows: Array, smoothing: float) -> Array:
    """x that minimises |basis x - rows|^2 + smoothing |penalty x|^2."""
    matrix = np.vstack([basis, np.sqrt(smoothing) * penalty])
    zeros = np.zeros((len(penalty), rows.shape[1]))
    solution: Array = np.linalg.lstsq(matrix, np.vstack([rows, zeros]), rcond=None)[0]
    return solution


def likeliest(basis: Array, penalty: Array, rows: Array) -> tuple[float, float]:
    """Log-likelihood, and the smoothing under which `rows` are most likely, where noise and
    penalty x are both random: restricted maximum likelihood, as of one column.

    All currents of a clamped angle share its error, so that the columns of a map tell little more
    than one. Of so few samples, cross-validation now and then takes all noise for signal, and the
    likelihood does not (P. Reiss, T. Ogden, J. R. Stat. Soc. B 71(2), 2009; S. Wood, 73(1), 2011).
    Penalties that let the same x pass may be compared.
    """
    stretches = np.linalg.svd(penalty, compute_uv=False)
    stretches = stretches[stretches > 1e-9 * stretches[0]]
    free = len(basis) - (basis.shape[1] - len(stretches))
    found = []
    for smoothing in SMOOTHING:
        x = penalised(basis, penalty, rows, smoothing)
        cost = ((rows - basis @ x) ** 2).sum() + smoothing * ((penalty @ x) ** 2).sum()
        matrix = np.vstack([basis, np.sqrt(smoothing) * penalty])
        diagonal = np.abs(np.diag(np.linalg.qr(matrix, mode="r")))
        prior = np.log(np.sqrt(smoothing) * stretches).sum() - np.log(diagonal).sum()
        found.append(prior - free / 2 * np.log(cost + np.finfo(np.float64).tiny))
    best = int(np.argmax(found))
    return float(found[best]), float(SMOOTHING[best])


def _rising_flux(i: Array, psi: Array, weight: Array) -> Array:
    """Flux made rising with current, smoothed in two passes: the mean over all angles first, whose
    falling inductance is then the unit in which each angle's own is smoothed."""
    knots = np.concatenate([[0.0, 0.0], i, [i[-1]] * 2])
    level: Array | float = 1.0
    for values in (psi.mean(axis=1, keepdims=True), psi):
        design, penalty = rise_problem(i, knots, level=level)
        rows = psi[1:] * weight[:, None]
        _, smoothing = likeliest(design * weight[:, None], penalty, rows)
        fitted = rising(i, values, knots, weight=weight, level=level, smoothing=smoothing)
        level = np.maximum.accumulate(fitted.c[::-1].max(axis=1))[::-1] / fitted.c.max()
    flux: Array = fitted.antiderivative()(i)
    return flux


def _even_basis(theta_e: Array) -> tuple[Array, list[Array]]:
    """Even cubic splines by their values at equal angles: matrix to theta_e, and differences that
    are small where the values are straight, curve evenly, or bend evenly."""
    n = angle_cells(theta_e, np.pi)
    nodes = np.linspace(0, np.pi, n + 1)
    basis = CubicSpline(nodes, np.eye(n + 1), bc_type="clamped")(theta_e)
    mirrored = np.eye(n + 1)[[2, 1, *range(n + 1), n - 1, n - 2]]
    return basis, [np.diff(mirrored, order, axis=0) for order in (2, 3, 4)]
