"""Key figures of an episode, from the sums of the core. They include its start."""

from __future__ import annotations

import numpy as np

from reluctance import _core
from reluctance.targets.gym.episodes import Episodes, rules_tau


def figures(episodes: Episodes, batch: _core.Batch, drive: int) -> dict[str, float]:
    """Means since the start of an episode, in SI.

    Returns
    -------
    dict
        tau_mean [N m], torque_error_rms over the greatest torque reference [1] (task torque),
        p_cu, p_mech, p_in [W], f_switch per switch [Hz], duration [s].
    """
    t, tau, error, E_cu, E_mech, E_dc, turn_ons = batch.figures(drive)
    of = episodes.drive
    n_switches = _core.n_switches(of.converter.core(), of.machine.n_phases)
    found = {
        "tau_mean": tau / t,
        "p_cu": E_cu / t,
        "p_mech": E_mech / t,
        "p_in": E_dc / t,
        "f_switch": turn_ons / (n_switches * t),
        "duration": t,
    }
    if episodes.task == "torque":
        found["torque_error_rms"] = float(np.sqrt(error / t)) / rules_tau(of)
    return found
