"""Machine files: what every machine has, and what its model says of it."""

from functools import lru_cache
from math import gcd
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, model_validator

from reluctance import _core
from reluctance.base.schema import Section, checked
from reluctance.machine.copper import resistance_ratio
from reluctance.machine.loss_data import Iron
from reluctance.machine.models import Magnetics, PhaseMagnetics
from reluctance.machine.operating_point import OperatingPoint

if TYPE_CHECKING:
    from reluctance.machine.coupling import Coupling
    from reluctance.machine.maps.pole_force import PoleForce


class MachineFile(Section):
    """What every [machine] table has. Electrical angle 0 is unaligned, pi is aligned."""

    called = "machine"
    core: ClassVar[type[Any]]  # the machine model of the core
    flux_keys: ClassVar[tuple[str, ...]] = ("psi_factor",)  # what scales with the flux linkage

    name: str
    source: str  # where the numbers come from
    licence: str
    assumed: str = ""  # what the source does not give
    N_s: int = Field(gt=0)  # stator poles
    N_r: int = Field(gt=0)  # rotor poles
    n_phases: int = Field(ge=2, le=6)
    R_ohm: float = Field(ge=0)  # of one phase, at temp_R_degC
    temp_R_degC: float = Field(20.0, gt=-200, le=300)
    temp_w_degC: float = Field(20.0, gt=-200, le=300)  # winding temperature of the run
    i_max_A: float = Field(gt=0)  # current limit of the drive
    J_kgm2: float = Field(gt=0)  # rotor inertia
    B_Nms: float = Field(0.0, ge=0)  # viscous friction
    iron: Iron | None = None  # [machine.iron]: without it no iron loss is estimated
    model: str

    @model_validator(mode="after")
    def phases_follow_from_the_poles(self) -> "MachineFile":
        phases = self.N_s // gcd(self.N_s, self.N_r)
        if phases != self.n_phases:
            raise ValueError(
                f"n_phases = {self.n_phases}, but {self.N_s}/{self.N_r} poles make {phases} "
                f"phases (N_s over the greatest common divisor of N_s and N_r); "
                "set n_phases or the poles"
            )
        return self

    @property
    def R(self) -> float:
        """Phase resistance at the winding temperature [ohm]."""
        return self.R_ohm * resistance_ratio(self.temp_w_degC, self.temp_R_degC)

    @classmethod
    def from_table(cls, table: dict[str, Any], where: str) -> Self:
        """The machine of a [machine] table of this model, checked."""
        return checked(cls, table, where)

    @property
    def magnetics(self) -> Magnetics:
        """The machine model of the core."""
        raise NotImplementedError

    @staticmethod
    def symbolic(machine: Any) -> PhaseMagnetics:
        """A machine of this core model, once more: as functions that CasADi can differentiate."""
        raise NotImplementedError

    @staticmethod
    def content(machine: Any) -> list[Any]:
        """All that a machine of this core model consists of, for a cache key."""
        raise NotImplementedError

    @property
    def i_known_A(self) -> float:
        """The largest current that the magnetisation is known for; beyond it is extrapolation."""
        return np.inf

    @property
    def coupling(self) -> "Coupling | None":
        """What neighbouring phases add to each other; None where nothing is known of it."""
        return None

    @property
    def pair_tables(self) -> _core.Coupling | None:
        """`coupling` as simulation and control have it."""
        coupling = self.coupling
        return None if coupling is None else coupling.core

    @property
    def coupled(self) -> bool:
        """Whether `coupling` is known; asks for no solution of a field."""
        return False

    @property
    def pole_force(self) -> "PoleForce | None":
        """Radial force on a stator pole of one phase; None where nothing is known of it."""
        return None

    @property
    def greatest_torque(self) -> float:
        """Of all phases at i_max_A, at the best angle, each left out where it would brake [N m]."""
        return _greatest_torque(self.magnetics, self.n_phases, self.i_max_A)

    def at(self, *, u_dc: float, omega_m: float) -> OperatingPoint:
        """This machine on a dc link [V] at a speed [rad/s], each phase as if it were alone."""
        return OperatingPoint(
            magnetics=self.magnetics,
            n_phases=self.n_phases,
            R=self.R,
            i_max=self.i_max_A,
            u_dc=u_dc,
            omega_m=omega_m,
        )

    def psi(self, i: ArrayLike, theta_e: ArrayLike) -> NDArray[np.float64]:
        """Flux linkage of one phase [Wb] at currents [A] and electrical angles [rad], broadcast; it
        has the sign of the current, and the other two have none."""
        return np.copysign(self._column(0, i, theta_e), i)

    def co_energy(self, i: ArrayLike, theta_e: ArrayLike) -> NDArray[np.float64]:
        """Co-energy of one phase [J], likewise: psi and tau are its derivatives."""
        return self._column(1, i, theta_e)

    def tau(self, i: ArrayLike, theta_e: ArrayLike) -> NDArray[np.float64]:
        """Torque of one phase [N m], likewise."""
        return self._column(2, i, theta_e)

    def _column(self, column: int, i: ArrayLike, theta_e: ArrayLike) -> NDArray[np.float64]:
        """One of the columns of `_core.magnetics`."""
        i, theta_e = np.broadcast_arrays(np.asarray(i, float), np.asarray(theta_e, float))
        turned = np.mod(theta_e, 2 * np.pi)
        flat = _core.magnetics(self.magnetics, np.abs(i).ravel(), turned.ravel().copy())
        return np.asarray(flat[:, column]).reshape(i.shape)


# Thousands of drives of a sweep have the same machine: what follows from it is computed once.
@lru_cache(maxsize=64)
def _greatest_torque(magnetics: Magnetics, n_phases: int, i_max: float) -> float:
    theta_e = np.linspace(0, 2 * np.pi, 720, endpoint=False)  # whole steps for 2 to 6 phases
    tau = np.maximum(_core.magnetics(magnetics, np.full(720, i_max), theta_e)[:, 2], 0.0)
    return float(tau.reshape(n_phases, -1).sum(axis=0).max())
