"""Key figures of a run, over whole electrical periods in its second half."""

from dataclasses import dataclass

import numpy as np

from reluctance.drive.loss_data import SwitchingEnergies
from reluctance.drive.machine import MachineFile
from reluctance.run.columns import Table
from reluctance.run.losses import switching_loss

NOT_HELD = 0.05  # deviation of the mean torque from its reference that is worth a remark
DRIFTS = 0.02  # of the mean torque, by a period: above, the drive has not settled


@dataclass(frozen=True)
class Kpis:
    """Key figures in SI units; ratios as fractions. Unfiltered, over `periods` electrical periods
    (0: the run is shorter than one, and the figures are over all of it)."""

    periods: int
    tau_mean: float  # [N m]
    tau_ref: float  # mean torque reference; 0 where the law has none [N m]
    torque_ripple: float  # (max - min)/mean [1]
    torque_ripple_rms: float  # rms deviation from the mean, over the mean [1]
    torque_error_rms: float  # rms of torque less its reference, over the mean reference [1]
    i_rms: float  # of the worst phase [A]
    i_peak: float  # [A]
    p_cu: float  # [W]
    p_dev: float  # switches and diodes, conduction [W]
    p_mech: float  # [W]
    p_fe: float | None  # iron, an estimate; None: the machine has no [machine.iron] [W]
    p_sw: float | None  # switching; None: the converter has no E_on_mJ, E_off_mJ, E_rr_mJ [W]
    p_in: float  # from the dc link, p_fe and p_sw included [W]
    efficiency: float  # p_mech/p_in; 0 where nothing is drawn [1]
    switching_frequency: float  # turn-ons per switch and second, mean over all switches [Hz]
    speed_mean: float  # [rad/s]
    speed_ripple: float  # (max - min)/mean [1]
    energy_residual: float  # what the loop's balance leaves open, over the energy supplied [1]
    torque_drift: float  # largest deviation of one period's mean torque, over the mean [1]
    beyond_map: float  # part of the peak current that lies past the flux map; else 0 [1]
    control_period: float  # [s]
    wall_time_ratio: float  # wall time per simulated time inside the loop [1]

    def remarks(self) -> list[str]:
        """What a reader of these figures must know, each on one line."""
        found = []
        if self.periods < 2:
            found.append(
                f"{self.periods} whole electrical periods in the second half of the run: the "
                "figures include its start; run longer (--until)"
            )
        if self.periods >= 2 and self.torque_drift > DRIFTS:
            found.append(
                f"the torque has not settled (a period's mean is up to {self.torque_drift:.1%} "
                "off): the ripple figures contain that; run longer (--until)"
            )
        held = self.tau_mean / self.tau_ref if self.tau_ref else 1.0
        if self.periods >= 2 and abs(held - 1) > NOT_HELD:
            found.append(
                f"the torque reference is not held ({held:.0%} of it); `reluctance limit` tells "
                "whether this machine could at this voltage and speed"
            )
        return found

    def with_units(self) -> dict[str, float]:
        """The same under the names of the command line, with unit suffixes; what is not modelled
        is left out."""
        figures = {
            "tau_mean_Nm": self.tau_mean,
            "tau_ref_mean_Nm": self.tau_ref,
            "torque_ripple_pp": self.torque_ripple,
            "torque_ripple_rms": self.torque_ripple_rms,
            "torque_error_rms": self.torque_error_rms,
            "i_rms_A": self.i_rms,
            "i_peak_A": self.i_peak,
            "p_cu_W": self.p_cu,
            "p_dev_W": self.p_dev,
            "p_fe_W": self.p_fe,
            "p_sw_W": self.p_sw,
            "p_mech_W": self.p_mech,
            "p_in_W": self.p_in,
            "efficiency": self.efficiency,
            "f_switch_Hz": self.switching_frequency,
            "speed_mean_rpm": self.speed_mean * 30 / np.pi,
            "speed_ripple_pp": self.speed_ripple,
            "energy_residual": self.energy_residual,
            "beyond_map": self.beyond_map,
            "control_period_s": self.control_period,
            "wall_s_per_sim_s": self.wall_time_ratio,
            "periods": self.periods,
        }
        return {name: value for name, value in figures.items() if value is not None}


def kpis(
    periods: Table,
    *,
    machine: MachineFile,
    switching: SwitchingEnergies,
    n_switches: int,
    p_fe: float | None,
    T_s: float,
    wall_time_ratio: float,
) -> Kpis:
    """Key figures from the period rows of a run.

    Parameters
    ----------
    periods : Table
        At the start, at the end of each electrical period and at the end of the run.
    machine : MachineFile
    switching : SwitchingEnergies
        Of the converter: what a turn-on and a turn-off cost.
    n_switches : int
        Of the converter.
    p_fe : float or None
        Iron loss over the window of the key figures [W].
    T_s : float
        Control period [s], for the record.
    wall_time_ratio : float
        Wall time per simulated time [1], for the record.

    Returns
    -------
    Kpis
        Where the law has no torque reference, the torque error is against the mean torque.
    """
    window, n_periods = evaluated(periods, machine.N_r)
    d = {name: values[..., -1] - values[..., 0] for name, values in window.items()}
    duration = d["t"]
    tau_mean, tau_ref = d["tau"] / duration, d["tau_ref"] / duration
    variance = max(d["tau_squared"] / duration - tau_mean**2, 0.0)
    E_cu = machine.R * d["i_squared"].sum()
    p_sw = switching_loss(switching, d["S_on"] / duration, d["S_off"] / duration)
    p_in = d["E_dc"] / duration + (p_fe or 0.0) + (p_sw or 0.0)
    inside = {name: values[..., 1:] for name, values in window.items()}
    i_peak = float(inside["i_peak"].max())
    link = d["E_source"] - d["E_loss"] - d["W_dc"] - d["E_dc"]
    left_open = link + d["E_winding"] - E_cu - d["E_mech"] - d["W_f"]
    supplied = max(d["E_dc"], E_cu, abs(d["E_mech"]))
    tau_span = inside["tau_max"].max() - inside["tau_min"].min()
    omega_span = inside["omega_max"].max() - inside["omega_min"].min()
    omega_mean = d["theta_m"] / duration
    lengths = np.diff(window["t"])
    whole = lengths > lengths.max() / 2  # not the instant between two rows of one end
    means = np.diff(window["tau"])[whole] / lengths[whole]  # torque of each period
    error = np.sqrt(d["error_squared"] / duration if tau_ref else variance)
    return Kpis(
        periods=n_periods,
        tau_mean=tau_mean,
        tau_ref=tau_ref,
        torque_ripple=_ratio(tau_span, tau_mean),
        torque_ripple_rms=_ratio(np.sqrt(variance), tau_mean),
        torque_error_rms=_ratio(error, tau_ref or tau_mean),
        i_rms=float(np.sqrt(d["i_squared"].max() / duration)),
        i_peak=i_peak,
        p_cu=E_cu / duration,
        p_dev=(d["E_dc"] - d["E_winding"]) / duration,
        p_mech=d["E_mech"] / duration,
        p_fe=p_fe,
        p_sw=p_sw,
        p_in=p_in,
        efficiency=_ratio(d["E_mech"] / duration, p_in),
        switching_frequency=d["turn_ons"] / duration / n_switches,
        speed_mean=omega_mean,
        speed_ripple=_ratio(omega_span, omega_mean),
        energy_residual=_ratio(left_open, supplied),
        torque_drift=_ratio(np.abs(means - tau_mean).max(), tau_mean),
        beyond_map=max(0.0, 1 - machine.i_known_A / i_peak) if i_peak > 0 else 0.0,
        control_period=T_s,
        wall_time_ratio=wall_time_ratio,
    )


def evaluated(periods: Table, N_r: int) -> tuple[Table, int]:
    """The rows of the whole periods in the second half of the run, and how many those are."""
    t, turned = periods["t"], periods["theta_m"] * N_r / (2 * np.pi)
    whole = np.abs(turned - np.round(turned)) < 1e-6
    moment = 1e-9 * t[-1]  # a run that ends with a period has two rows at its end
    ends = np.flatnonzero(whole & (np.diff(t, append=np.inf) > moment))
    second_half = ends[t[ends] >= t[-1] / 2 - moment]
    ends = second_half if len(second_half) >= 2 else ends[-2:]
    if len(ends) < 2 or abs(turned[ends[-1]] - turned[ends[0]]) < 0.5:
        return periods, 0
    chosen = slice(ends[0], ends[-1] + 1)
    return {name: values[..., chosen] for name, values in periods.items()}, len(ends) - 1


def _ratio(part: float, whole: float) -> float:
    """part/|whole|; 0 where the whole is 0, so that every key figure stays a number."""
    return float(part / abs(whole)) if whole != 0 else 0.0
