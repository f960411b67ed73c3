"""What a run leaves: waveforms and key figures, and ways to look at them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from reluctance.drive import Drive
from reluctance.drive.pump_load import flow
from reluctance.errors import ParameterError
from reluctance.run.columns import LETTERS, FloatArray, Rows
from reluctance.run.kpis import Kpis
from reluctance.run.learned import Learned
from reluctance.units import from_si

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False)
class Result:
    """Waveforms and key figures of a run. At an event the row shows what holds from then on.

    Attributes
    ----------
    drive : Drive
        What was run.
    kpis : Kpis
        Key figures.
    t : ndarray, shape (n,)
        Instants [s].
    theta_m : ndarray, shape (n,)
        Rotor angle, mechanical [rad].
    omega_m : ndarray, shape (n,)
        Speed [rad/s].
    tau : ndarray, shape (n,)
        Torque of all phases [N m].
    tau_ref : ndarray, shape (n,)
        Torque reference [N m]; 0 where the law has none.
    i : ndarray, shape (n_phases, n)
        Phase currents [A].
    i_ref : ndarray, shape (n_phases, n)
        Their references [A]; 0 where the law commands legs directly.
    leg : ndarray, shape (n_phases, n)
        1 magnetize, 0 freewheel, -1 demagnetize.
    u : ndarray, shape (n_phases, n)
        Winding voltages [V].
    psi : ndarray, shape (n_phases, n)
        Flux linkages [Wb].
    tau_ph : ndarray, shape (n_phases, n)
        Torques of the phases [N m].
    u_dc : ndarray, shape (n,)
        Dc-link voltage [V].
    periods : Rows
        One row per electrical period; columns as in include/srm/sim/recorder.hpp.
    learned : Learned or None
        What the controller has learned of its machine; None where it does not learn.
    """

    drive: Drive
    kpis: Kpis
    t: FloatArray
    theta_m: FloatArray
    omega_m: FloatArray
    tau: FloatArray
    tau_ref: FloatArray
    i: FloatArray
    i_ref: FloatArray
    leg: FloatArray
    u: FloatArray
    psi: FloatArray
    tau_ph: FloatArray
    u_dc: FloatArray
    periods: Rows
    learned: Learned | None = None

    def __repr__(self) -> str:
        k = self.kpis
        ripple = "" if k.torque_ripple_pp is None else f", ripple {k.torque_ripple_pp:.2%}"
        return (
            f"Result({self.drive.name}: {k.tau_mean:.4g} N m{ripple}, "
            f"{k.f_switch / 1e3:.4g} kHz; {self.t.size} rows of waveforms)"
        )

    def _repr_html_(self) -> str:
        """The key figures, for notebooks."""
        return f"<p>{self.drive.name}</p>{self.kpis._repr_html_()}"

    def plot(self) -> Figure:
        """An overview of the last electrical periods; a Matplotlib figure that belongs to the
        caller.

        Raises
        ------
        ParameterError
            If the run kept no waveforms.
        """
        from reluctance.run.plots import overview  # Matplotlib loads when it is used

        if self.t.size == 0:
            raise ParameterError("the run has no waveforms; simulate with record = 0")
        return overview(self)

    def to_dataframe(self) -> Any:
        """The waveforms as a pandas table, columns as in a waveform file: `t_s`, `speed_rpm`, ...

        Raises
        ------
        ParameterError
            If pandas is not installed.
        """
        try:
            import pandas  # type: ignore[import-untyped,import-not-found,unused-ignore]
        except ImportError:
            raise ParameterError(
                "to_dataframe() needs pandas; `pip install pandas`, or use the arrays of the result"
            ) from None
        return pandas.DataFrame(self.columns())

    @property
    def Q(self) -> FloatArray:
        """Flow of the pump, shape (n,) [m^3/s]; 0 where the load has none."""
        return flow(self.drive.load, self.omega_m, self.t)

    def columns(self) -> dict[str, FloatArray]:
        """The waveforms under their border names, each of shape (n,)."""
        table = {
            "t_s": self.t,
            "theta_m_rad": self.theta_m,
            "speed_rpm": from_si(self.omega_m, "rpm"),
            "u_dc_V": self.u_dc,
            "tau_Nm": self.tau,
            "tau_ref_Nm": self.tau_ref,
        }
        for k in range(len(self.i)):
            phase = LETTERS[k]
            table[f"i_{phase}_A"] = self.i[k]
            table[f"u_{phase}_V"] = self.u[k]
            table[f"psi_{phase}_Wb"] = self.psi[k]
            table[f"tau_{phase}_Nm"] = self.tau_ph[k]
            table[f"leg_{phase}"] = self.leg[k]
            table[f"i_ref_{phase}_A"] = self.i_ref[k]
        if self.drive.load.pump is not None:
            table["Q_m3ph"] = from_si(self.Q, "m3ph")
        return table
