"""Judge a flux table: is it one machine, and do its flux and torque belong together?"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, make_interp_spline

from reluctance.base.errors import ParameterError
from reluctance.machine.maps.single_row import NOISE, residuals, wrong_row
from reluctance.machine.maps.single_sample import WrongSample, wrong_sample
from reluctance.machine.maps.table import Array, FluxTable, around
from reluctance.machine.maps.units import TORQUE_RMS, implausible, unit_error, unit_question

# Gates, from maps found in the open. Torque against the derivative of co-energy: good maps 2.3 to
# 3.6 % rms with area balance 1 to 2 %; one pieced together from several runs 11 to 16 %; a broken
# one 9 to 29 %. Mirror and period errors of flux stay under 0.5 %; a row off by 2 to 3 % tells a
# mixed run.
AREA = 0.02
SYMMETRY = 0.005
JUMP = 0.05  # of the largest torque, at a position where a smooth machine has none
ROW = 0.01
SAMPLE = 0.005  # a sample of 744 that is off by 1 to 8 % makes the torque wrong by 0.6 to 3.4 % rms


@dataclass(frozen=True)
class MapReport:
    """What `check_map` found. Ratios are fractions; keys of `--json` are these names.

    Attributes
    ----------
    monotone_share : float
        Share of current steps along which flux rises [1].
    L_inc_min_H : float
        Least flux step over current step [H].
    symmetry_error, period_error : float or None
        Of flux about aligned, and between the ends of a whole period, of the largest flux; None for
        a half period, which cannot show them.
    torque_error_rms : float or None
        rms of given torque minus dW_c/dtheta, over rms of given torque; None without torque.
    area_error : float or None
        Worst, over the currents, of |integral of torque over half a period minus the co-energy
        difference|, of the largest co-energy difference.
    noise : float
        Standard deviation of the random part of flux, of the largest flux; an estimate.
    row_error : float
        Largest scale error of a single angle or current row against its neighbours.
    sample_error : float
        Error of a single sample that stands out from its neighbours over angle and current.
    extrapolation_share : float
        Share of the currents up to the drive's limit that lies beyond the table.
    verdict : str
        "good" or "refused"; `reasons` says why refused, and the remedy.
    """

    N_r: int
    n_i: int
    n_theta: int
    i_max_A: float
    theta_span_deg: float
    psi_max_Wb: float
    tau_max_Nm: float
    torque_given: str
    monotone_share: float
    L_inc_min_H: float
    symmetry_error: float | None
    period_error: float | None
    torque_error_rms: float | None
    area_error: float | None
    noise: float
    row_error: float
    sample_error: float
    extrapolation_share: float
    verdict: str
    reasons: tuple[str, ...]
    notes: tuple[str, ...]


def check_map(table: FluxTable, *, i_max: float | None = None) -> MapReport:
    """Judge a flux table.

    Parameters
    ----------
    table : FluxTable
    i_max : float, optional
        Current limit of the drive that will use the map [A]; the last current of the table if not
        given.

    Returns
    -------
    MapReport
    """
    if i_max is not None and not i_max > 0:
        raise ParameterError(f"i_max = {i_max:g} A, need > 0; pass the current limit of the drive")
    steps = np.diff(table.psi, axis=0) / np.diff(table.i)[:, None]
    tau_W = coenergy_torque(table)
    torque_rms = area = None
    notes = table.notes
    pieces: tuple[FluxTable, ...] = (table,)
    if table.tau is not None and _jumps(table):
        pieces, tau_W = _halves(table), _of_given_sides(table, _sloped(table))
        notes = (*notes, "torque jumps at the unaligned and aligned position: one-sided values")
        torque_rms = max(_inner_torque_error(piece) for piece in pieces)
        area = max(map(_area_error, pieces))
    elif table.tau is not None:
        torque_rms = float(np.sqrt(np.mean((table.tau - tau_W) ** 2) / np.mean(table.tau**2)))
        area = _area_error(table)
    symmetry = None if table.half else _symmetry_error(table)
    noise = max(map(_noise, pieces))
    row_error, *row = max(wrong_row(piece, noise) for piece in pieces)
    wrong = wrong_sample(table)
    scale = unit_error(table, tau_W)
    figures = dict(
        monotone_share=float((steps > 0).mean()),
        symmetry_error=symmetry,
        period_error=None if table.half else table.period_error,
        torque_error_rms=torque_rms,
        area_error=area,
        noise=noise,
        row_error=row_error,
        sample_error=0.0 if wrong is None else abs(wrong.error),
    )
    reasons = _reasons(figures, row, wrong, _worst_fall(table))
    last = float(table.i[-1])
    size = implausible(last, float(np.abs(table.psi).max()))
    if size is not None:
        size = (
            f"{size}; check the units of current and flux linkage: a column names its own, as "
            "psi_mWb, and a matrix is read in A and Wb, so multiply its numbers"
        )
    tau_max = float(np.abs(tau_W if table.tau is None else table.tau).max())
    asked = None if scale or size else unit_question(table, tau_max)
    reasons[:0] = [line for line in (scale, size) if line is not None][:1]
    return MapReport(
        N_r=table.N_r,
        n_i=len(table.i),
        n_theta=len(table.theta_e),
        i_max_A=last,
        theta_span_deg=180.0 if table.half else 360.0,
        psi_max_Wb=float(table.psi.max()),
        tau_max_Nm=tau_max,
        torque_given="no" if table.tau is None else "yes",
        L_inc_min_H=float(steps.min()),
        extrapolation_share=0.0 if i_max is None else max(0.0, 1 - last / i_max),
        verdict="refused" if reasons else "good",
        reasons=tuple(reasons),
        notes=notes if asked is None else (*notes, asked),
        **figures,  # type: ignore[arg-type]
    )


def coenergy(table: FluxTable) -> Array:
    """W_c = integral of psi over the current, by a cubic spline, shape (n_i, n_theta) [J]."""
    spline = make_interp_spline(table.i, table.psi, k=3)
    values: Array = spline.antiderivative()(table.i)
    return values


def coenergy_torque(table: FluxTable) -> Array:
    """dW_c/dtheta_m of the table itself, shape (n_i, n_theta) [N m]."""
    slope: Array = around(table, coenergy(table)).derivative()(table.theta_e)
    return table.N_r * slope


def _jumps(table: FluxTable) -> bool:
    """Whether the torque given at the ends of the half period is that of one side: of an inductance
    with corners there. A smooth machine has none there, by symmetry."""
    assert table.tau is not None
    most = np.abs(table.tau).max()
    at_ends = np.abs(table.tau[-1, _at_ends(table)]).max(initial=0.0)
    return bool(most > 0 and at_ends > JUMP * most)


def _at_ends(table: FluxTable) -> NDArray[np.bool_]:
    """Which angles are unaligned or aligned."""
    return np.asarray(np.abs(table.theta_e % np.pi) < 1e-6)


def _of_given_sides(table: FluxTable, tau: Array) -> Array:
    """Torque whose sign at the ends of the half period is that of the side which the table gives:
    the flux linkage has both."""
    assert table.tau is not None
    ends = _at_ends(table)
    return np.where(ends, np.copysign(tau, table.tau), tau)


def _halves(table: FluxTable) -> tuple[FluxTable, ...]:
    """Both half periods as unaligned to aligned, where the table has a sample at alignment."""
    assert table.tau is not None
    if table.half:
        return (_with_own_ends(table, table.theta_e, table.psi, table.tau),)
    aligned = int(np.argmin(np.abs(table.theta_e - np.pi)))
    if abs(table.theta_e[aligned] - np.pi) > 1e-6:
        return (table,)
    up, down = slice(0, aligned + 1), slice(aligned, None)
    back = np.append(table.theta_e[down], 2 * np.pi)
    psi, tau = (np.hstack([x[:, down], x[:, :1]])[:, ::-1] for x in (table.psi, table.tau))
    return (
        _with_own_ends(table, table.theta_e[up], table.psi[:, up], table.tau[:, up]),
        _with_own_ends(table, (2 * np.pi - back)[::-1], psi, -tau),
    )


def _with_own_ends(table: FluxTable, theta_e: Array, psi: Array, tau: Array) -> FluxTable:
    """A half period whose torque at its ends has the sign of its own side."""
    tau = tau.copy()
    for end, inner in ((0, 1), (-1, -2)):
        tau[:, end] = np.copysign(tau[:, end], tau[:, inner])
    return replace(table, theta_e=theta_e, psi=psi, tau=tau)


def _sloped(table: FluxTable) -> Array:
    """`coenergy_torque` of a table whose co-energy has corners at the ends of its halves."""
    energy = coenergy(table)
    aligned = int(np.argmin(np.abs(table.theta_e - np.pi)))
    cuts = [0, aligned, len(table.theta_e) - 1] if not table.half else [0, aligned]
    slope = np.empty_like(energy)
    for first, last in pairwise(cuts):
        part = slice(first, last + 1)
        spline = CubicSpline(table.theta_e[part], energy[:, part], axis=1)
        slope[:, part] = spline.derivative()(table.theta_e[part])
    return np.asarray(table.N_r * slope)


def _inner_torque_error(half: FluxTable) -> float:
    """As `torque_error_rms`, of a half period, without its ends."""
    assert half.tau is not None
    inner = slice(1, -1)
    given = half.tau[:, inner]
    return float(np.sqrt(np.mean((given - _sloped(half)[:, inner]) ** 2) / np.mean(given**2)))


def _area_error(table: FluxTable) -> float:
    """Integral of the given torque from unaligned to aligned against the co-energy difference."""
    assert table.tau is not None
    if table.half:
        torque = make_interp_spline(table.theta_e, table.tau, k=3, axis=1)
        work = torque.antiderivative()(np.pi) / table.N_r
    else:
        work = around(table, table.tau).antiderivative()(np.pi) / table.N_r
    energy = around(table, coenergy(table))
    gain = energy(np.pi) - energy(0.0)
    return float(np.abs(work - gain).max() / np.abs(gain).max())


def _symmetry_error(table: FluxTable) -> float:
    flux = around(table, table.psi)
    mirrored = flux(2 * np.pi - table.theta_e)
    return float(np.abs(table.psi - mirrored).max() / np.abs(table.psi).max())


def _noise(table: FluxTable) -> float:
    """Random part of flux [of its maximum]: the smaller of the estimates along angle and current.

    The curvature of a coarse table adds to either, so the smaller is nearer; the median keeps a
    single bad row out.
    """
    estimates = []
    for x, values in ((table.theta_e, table.psi.T), (table.i, table.psi)):
        if len(x) >= 7:
            misfits = residuals(x, values)
            if len(x) >= 9:  # smooth parts cancel once more between neighbours
                misfits = (misfits[1:-1] - (misfits[2:] + misfits[:-2]) / 2) * 0.55
            estimates.append(1.4826 * np.median(np.abs(misfits[:, values.max(axis=0) > 0])))
    return float(min(estimates) / np.abs(table.psi).max()) if estimates else 0.0


def _worst_fall(table: FluxTable) -> str:
    """Where flux falls most from one current to the next."""
    steps = np.diff(table.psi, axis=0)
    k, n = np.unravel_index(int(steps.argmin()), steps.shape)
    angle = np.degrees(table.theta_e[n])
    return f"from {table.i[k]:g} to {table.i[k + 1]:g} A at {angle:.5g} deg el."


def _percent(part: float) -> str:
    return f"{100 * part:.2g}" if part < 0.995 else f"{100 * part:.0f}"


def _reasons(
    figures: dict[str, float | None], row: list[str], wrong: WrongSample | None, fall: str
) -> list[str]:
    """One line for each gate that the table fails, with the remedy."""
    reasons = []
    name, remedy = row

    def gate(name: str, limit: float, what: str, remedy: str) -> None:
        value = figures[name]
        if value is not None and value > limit:
            need = f"need at most {100 * limit:g} %"
            reasons.append(f"{what} {_percent(value)} %, {need}; {remedy}")

    if wrong is not None:
        several = f" (and {wrong.more} more)" if wrong.more else ""
        gate(
            "sample_error",
            SAMPLE,
            f"the sample at {wrong.i:.5g} A, {np.degrees(wrong.theta_e):.5g} deg el.{several} is "
            "off by",
            f"it is {wrong.psi:.4g} Wb, its neighbours give {wrong.expected:.4g} Wb; correct it, "
            "or leave out the samples at its angle or current",
        )
    share = figures["monotone_share"]
    if share is not None and share < 1:
        reasons.append(
            f"flux falls with current on {_percent(1 - share)} % of the steps, need none; most "
            f"{fall}; mend the samples or use --repair"
        )
    gate(
        "row_error",
        ROW,
        f"{name} is off by",
        remedy,
    )
    gate("noise", NOISE, "noise of flux", "refine the mesh, average, or use --repair")
    gate(
        "symmetry_error",
        SYMMETRY,
        "flux differs between the two sides of alignment by",
        "check the angle zero, or keep the halves apart with symmetric=False",
    )
    gate(
        "period_error", SYMMETRY, "flux differs between the ends of the period by", "check the span"
    )
    gate(
        "torque_error_rms",
        TORQUE_RMS,
        "torque differs from the co-energy derivative by rms",
        "check units, stack length and that both tables are of one run",
    )
    gate(
        "area_error",
        AREA,
        "torque area differs from the co-energy difference by",
        "check the torque's scale and angle unit",
    )
    return reasons
