"""The tables of a drive, each checked by itself, and what follows from them together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import MISSING, InitVar, dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_type_hints

import numpy as np

import reluctance.drive.tables.speed_loop as speed_loop
from reluctance import _core
from reluctance.base.errors import ParameterError, Unsolved
from reluctance.base.schema import Section
from reluctance.base.units import from_si
from reluctance.drive.tables.control import Control
from reluctance.drive.tables.faults import Faults
from reluctance.drive.tables.known import Known
from reluctance.drive.tables.load import Load
from reluctance.drive.tables.protection import Protection
from reluctance.drive.tables.pv_control import PvControl
from reluctance.drive.tables.sections import Converter, Reference, Sensing, SimulationSettings
from reluctance.drive.tables.source import Source
from reluctance.drive.tables.supervision import Supervision
from reluctance.machine.library import machine_from, machine_table
from reluctance.machine.machine_file import MachineFile
from reluctance.machine.mismatch import Mismatch, as_known
from reluctance.machine.operating_point import OperatingPoint

if TYPE_CHECKING:
    from reluctance.machine.coupling import Coupling

OVER_VOLTAGE = 1.25  # of u_dc_V: default trip level of the dc link
BRAKE_FULL, BRAKE_NONE = 0.4, 0.8  # of the way from u_dc_V to the trip level


class ByName:
    """A machine, which may be given by its name in the library or by the path of its file."""

    def __get__(self, drive: object, kind: type | None = None) -> MachineFile:
        if drive is None:
            raise AttributeError  # no default
        found: MachineFile = vars(drive)["machine"]
        return found

    def __set__(self, drive: object, machine: MachineFile | str | Path) -> None:
        if isinstance(machine, str | Path):
            machine = machine_from(machine_table(str(machine), Path()))
        vars(drive)["machine"] = machine


@dataclass(frozen=True, repr=False, kw_only=True)
class Tables:
    """All that a run depends on: the tables of a drive file, in their order. One with a default may
    be left out there. Values carry their units in their names."""

    name: str = "drive"
    machine: ByName = ByName()
    converter: Converter
    source: Source = field(default_factory=Source)
    load: Load
    reference: Reference
    control: Control
    sensing: Sensing = field(default_factory=Sensing)
    simulation: SimulationSettings = field(default_factory=SimulationSettings)
    protection: Protection = field(default_factory=Protection)
    mismatch: Mismatch = field(default_factory=Mismatch)
    pv_control: PvControl = field(default_factory=PvControl)
    supervision: Supervision = field(default_factory=Supervision)
    faults: Faults = field(default_factory=Faults)
    check_torque: InitVar[bool] = True

    def __post_init__(self, check_torque: bool) -> None:
        """A drive is checked here."""

    def __repr__(self) -> str:
        return (
            f"{type(self).__name__}({self.name}: {self.control.law} on {self.machine.name}, "
            f"{self.converter.u_dc_V:g} V, reference {self.reference.kind}, load {self.load.kind})"
        )

    def tables(self) -> dict[str, dict[str, Any]]:
        """The tables of a drive file that gives this drive."""
        return {name: section.given for name, section in self.sections().items()}

    def sections(self) -> dict[str, Section]:
        """The checked tables by their names in a drive file."""
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name != "name"}

    def check_sound(self, what: str) -> None:
        """Raises ParameterError where the drive has faults, which `what` does not know."""
        if self.faults.each:
            raise ParameterError(f"[[faults]] has no form in {what}; remove it")

    def known(self) -> Known:
        """What the controller may know of all this when it is set up."""
        asked = self.reference.course[1] if self.reference.kind == "torque" else []
        return Known(
            machine=as_known(self.machine, self.mismatch),
            u_dc=self.converter.u_dc_V,
            omega_m=self.omega_nominal,
            J=self.J,
            reference=self.reference.kind,
            tau_max=self.tau_max,
            tau_working=max((abs(tau) for tau in asked), default=0.0) or self.tau_max,
            motors=self._all_of_sign(asked, 1),
            brakes=self._all_of_sign(asked, -1),
            T_s=self.control.T_s,
            delay=self.sensing.delay_samples,
            t_dead=self.converter.t_dead,
            angle_step=self.sensing.angle_step(self.machine.n_phases, self.machine.N_r),
            tracker_bandwidth=self.sensing.tracker_bandwidth,
            edges=_core.EdgeLimits(
                t_min=self.converter.t_min, t_blank=self.sensing.t_blank, T_s=self.control.T_s
            ),
            i_step=self.sensing.i_step,
            i_noise=self.sensing.i_noise,
            v_switch=self.converter.v_switch_V,
            v_diode=self.converter.v_diode_V,
        )

    def frame(self, known: Known) -> _core.Frame:
        """What stands around every law of such a drive."""
        K_p, K_i = self.control.gains(known)
        observed = known.reference == "speed" and K_i is None
        u_full, u_none = self.u_brake
        pv = {"pv": self._pv_control()} if known.reference == "pv" else {}
        return _core.Frame(
            outer=getattr(_core.Outer, known.reference),
            speed=_core.SpeedPi(
                K_p=K_p,
                K_i=K_i or 0.0,
                tau_min=-known.tau_max,
                tau_max=known.tau_max,
                T_s=known.T_s,
            ),
            ramp=speed_loop.ramp(known, rate=self.control.speed_rate, torque_limited=observed),
            load=_core.LoadTorque.observer if observed else _core.LoadTorque.integral,
            motion=_core.Motion.tracked if known.angle_step > 0 else _core.Motion.measured,
            tracker=speed_loop.observer(known).core(known),
            delay=known.delay,
            comparators=getattr(_core.Comparators, self.sensing.comparators),
            t_dead=known.t_dead,
            edges=known.edges,
            u_brake_full=u_full,
            u_brake_none=u_none,
            limits=self.control.limits,
            **pv,
        )

    def _all_of_sign(self, asked: Sequence[float], sign: int) -> bool:
        """Every torque of a reference motors, 1, or brakes, -1, at a speed that is held."""
        if self.load.kind != "locked":
            return False
        powers = [sign * tau * omega for tau in asked for omega in self.load.omega[1]]
        return max(powers, default=0.0) > 0 and min(powers) >= 0

    @property
    def u_brake(self) -> tuple[float, float]:
        """Dc-link voltages up to which the whole braking torque is given, and from which none [V]:
        between the nominal voltage and the one at which the protection trips."""
        u_dc = self.converter.u_dc_V
        u_max = self.protection.u_dc_max_V or OVER_VOLTAGE * u_dc
        room = max(u_max - u_dc, 0.0)
        return u_dc + BRAKE_FULL * room, u_dc + BRAKE_NONE * room

    def _pv_control(self) -> _core.PvControl:
        return self.pv_control.core(
            u_dc=self.converter.u_dc_V,
            C=self.source.si["C"] or 0.0,
            tau_max=self.tau_max,
            omega_most=self.omega_nominal,
            strokes=self.machine.n_phases * self.machine.N_r,
            T_s=self.control.T_s,
            delay=self.sensing.delay_samples,
        )

    def controller(self, known: Known | None = None) -> _core.Controller:
        """The control law with all that stands around it and its state, ready to be sampled.
        known: in the place of what the drive file lets it know."""
        known = known or self.known()
        return _core.Controller(self.law(known), self.frame(known), self.pairs(known))

    def law(self, known: Known) -> _core.Law:
        """The control law.

        Raises
        ------
        ParameterError
            If it cannot be set up: what the numerics do not find ends here.
        """
        pairs = self._believed_pairs(known) if self.control.knows_pairs else None
        try:
            return self.control.core(replace(known, pairs=pairs))
        except Unsolved as fault:
            raise ParameterError(
                f"[control] law = {self.control.law!r} cannot be set up for {known.tau_max:g} N m "
                f"at {from_si(known.omega_m, 'rpm'):.5g} rpm and {known.u_dc:g} V: {fault}"
            ) from fault

    def unused(self, *, tau: float, omega_m: float, u_dc: float) -> str:
        """What of [control] does not act at an operating point [N m, rad/s, V], since the law
        follows the profile of the limit there, and why; empty where all does."""
        known = self.known()
        pairs = self._believed_pairs(known) if self.control.knows_pairs else None
        known = replace(known, pairs=pairs)
        return self.control.unused(known, tau=tau, omega_m=omega_m, u_dc=u_dc)

    def pairs(self, known: Known) -> _core.Coupling | None:
        """The pairs of phases whose torque the frame takes off what it asks of the law; None where
        it does not."""
        pairs = self._believed_pairs(known)
        return None if pairs is None or self.control.knows_pairs else pairs.core

    @property
    def pairs_known(self) -> bool:
        """True where phases couple and the controller knows the pairs."""
        return self._believed_pairs(self.known()) is not None

    def _believed_pairs(self, known: Known) -> Coupling | None:
        """Those that the controller knows."""
        pairs = known.machine.coupling if self.control.pair_torque else None
        return None if pairs is None or pairs.factor == 0 else pairs

    def at(self, omega_m: float) -> OperatingPoint:
        """The plant at a speed [rad/s]: its machine as it is, not as the control believes."""
        alone = self.machine.at(u_dc=self.converter.u_dc_V, omega_m=omega_m)
        return replace(alone, coupling=self.machine.coupling)

    @property
    def J(self) -> float:
        """Inertia of rotor and load [kg m^2]."""
        return self.machine.J_kgm2 + self.load.J_kgm2

    @property
    def tau_max(self) -> float:
        """Largest torque that the controller may ask for [N m]."""
        if self.control.tau_max_Nm is not None:
            return self.control.tau_max_Nm
        return float(np.max(np.abs(self.reference.course[1])))

    @property
    def omega_asked(self) -> float:
        """The speed that the drive works at: held, or the greatest asked for [rad/s]."""
        asked = self.reference.kind in ("speed", "pv")
        speeds = self.reference.course if asked else self.load.omega
        return float(max(speeds[1], key=abs))

    @property
    def omega_nominal(self) -> float:
        """The same without its sign [rad/s]."""
        return abs(self.omega_asked)


TABLES: dict[str, type[Section]] = {  # but [machine] and [control], of which there are several
    name: kind
    for name, kind in get_type_hints(Tables).items()
    if isinstance(kind, type) and issubclass(kind, Section) and kind is not Control
}
OPTIONAL = {f.name for f in fields(Tables) if f.default_factory is not MISSING}
