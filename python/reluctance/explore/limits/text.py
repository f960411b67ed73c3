"""A limit in words: labels and values for the command line, and what they rest on."""

from math import isfinite

from reluctance.base.units import from_si
from reluctance.explore.limits.report import Limit
from reluctance.machine.optimum.torque_step import LONGEST

PROFILE = (
    "Constraints hold at the grid points to 1e-6. Optima are the best known: a local solver, "
    "several starts."
)
FLOOR = (
    "Bounds: to first order in the ripple, for currents near the profile of minimum copper loss, "
    "three-level legs, ideal sensing, no delay. Pulse-width figure: best known value of "
    "independent phases."
)


def rows(limit: Limit) -> list[tuple[str, str]]:
    """Label and value of every key figure."""
    best, floor, tau_ref = limit.least_copper, limit.floor, abs(limit.least_copper.tau_ref)
    lines = [
        ("speed", f"{from_si(best.omega_m, 'rpm'):.2f} rpm"),
        ("torque", f"{best.tau_ref:.3f} N m"),
        ("dc-link voltage", f"{best.u_dc:g} V"),
        ("current limit", f"{limit.drive.machine.i_max_A:g} A"),
        ("torque without ripple", "possible" if limit.ripple_free else "impossible"),
        ("greatest ripple-free torque", f"{limit.tau_max:.3f} N m"),
    ]
    if not limit.ripple_free:
        lines += [
            ("least torque error, greatest", f"{best.tau_error_max:.3f} N m"),
            ("its rms", f"{best.tau_error_rms:.3f} N m"),
        ]
    lines += [
        ("rms phase current", f"{best.i_rms:.2f} A"),
        ("peak phase current", f"{best.i_peak:.2f} A"),
        ("copper loss", f"{best.p_cu:.1f} W"),
    ]
    if limit.step is not None:
        to = f"least time from zero to {limit.step.share:.0%} of the torque"
        lines += [
            (f"{to}, mean over the angle", _time(limit.step.mean)),
            ("at the worst angle", _time(limit.step.longest)),
        ]
    if floor is not None and tau_ref > 0:
        lines += [
            ("at mean switching frequency per switch", f"{floor.switching_frequency / 1e3:g} kHz"),
            ("torque error, rms, bound", f"{floor.bound_rms / tau_ref:.3%}"),
            ("torque error, peak to peak, bound", f"{floor.bound_pp / tau_ref:.3%}"),
            ("rms, bound with returning fluxes", f"{floor.returning_rms / tau_ref:.3%}"),
            ("rms, bound with fluxes on the profile", f"{floor.on_profile_rms / tau_ref:.3%}"),
            ("rms, independent pulse width", f"{floor.pulse_width_rms / tau_ref:.3%}"),
        ]
    return lines


def _time(time: float) -> str:
    return f"{time * 1e3:.3f} ms" if isfinite(time) else f"over {LONGEST * 1e3:g} ms, or never"


PAIRS = (
    "Neighbouring phases couple, and the limit has what they add to each other; no least time of a "
    "torque step is known for such a machine."
)


def basis(limit: Limit) -> str:
    """What is proven and what is the best known."""
    parts = [PROFILE]
    if limit.floor is not None:
        parts.append(FLOOR)
    if limit.drive.machine.coupled:
        parts.append(PAIRS)
    return "\n".join(parts)
