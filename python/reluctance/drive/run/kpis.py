"""Key figures of a run, over whole electrical periods in its second half."""

from __future__ import annotations

import math

import numpy as np

from reluctance import _core
from reluctance.base.key_figures import Kpis
from reluctance.drive.drive import Drive
from reluctance.drive.run.columns import Rows
from reluctance.drive.run.events import Event, trip
from reluctance.drive.run.losses import switching_loss

SUN_SAMPLES = 501  # of the irradiance over the window: a cloud of a second takes 40 of them in 13 s
ROUNDING = 1e-10  # of the energy from the dc link: less is lost by no device
MEANS_NOTHING = 100.0  # a ripple of 10 000 %: the mean that it is held against is about zero


def kpis(
    rows: Rows,
    drive: Drive,
    *,
    p_fe: float | None,
    wall_s_per_sim_s: float,
    entered: list[Event] | None = None,
) -> Kpis:
    """Key figures from the period rows of a run.

    Parameters
    ----------
    rows : Rows
        At the start, at the end of each electrical period and at the end of the run.
    drive : Drive
    p_fe : float or None
        Iron loss over the window of the key figures [W].
    wall_s_per_sim_s : float
        Wall time per simulated time [1], for the record.
    entered : list of Event, optional
        The states of a supervised drive.
    """
    machine = drive.machine
    window, periods = evaluated(rows, machine.N_r)
    inside, run = window.between(1, len(window.values)), rows.between(1, len(rows.values))
    duration = window.rise("t")
    mean = {name: window.rise(name) / duration for name in MEANS}
    tau_mean = mean["tau"]
    tau_ref = mean["tau_ref"] if drive.control.follows_torque else None
    squared = window.phases("i_squared")[:, -1] - window.phases("i_squared")[:, 0]
    E_cu = float(machine.R * squared.sum())
    E_winding, E_mech, E_dc = (window.rise(name) for name in ("E_winding", "E_mech", "E_dc"))
    p_sw = switching_loss(drive.converter, mean["S_on"], mean["S_off"])
    estimated = (p_fe or 0.0) + (p_sw or 0.0)  # of the waveforms: the simulated link gives none
    p_in = mean["E_dc"] + estimated
    i_peak = float(inside["i_peak"].max())
    tau_span = float(inside["tau_max"].max() - inside["tau_min"].min())
    omega_span = float(inside["omega_max"].max() - inside["omega_min"].min())
    link = window.rise("E_source") - window.rise("E_loss") - window.rise("W_dc") - E_dc
    left_open = abs(link) + abs(E_winding - E_cu - E_mech - window.rise("W_f"))
    lost = E_dc - E_winding
    n_switches = _core.n_switches(drive.converter.core(), machine.n_phases)
    lengths = np.diff(window["t"])
    whole = lengths > lengths.max() / 2  # not the instant between two rows of one end
    means = np.diff(window["tau"])[whole] / lengths[whole]  # torque of each period
    return Kpis(
        tau_mean=tau_mean,
        tau_ref_mean=tau_ref,
        torque_ripple_pp=_ratio(tau_span, tau_mean),
        torque_ripple_rms=_ratio(_deviation(mean["tau_squared"], tau_mean), tau_mean),
        torque_error_rms=_ratio(float(np.sqrt(mean["error_squared"])), tau_ref),
        i_rms=float(np.sqrt(squared.max() / duration)),
        i_peak=i_peak,
        p_cu=E_cu / duration,
        p_dev=lost / duration if abs(lost) > ROUNDING * abs(E_dc) else 0.0,
        p_fe=p_fe,
        p_sw=p_sw,
        p_mech=mean["E_mech"],
        p_in=p_in,
        efficiency=_efficiency(mean["E_mech"], p_in),
        f_switch=mean["turn_ons"] / n_switches,
        speed_mean=mean["theta_m"],
        speed_ripple_pp=_ratio(omega_span, mean["theta_m"]),
        u_dc_min=float(inside["u_min"].min()),
        u_dc_max=float(inside["u_max"].max()),
        i_cap_rms=_deviation(mean["i_cap_squared"], mean["i_cap"]),
        i_peak_run=float(run["i_peak"].max()),
        u_dc_peak_run=float(run["u_max"].max()),
        speed_peak_run=float(max(run["omega_max"].max(), -run["omega_min"].min())),
        tracking=_tracking(drive, window),
        Q_mean=_mean_flow(drive, window),
        p_source=mean["E_source"] + estimated,
        energy_residual=_ratio(left_open, max(E_dc, E_cu, abs(E_mech))),
        torque_drift=_ratio(float(np.abs(means - tau_mean).max()), tau_mean),
        beyond_map=max(0.0, 1 - float(machine.i_known_A) / i_peak) if i_peak > 0 else 0.0,
        t_trip=trip(entered, float(rows["t"][-1])),
        control_period=drive.control.T_s,
        wall_s_per_sim_s=wall_s_per_sim_s,
        periods=periods,
    )


MEANS = (
    *("tau", "tau_ref", "tau_squared", "error_squared", "S_on", "S_off", "turn_ons"),
    *("E_source", "E_dc", "E_mech", "theta_m", "i_cap", "i_cap_squared"),
)


def _tracking(drive: Drive, window: Rows) -> float | None:
    """Energy from the array over the energy of its maximum power point, the window's."""
    if drive.source.kind != "pv":
        return None
    t = np.linspace(window["t"][0], window["t"][-1], SUN_SAMPLES)
    best = float(drive.source.available(t).mean()) * window.rise("t")
    return _ratio(window.rise("E_source"), best)


def _mean_flow(drive: Drive, window: Rows) -> float | None:
    """By the mean speed of each electrical period: the flow of water has no faster parts."""
    if drive.load.pump is None:
        return None
    t, theta = window["t"], window["theta_m"]
    lengths = np.diff(t)
    kept = lengths > 0
    omega = np.diff(theta)[kept] / lengths[kept]
    Q = drive.load.flow(omega, t[:-1][kept])
    return float(np.average(Q, weights=lengths[kept])) if kept.any() else None


def evaluated(rows: Rows, N_r: int) -> tuple[Rows, int]:
    """The rows of the whole periods in the second half of the run, and how many those are."""
    t, periods = rows["t"], rows["theta_m"] * N_r / (2 * np.pi)
    whole = np.abs(periods - np.round(periods)) < 1e-6
    moment = 1e-9 * t[-1]  # a run that ends with a period may have two rows at its end
    ends = np.flatnonzero(whole & (np.diff(t, prepend=-np.inf) > moment))
    second_half = ends[t[ends] >= t[-1] / 2 - moment]
    ends = second_half if len(second_half) >= 2 else ends[-2:]
    if len(ends) < 2 or abs(periods[ends[-1]] - periods[ends[0]]) < 0.5:
        return rows, 0
    return rows.between(int(ends[0]), int(ends[-1]) + 1), len(ends) - 1


def _efficiency(p_mech: float, p_in: float) -> float | None:
    """Of the way that the power takes; None where both sides feed the losses, or what was stored
    before does, so that more comes out than goes in."""
    if 0 < p_mech <= p_in:
        return p_mech / p_in
    return p_in / p_mech if p_mech <= p_in < 0 else None


def _deviation(squared: float, mean: float) -> float:
    """Rms deviation from the mean, of a quantity whose mean square this is."""
    return math.sqrt(max(squared - mean**2, 0.0))


def _ratio(part: float, whole: float | None) -> float | None:
    """part/|whole|; None where the whole is 0 or None, or so small that the ratio says nothing."""
    return part / abs(whole) if whole and part < MEANS_NOTHING * abs(whole) else None
