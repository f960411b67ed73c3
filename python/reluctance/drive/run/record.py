"""What a run leaves: waveforms, key figures, events."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from reluctance.base.arrays import FloatArray
from reluctance.base.key_figures import Kpis
from reluctance.base.phases import LETTERS
from reluctance.base.units import from_si
from reluctance.drive.drive import Drive
from reluctance.drive.run.columns import Rows
from reluctance.drive.run.estimate import Estimate
from reluctance.drive.run.events import MODES, Event
from reluctance.drive.run.learned import Learned
from reluctance.drive.tables.faults import Fault

WAVEFORMS = (
    *("t", "theta_m", "omega_m", "tau", "tau_ref", "u_dc"),  # (n,)
    *("i", "i_ref", "leg", "u", "psi", "tau_ph"),  # (n_phases, n)
)


@dataclass(frozen=True, repr=False)
class Record:
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
    estimate : Estimate or None
        Where the rotor is by the flux linkages; None without [protection] flux_angle.
    events : list of Event or None
        The states that the drive has entered; None where it has no [supervision].
    faults : list of (float, Fault)
        The [[faults]] that have begun, and when [s].
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
    estimate: Estimate | None = None
    events: list[Event] | None = None
    faults: list[tuple[float, Fault]] = field(default_factory=list)

    def since(self, start: float) -> Self:
        """The rows from `start` [s] on."""
        kept = self.t >= start
        rows = {name: getattr(self, name)[..., kept] for name in WAVEFORMS}
        estimate = None if self.estimate is None else self.estimate.kept(kept)
        return replace(self, estimate=estimate, **rows)

    @property
    def Q(self) -> FloatArray:
        """Flow of the pump, shape (n,) [m^3/s]; 0 where the load has none."""
        return self.drive.load.flow(self.omega_m, self.t)

    @property
    def mode(self) -> NDArray[np.int64] | None:
        """The state of the drive, shape (n,): its number in `run.events.MODES`. None where the
        drive has no [supervision]."""
        if self.events is None:
            return None
        entered = np.array([MODES.index(event.mode) for event in self.events])
        at = np.searchsorted([event.t for event in self.events], self.t, side="right") - 1
        return np.asarray(entered[at], np.int64)

    def columns(self) -> dict[str, FloatArray]:
        """The waveforms under their border names, each of shape (n,)."""
        table = {
            "t_s": self.t,
            "theta_m_deg": from_si(self.theta_m, "deg"),
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
        if (mode := self.mode) is not None:
            table["mode"] = mode.astype(float)
        if self.estimate is not None:
            table |= self.estimate.columns()
        if self.drive.load.pump is not None:
            table["Q_m3ph"] = from_si(self.Q, "m3ph")
        return table
