"""What a controller may know when it is set up. A law is built from this and its own table."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal

from reluctance import _core
from reluctance.machine.machine_file import MachineFile
from reluctance.machine.models import Magnetics
from reluctance.machine.operating_point import OperatingPoint

if TYPE_CHECKING:
    from reluctance.machine.coupling import Coupling


@dataclass(frozen=True)
class Known:
    """The drive as its controller believes it to be: nominal values, in SI."""

    machine: MachineFile  # as believed: its flux linkage and resistance may be wrong
    u_dc: float  # nominal dc-link voltage [V]
    omega_m: float  # the speed that the drive works at, >= 0 [rad/s]
    J: float  # inertia of rotor and load [kg m^2]
    reference: Literal["torque", "speed", "none", "pv"]  # what the drive is asked for
    tau_max: float  # greatest torque that may be asked for [N m]
    tau_working: float  # greatest torque reference; tau_max where a speed loop asks [N m]
    motors: bool  # every torque reference motors, at a speed that is held
    brakes: bool  # every one brakes, likewise
    T_s: float  # control period [s]
    delay: int  # samples from the measurement to the order
    t_dead: float  # from the order to turn on until a switch is on [s]
    angle_step: float  # of the angle sensor, mechanical; 0 of an ideal one [rad]
    tracker_bandwidth: float | None  # of the observer, where the drive file gives it [rad/s]
    edges: _core.EdgeLimits = field(compare=False)  # no table of currents depends on them
    i_step: float  # of the current converter; 0 of an ideal one [A]
    i_noise: float  # of the currents, rms [A]
    v_switch: float  # threshold voltages of a switch and of a diode [V]
    v_diode: float
    pairs: Coupling | None = None  # of phases, where the law itself computes with them

    @property
    def magnetics(self) -> Magnetics:
        """The machine model of the core."""
        return self.machine.magnetics

    @property
    def n_phases(self) -> int:
        return self.machine.n_phases

    @property
    def N_r(self) -> int:
        """Rotor poles."""
        return self.machine.N_r

    @property
    def R(self) -> float:
        """Phase resistance [ohm]."""
        return self.machine.R

    @property
    def i_max(self) -> float:
        """Current limit [A]."""
        return self.machine.i_max_A

    def at(self, omega_m: float) -> OperatingPoint:
        """This machine and voltage at a speed [rad/s], with the mean of the pairs."""
        alone = self.machine.at(u_dc=self.u_dc, omega_m=omega_m)
        return alone if self.pairs is None else replace(alone, coupling=self.pairs.mean)
