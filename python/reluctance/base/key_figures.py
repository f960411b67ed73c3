"""The key figures of a run: their names, their units, and what a reader must know of them."""

from __future__ import annotations

from dataclasses import Field, dataclass, field, fields
from typing import Any

from reluctance.base.units import from_si

STANDSTILL = 1e-3  # [rad/s]
NOT_HELD = 0.05  # deviation of the mean torque from its reference that is worth a remark
LEFT_OPEN = 1e-3  # of the energy supplied: a ten-thousandfold of what runs leave open
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
        both sides feed the losses, or what was stored before does.
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
    i_cap_rms : float
        Rms current of the dc-link capacitor [A]; where the link holds its voltage, of what the
        bridge draws less its mean, which the source gives.
    i_peak_run : float
        Greatest current of any phase over the whole run, its start and every braking included:
        what the parts must stand [A].
    u_dc_peak_run : float
        Greatest dc-link voltage over the whole run [V].
    speed_peak_run : float
        Greatest speed of either direction over the whole run [rad/s].
    tracking : float or None
        Energy from the array over what its maximum power point gives [1]; None without an array.
    Q_mean : float or None
        Mean flow of the pump [m^3/s]; None where the load has no pump curve.
    p_source : float
        Power from the source of the dc link: before the loss in a battery; with the iron and the
        switching loss, as `p_in` [W].
    energy_residual : float or None
        What the energy balance from the source to the shaft leaves open, over the energy supplied
        [1].
    torque_drift : float or None
        Largest deviation of one period's mean torque, over the mean [1].
    beyond_map : float
        Part of the peak current that lies past the flux map, else 0 [1].
    t_trip : float or None
        When the drive trips [s]; None where it does not, or works again from the first half of the
        run on.
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
    i_cap_rms: float = unit("A")
    i_peak_run: float = unit("A")
    u_dc_peak_run: float = unit("V")
    speed_peak_run: float = unit("rpm")
    tracking: float | None = unit("")
    Q_mean: float | None = unit("m3ph")
    p_source: float = unit("W")
    energy_residual: float | None = unit("")
    torque_drift: float | None = unit("")
    beyond_map: float = unit("")
    t_trip: float | None = unit("s")
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

    def remarks(self, *, steady: bool = True, sound: bool = True) -> list[str]:
        """What a reader of these figures must know, each on one line; steady: whether the drive was
        asked for a constant, so that its torque should have settled; sound: whether it has neither
        faults nor parts or sensors that differ from what its control knows."""
        begun = start_included(self.periods, self.speed_mean)
        found = [begun] if begun else []
        drift = self.torque_drift or 0.0
        if steady and self.periods >= 2 and drift > DRIFTS:
            found.append(
                f"the torque has not settled (a period's mean is up to {drift:.1%} "
                "off): the ripple figures contain that; run longer (--until): what stays is a beat "
                "of the control period with the electrical one"
            )
        held = self.tau_mean / self.tau_ref_mean if self.tau_ref_mean else 1.0
        if self.periods >= 2 and abs(held - 1) > NOT_HELD:
            if not sound:
                why = "[[faults]], [mismatch] or [sensing] of the drive file may be why"
            elif 0 < held < 1:
                why = (
                    "`reluctance limit` tells whether this machine could at this voltage and speed"
                )
            else:
                why = "the law, its sensors or its model are wrong for this point"
            found.append(f"the torque reference is not held ({held:.0%} of it); {why}")
        left = self.energy_residual or 0.0
        if left > LEFT_OPEN:
            found.append(
                f"the energy balance leaves {left:.2g} of the energy supplied open: the "
                "integration is not accurate here; lower [simulation] dt_max_us"
            )
        return found

    def _repr_html_(self) -> str:
        """A table for notebooks."""
        rows = "".join(
            f"<tr><td>{key}</td><td>{shown(value)}</td></tr>"
            for key, value in self.with_units().items()
        )
        return f"<table>{rows}</table>"


def start_included(periods: float, speed_mean: float) -> str:
    """Why figures over so many electrical periods may include the start of their run, at a mean
    speed [rad/s]; empty where they do not, or are not there (NaN)."""
    if not periods < 2:
        return ""
    if abs(speed_mean) < STANDSTILL:
        return (
            "no electrical period ends at standstill: the figures are over all of the run, its "
            "start included"
        )
    if periods < 1:
        return (
            "no whole electrical period: the figures are over all of the run, its start included; "
            "run longer (--until)"
        )
    return (
        "one whole electrical period is evaluated: the figures may include what the start of the "
        "run has left; run longer (--until)"
    )


def definite(value: float | None) -> float:
    """A key figure where it has a meaning, as the ripple of a drive that gives torque."""
    if value is None:
        raise RuntimeError("a key figure without meaning here: no torque, no reference or no speed")
    return value


def shown(value: float | None, form: str = "{:.6g}") -> str:
    """A key figure as text; `-` where it has no meaning."""
    return "-" if value is None else form.format(value)
