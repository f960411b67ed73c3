"""Key figures of a run, over whole electrical periods in its second half."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

# Columns of the period rows that the core writes (include/srm/sim/recorder.hpp).
T, THETA, OMEGA, W_F, TURN_ONS = 0, 1, 2, 3, 4
TAU_MIN, TAU_MAX, OMEGA_MIN, OMEGA_MAX, I_PEAK = 5, 6, 7, 8, 9
E_DC, E_WINDING, E_MECH, TAU, TAU_SQUARED, ERROR_SQUARED, I_SQUARED = 10, 11, 12, 13, 14, 15, 16


@dataclass(frozen=True)
class Kpis:
    """Key figures in SI units; ratios as fractions. Unfiltered, over `periods` electrical periods
    (0: the run is shorter than one, and the figures are over all of it)."""

    periods: int
    tau_mean: float  # [N m]
    torque_ripple: float  # (max - min)/mean [1]
    torque_ripple_rms: float  # rms deviation from the mean, over the mean [1]
    torque_error_rms: float  # rms of torque less its reference, over the mean reference [1]
    i_rms: float  # of the worst phase [A]
    i_peak: float  # [A]
    p_cu: float  # [W]
    p_dev: float  # switches and diodes, conduction [W]
    p_mech: float  # [W]
    p_in: float  # from the dc link [W]
    efficiency: float  # p_mech/p_in; 0 where nothing is drawn [1]
    switching_frequency: float  # turn-ons per switch and second, mean over all switches [Hz]
    speed_mean: float  # [rad/s]
    speed_ripple: float  # (max - min)/mean [1]
    energy_residual: float  # what the balance leaves open, over the energy supplied [1]
    control_period: float  # [s]
    wall_time_ratio: float  # wall time per simulated time inside the loop [1]

    def with_units(self) -> dict[str, float]:
        """The same under the names of the command line, with unit suffixes."""
        return {
            "tau_mean_Nm": self.tau_mean,
            "torque_ripple_pp": self.torque_ripple,
            "torque_ripple_rms": self.torque_ripple_rms,
            "torque_error_rms": self.torque_error_rms,
            "i_rms_A": self.i_rms,
            "i_peak_A": self.i_peak,
            "p_cu_W": self.p_cu,
            "p_dev_W": self.p_dev,
            "p_mech_W": self.p_mech,
            "p_in_W": self.p_in,
            "efficiency": self.efficiency,
            "f_switch_Hz": self.switching_frequency,
            "speed_mean_rpm": self.speed_mean * 30 / np.pi,
            "speed_ripple_pp": self.speed_ripple,
            "energy_residual": self.energy_residual,
            "control_period_s": self.control_period,
            "wall_s_per_sim_s": self.wall_time_ratio,
            "periods": self.periods,
        }


def kpis(
    rows: NDArray[np.float64],
    *,
    n_phases: int,
    R: float,
    N_r: int,
    T_s: float,
    wall_time_ratio: float,
) -> Kpis:
    """Key figures from the period rows of a run.

    Parameters
    ----------
    rows : ndarray, shape (n, 17 + n_phases)
        At the start, at the end of each electrical period and at the end of the run.

    Returns
    -------
    Kpis
        Where the law has no torque reference, the torque error is against the mean torque.
    """
    window, periods = _window(rows, N_r)
    first, last = window[0], window[-1]
    duration = last[T] - first[T]
    d = last - first
    tau_mean, tau_ref = d[TAU] / duration, d[-1] / duration
    variance = max(d[TAU_SQUARED] / duration - tau_mean**2, 0.0)
    squared = d[I_SQUARED : I_SQUARED + n_phases]
    E_cu = R * squared.sum()
    supplied = max(d[E_DC], E_cu, abs(d[E_MECH]))
    inside = window[1:]
    tau_span = inside[:, TAU_MAX].max() - inside[:, TAU_MIN].min()
    omega_span = inside[:, OMEGA_MAX].max() - inside[:, OMEGA_MIN].min()
    omega_mean = (last[THETA] - first[THETA]) / duration
    error = np.sqrt(d[ERROR_SQUARED] / duration if tau_ref else variance)
    return Kpis(
        periods=periods,
        tau_mean=tau_mean,
        torque_ripple=_ratio(tau_span, tau_mean),
        torque_ripple_rms=_ratio(np.sqrt(variance), tau_mean),
        torque_error_rms=_ratio(error, tau_ref or tau_mean),
        i_rms=float(np.sqrt(squared.max() / duration)),
        i_peak=float(inside[:, I_PEAK].max()),
        p_cu=E_cu / duration,
        p_dev=(d[E_DC] - d[E_WINDING]) / duration,
        p_mech=d[E_MECH] / duration,
        p_in=d[E_DC] / duration,
        efficiency=_ratio(d[E_MECH], d[E_DC]),
        switching_frequency=d[TURN_ONS] / duration / (2 * n_phases),
        speed_mean=omega_mean,
        speed_ripple=_ratio(omega_span, omega_mean),
        energy_residual=_ratio(d[E_WINDING] - E_cu - d[E_MECH] - d[W_F], supplied),
        control_period=T_s,
        wall_time_ratio=wall_time_ratio,
    )


def _window(rows: NDArray[np.float64], N_r: int) -> tuple[NDArray[np.float64], int]:
    """The rows of the whole periods in the second half of the run, and how many those are."""
    periods = rows[:, THETA] * N_r / (2 * np.pi)
    whole = np.abs(periods - np.round(periods)) < 1e-6
    ends = np.flatnonzero(whole & (rows[:, T] >= rows[-1, T] / 2))
    if len(ends) < 2:
        ends = np.flatnonzero(whole)[-2:]
    if len(ends) < 2 or rows[ends[-1], T] == rows[ends[0], T]:
        return rows, 0
    return rows[ends[0] : ends[-1] + 1], len(ends) - 1


def _ratio(part: float, whole: float) -> float:
    """part/|whole|; 0 where the whole is 0, so that every key figure stays a number."""
    return float(part / abs(whole)) if whole != 0 else 0.0
