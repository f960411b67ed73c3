"""Key figures of a run, over whole electrical periods in its second half."""

from __future__ import annotations

from dataclasses import Field, dataclass, field, fields
from typing import Any

import numpy as np

from reluctance import _core
from reluctance.drive import Drive
from reluctance.run.columns import Rows
from reluctance.run.losses import switching_loss
from reluctance.run.plant import bridge
from reluctance.units import from_si

NOT_HELD = 0.05  # deviation of the mean torque from its reference that is worth a remark
ROUNDING = 1e-10  # of the energy from the dc link: less is lost by no device
MEANS_NOTHING = 100.0  # a ripple of 10 000 %: the mean that it is held against is about zero
FEW_SAMPLES = 10.0  # of the controller in an electrical period: below, a remark
DRIFTS = 0.02  # of the mean torque, by a period: above, the drive has not settled


def unit(name: str) -> Any:
    """A key figure that the border shows in a unit, the suffix of its key; "" for a ratio."""
    return field(metadata={"unit": name})


@dataclass(frozen=True)
class Kpis:
    """Key figures, unfiltered, over whole electrical periods. In SI; ratios as fractions; None
    where a figure has no meaning. The names are those of `run --json` without the unit.

    Attributes
    ----------
    tau_mean : float
        Mean torque [N m].
    tau_ref_mean : float or None
        Mean torque reference [N m]; None where the law has none.
    torque_ripple_pp : float or None
        Peak to peak, (max - min)/mean [1]; None with zero mean torque.
    torque_ripple_rms : float or None
        Rms deviation from the mean, over the mean [1].
    torque_error_rms : float or None
        Rms of torque less its reference, over the mean reference [1]; None without reference.
    i_rms : float
        Rms current of the worst phase [A].
    i_peak : float
        Peak current of any phase [A].
    p_cu : float
        Copper loss of all phases [W].
    p_dev : float
        Conduction loss of switches and diodes [W].
    p_fe : float or None
        Iron loss, an estimate [W]; None without [machine.iron].
    p_sw : float or None
        Switching loss [W]; None without E_on_mJ, E_off_mJ, E_rr_mJ of the converter.
    p_mech : float
        Mechanical power [W]; negative when braking.
    p_in : float
        Power from the dc link, p_fe and p_sw included [W]; negative when it flows back.
    efficiency : float or None
        p_mech/p_in when motoring, p_in/p_mech when power flows back to the dc link [1]; None when
        both sides feed the losses.
    f_switch : float
        Turn-ons per switch per second, mean over all switches [Hz].
    speed_mean : float
        Mean speed [rad/s].
    speed_ripple_pp : float or None
        Peak to peak, (max - min)/mean [1]; None at standstill.
    u_dc_min : float
        Least dc-link voltage [V].
    u_dc_max : float
        Greatest dc-link voltage [V].
    p_source : float
        Power from the source of the dc link: before the loss in a battery [W].
    energy_residual : float or None
        What the energy balance from the source to the shaft leaves open, over the energy supplied
        [1].
    torque_drift : float or None
        Largest deviation of one period's mean torque, over the mean [1].
    beyond_map : float
        Part of the peak current that lies past the flux map, else 0 [1].
    control_period : float
        Control period [s].
    wall_s_per_sim_s : float
        Wall time per simulated time inside the loop [1].
    periods : int
        Electrical periods evaluated; 0: the run is shorter than one, and the figures are over all
        of it.
    """

    tau_mean: float = unit("Nm")
    tau_ref_mean: float | None = unit("Nm")
    torque_ripple_pp: float | None = unit("")
    torque_ripple_rms: float | None = unit("")
    torque_error_rms: float | None = unit("")
    i_rms: float = unit("A")
    i_peak: float = unit("A")
    p_cu: float = unit("W")
    p_dev: float = unit("W")
    p_fe: float | None = unit("W")
    p_sw: float | None = unit("W")
    p_mech: float = unit("W")
    p_in: float = unit("W")
    efficiency: float | None = unit("")
    f_switch: float = unit("Hz")
    speed_mean: float = unit("rpm")
    speed_ripple_pp: float | None = unit("")
    u_dc_min: float = unit("V")
    u_dc_max: float = unit("V")
    p_source: float = unit("W")
    energy_residual: float | None = unit("")
    torque_drift: float | None = unit("")
    beyond_map: float = unit("")
    control_period: float = unit("s")
    wall_s_per_sim_s: float = unit("")
    periods: int = unit("")

    def with_units(self) -> dict[str, float | None]:
        """The same under the names of the command line, with unit suffixes."""
        found = {}
        for key, figure in self.border_names().items():
            value, suffix = getattr(self, figure.name), figure.metadata["unit"]
            found[key] = from_si(value, suffix) if suffix and value is not None else value
        return found

    @classmethod
    def border_names(cls) -> dict[str, Field[Any]]:
        """The names of the command line, with unit suffixes, and the figures that they show."""
        return {
            f"{figure.name}_{suffix}"
            if (suffix := figure.metadata["unit"])
            else figure.name: figure
            for figure in fields(cls)
        }

    def remarks(self) -> list[str]:
        """What a reader of these figures must know, each on one line."""
        found = []
        if self.periods < 2:
            found.append(
                f"{self.periods} whole electrical periods in the second half of the run: the "
                "figures include its start; run longer (--until)"
            )
        drift = self.torque_drift or 0.0
        if self.periods >= 2 and drift > DRIFTS:
            found.append(
                f"the torque has not settled (a period's mean is up to {drift:.1%} "
                "off): the ripple figures contain that; run longer (--until)"
            )
        held = self.tau_mean / self.tau_ref_mean if self.tau_ref_mean else 1.0
        if self.periods >= 2 and abs(held - 1) > NOT_HELD:
            found.append(
                f"the torque reference is not held ({held:.0%} of it); `reluctance limit` tells "
                "whether this machine could at this voltage and speed"
            )
        return found

    def _repr_html_(self) -> str:
        """A table for notebooks."""
        rows = "".join(
            f"<tr><td>{key}</td><td>{shown(value)}</td></tr>"
            for key, value in self.with_units().items()
        )
        return f"<table>{rows}</table>"


def kpis(rows: Rows, drive: Drive, *, p_fe: float | None, wall_s_per_sim_s: float) -> Kpis:
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
    """
    machine = drive.machine
    window, periods = evaluated(rows, machine.N_r)
    inside = window.between(1, len(window.values))
    duration = window.rise("t")
    mean = {name: window.rise(name) / duration for name in MEANS}
    tau_mean = mean["tau"]
    tau_ref = mean["tau_ref"] if drive.control.follows_torque else None
    variance = max(mean["tau_squared"] - tau_mean**2, 0.0)
    squared = window.phases("i_squared")[:, -1] - window.phases("i_squared")[:, 0]
    E_cu = float(machine.R * squared.sum())
    E_winding, E_mech, E_dc = (window.rise(name) for name in ("E_winding", "E_mech", "E_dc"))
    p_sw = switching_loss(drive.converter, mean["S_on"], mean["S_off"])
    p_in = mean["E_dc"] + (p_fe or 0.0) + (p_sw or 0.0)
    i_peak = float(inside["i_peak"].max())
    tau_span = float(inside["tau_max"].max() - inside["tau_min"].min())
    omega_span = float(inside["omega_max"].max() - inside["omega_min"].min())
    link = window.rise("E_source") - window.rise("E_loss") - window.rise("W_dc") - E_dc
    left_open = abs(link) + abs(E_winding - E_cu - E_mech - window.rise("W_f"))
    lost = E_dc - E_winding
    n_switches = _core.n_switches(bridge(drive.converter), machine.n_phases)
    lengths = np.diff(window["t"])
    whole = lengths > lengths.max() / 2  # not the instant between two rows of one end
    means = np.diff(window["tau"])[whole] / lengths[whole]  # torque of each period
    return Kpis(
        tau_mean=tau_mean,
        tau_ref_mean=tau_ref,
        torque_ripple_pp=_ratio(tau_span, tau_mean),
        torque_ripple_rms=_ratio(float(np.sqrt(variance)), tau_mean),
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
        p_source=mean["E_source"],
        energy_residual=_ratio(left_open, max(E_dc, E_cu, abs(E_mech))),
        torque_drift=_ratio(float(np.abs(means - tau_mean).max()), tau_mean),
        beyond_map=max(0.0, 1 - float(machine.i_known_A) / i_peak) if i_peak > 0 else 0.0,
        control_period=drive.control.T_s,
        wall_s_per_sim_s=wall_s_per_sim_s,
        periods=periods,
    )


MEANS = (
    *("tau", "tau_ref", "tau_squared", "error_squared", "S_on", "S_off", "turn_ons"),
    *("E_source", "E_dc", "E_mech", "theta_m"),
)


def evaluated(rows: Rows, N_r: int) -> tuple[Rows, int]:
    """The rows of the whole periods in the second half of the run, and how many those are."""
    t, periods = rows["t"], rows["theta_m"] * N_r / (2 * np.pi)
    whole = np.abs(periods - np.round(periods)) < 1e-6
    moment = 1e-9 * t[-1]  # a run that ends with a period has two rows at its end
    ends = np.flatnonzero(whole & (np.diff(t, append=np.inf) > moment))
    second_half = ends[t[ends] >= t[-1] / 2 - moment]
    ends = second_half if len(second_half) >= 2 else ends[-2:]
    if len(ends) < 2 or abs(periods[ends[-1]] - periods[ends[0]]) < 0.5:
        return rows, 0
    return rows.between(int(ends[0]), int(ends[-1]) + 1), len(ends) - 1


def definite(value: float | None) -> float:
    """A key figure where it has a meaning, as the ripple of a drive that gives torque."""
    if value is None:
        raise RuntimeError("a key figure without meaning here: no torque, no reference or no speed")
    return value


def shown(value: float | None, form: str = "{:.6g}") -> str:
    """A key figure as text; `-` where it has no meaning."""
    return "-" if value is None else form.format(value)


def _efficiency(p_mech: float, p_in: float) -> float | None:
    """Of the way that the power takes; None where both sides feed the losses."""
    if p_mech > 0 and p_in > 0:
        return p_mech / p_in
    return p_in / p_mech if p_mech < 0 and p_in < 0 else None


def _ratio(part: float, whole: float | None) -> float | None:
    """part/|whole|; None where the whole is 0 or None, or so small that the ratio says nothing."""
    return part / abs(whole) if whole and part < MEANS_NOTHING * abs(whole) else None
