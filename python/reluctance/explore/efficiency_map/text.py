"""An efficiency map in a few lines, for people and for programs."""

from __future__ import annotations

from reluctance.base.units import from_si
from reluctance.explore.efficiency_map.cycle import Driven
from reluctance.explore.efficiency_map.map import LOSSES, EfficiencyMap


def rows(found: EfficiencyMap, taken: Driven | None) -> list[tuple[str, str]]:
    """Labels and values."""
    best = found.best()
    speeds = [f"{from_si(float(w), 'rpm'):.5g}" for w in (found.omega[0], found.omega[-1])]
    top = max(abs(float(x)) for x in found.tau_max)
    drops = found.drive.converter.has_drops
    counted = [kind for kind in found.kinds_per_torque if drops or kind != "p_dev_W"]
    shown = [
        ("speeds", f"{speeds[0]} to {speeds[1]} rpm"),
        ("greatest torque held, of those asked for", f"{top:.4g} N m"),
        *_best_rows(best),
        ("losses counted", ", ".join(LOSSES[kind] for kind in counted)),
        ("switched runs made now", f"{found.ran}"),
    ]
    if taken is None:
        return shown
    shown += [
        ("cycle: energy to the shaft", f"{taken.E_mech / 3600:.4g} Wh"),
        ("cycle: energy from the shaft", f"{taken.E_braked / 3600:.4g} Wh"),
        ("cycle: energy from the dc link", f"{taken.E_in / 3600:.4g} Wh"),
        ("cycle: energy back to the dc link", f"{taken.E_returned / 3600:.4g} Wh"),
        ("cycle: all losses", f"{taken.loss['loss'] / 3600:.4g} Wh"),
        ("cycle: efficiency", "-" if taken.efficiency is None else f"{taken.efficiency:.2%}"),
        ("cycle: time within what the drive holds", f"{taken.held:.1%}"),
        ("cycle: time below the map's first speed or torque", f"{taken.below:.1%}"),
    ]
    return shown


def _best_rows(best: tuple[float, float, float] | None) -> list[tuple[str, str]]:
    if best is None:
        return [("best efficiency of the grid", "none: shaft and dc link both feed the losses")]
    eta, omega, tau = best
    return [
        ("best efficiency of the grid", f"{eta:.2%}"),
        ("at", f"{from_si(omega, 'rpm'):.5g} rpm, {tau:.4g} N m"),
    ]


def as_object(found: EfficiencyMap, taken: Driven | None) -> dict[str, object]:
    """What `--json` prints."""
    eta, omega, tau = found.best() or (None, None, None)
    table = found.columns()
    return {
        "u_dc_V": found.u_dc,
        "best_efficiency": eta,
        "best_speed_rpm": None if omega is None else from_si(omega, "rpm"),
        "best_tau_Nm": tau,
        "speed_rpm": from_si(found.omega, "rpm").tolist(),
        "tau_max_Nm": found.tau_max.tolist(),
        "ran": found.ran,
        "map": {k: [None if x != x else x for x in v.tolist()] for k, v in table.items()},
        "cycle": None if taken is None else taken.with_units(),
    }
