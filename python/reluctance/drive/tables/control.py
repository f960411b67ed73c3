"""What every control law has in its [control] table."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field

import reluctance.drive.tables.speed_loop as speed_loop
from reluctance import _core
from reluctance.base.errors import Note, ParameterError
from reluctance.base.schema import Section
from reluctance.base.units import to_si
from reluctance.drive.tables.known import Known
from reluctance.drive.tables.variants import Look, Variant
from reluctance.machine.models import Magnetics

BAND_PART = 0.02  # of the current limit: default half width of a current band
NO_LIMIT = 1e30  # of torque or current
IN_MS = 0.001, 0.1  # control periods of 1 to 100 us, as milliseconds
NEVER_REACHED = 1e6  # a current reference that leaves the pulse to the voltage; no waveform [A]


class Control(Section):
    """What every law has: its control period, precision and speed loop."""

    called = "control"

    variants: ClassVar[tuple[Variant, ...]] = ()  # in a comparison
    look: ClassVar[Look] = Look("own", "#F0E442", "-.")  # of a law from outside the package
    title: ClassVar[str] = ""  # of the studio
    # Whether the law itself computes with pairs of phases; for others the frame takes their torque
    # off what it asks for.
    knows_pairs: ClassVar[bool] = False
    band_part: ClassVar[float] = BAND_PART

    law: str = ""  # its name, or the file of one's own
    T_s_us: float = Field(gt=0)
    precision: Literal["double", "float"] = "double"  # float is what the target computes in
    tau_max_Nm: float | None = Field(None, gt=0)  # limit of the speed loop, top of the tables
    K_p_Nms: float | None = Field(None, ge=0)  # speed loop: given, by speed_bandwidth_Hz, by rule
    K_i_Nm: float | None = Field(None, ge=0)  # in place of the load torque observer
    speed_bandwidth_Hz: float | None = Field(None, gt=0)
    speed_rate_rpmps: float | None = Field(None, gt=0)  # greatest, of the speed reference
    torque_limit_Nm: float | None = Field(None, ge=0)  # below what the law is built for
    current_limit_A: float | None = Field(None, gt=0)  # likewise, in the frame (user_limits.hpp)
    pair_torque: bool = True  # whether what pairs of phases add is known to the controller

    def model_post_init(self, context: Any) -> None:
        """A table made in Python need not repeat the name of its law: it counts as given."""
        self.model_fields_set.add("law")
        if IN_MS[0] <= self.T_s_us <= IN_MS[1]:
            told = (
                f"[control] T_s_us = {self.T_s_us:g}: no controller steps every "
                f"{1e3 * self.T_s_us:g} ns; if these are milliseconds, set {1e3 * self.T_s_us:g}"
            )
            warnings.warn(told, Note, stacklevel=2)

    @property
    def T_s(self) -> float:
        """Control period [s]."""
        return self.T_s_us * 1e-6

    @property
    def follows_torque(self) -> bool:
        """False where the table fixes the current, and no torque can be asked for."""
        return True

    @property
    def learns(self) -> bool:
        """True where the controller learns the machine that it drives."""
        return False

    @property
    def headers(self) -> Mapping[str, str]:
        """Headers from outside the package that the law is written in: name to text."""
        return {}

    @property
    def current_band(self) -> float | None:
        """Half width of the band that comparators keep a current in, where it is given [A]."""
        return None

    def band(self, known: Known) -> float:
        """The half width itself, by default a part of the current limit [A]."""
        return self.band_part * known.i_max if self.current_band is None else self.current_band

    @property
    def uses_comparators(self) -> bool:
        """True where comparators may switch the legs between samples."""
        return False

    def by_rule(self, known: Known) -> dict[str, float]:
        """What the table leaves to a rule: keys, and what is used for them, in their units. Angles
        are those for the greatest torque at the working speed."""
        used = self.used(known)
        return {key: value for key, value in used.items() if getattr(self, key) is None}

    def used(self, known: Known) -> dict[str, float]:
        """Keys that may be left to a rule, and what is used for them, given or not."""
        found = {"tau_max_Nm": known.tau_max} if self.follows_torque else {}
        if known.reference in ("speed", "pv"):
            K_p, K_i = self.gains(known)
            found |= {"K_p_Nms": K_p} | ({} if K_i is None else {"K_i_Nm": K_i})
        return found

    def check(self, known: Known) -> None:
        """What the law needs of the drive besides its own table.

        Raises
        ------
        ParameterError
            If the drive does not have it.
        """
        if self.current_band is not None and self.current_band >= known.i_max:
            raise ParameterError(
                f"[control] i_band_A = {self.current_band:g}, need less than [machine] i_max_A = "
                f"{known.i_max:g}"
            )

    def core(self, known: Known) -> _core.Law:
        """The law itself."""
        raise NotImplementedError

    def unused(self, known: Known, *, tau: float, omega_m: float, u_dc: float) -> str:
        """What of the table does not act at an operating point [N m, rad/s, V], since the law
        follows the profile of the limit there, and why; empty where all does."""
        return ""

    def built_for(self, known: Known) -> tuple[Magnetics, int, bool]:
        """What the core needs of every law: machine as believed, phases, single precision."""
        return known.magnetics, known.n_phases, self.precision == "float"

    def maker(
        self, known: Known, alone: Callable[..., _core.Law], coupled: Callable[..., _core.Law]
    ) -> Callable[..., _core.Law]:
        """What makes the law of its own parameters: alone, or coupled where it computes with pairs
        of phases."""
        if known.pairs is None:
            return partial(alone, *self.built_for(known))
        return partial(coupled, *self.built_for(known), pairs=known.pairs.core)

    def gains(self, known: Known) -> tuple[float, float | None]:
        """Of the speed loop [N m s/rad, N m/rad]; no integral one: the load torque is observed. A
        given bandwidth sets the proportional gain on inertia alone; the integral one acts half as
        fast."""
        given = self.speed_bandwidth_Hz
        if given is None and known.reference == "pv":
            given = speed_loop.PV_BANDWIDTH_Hz
        if given is None:
            K_p = speed_loop.proportional_gain(known) if known.reference == "speed" else 0.0
            return (K_p if self.K_p_Nms is None else self.K_p_Nms), self.K_i_Nm
        bandwidth = 2 * np.pi * given
        K_p = bandwidth * known.J if self.K_p_Nms is None else self.K_p_Nms
        return K_p, K_p * bandwidth / 2 if self.K_i_Nm is None else self.K_i_Nm

    @property
    def limits(self) -> _core.UserLimits:
        """Of torque and current, below what the law is built for."""
        return _core.UserLimits(
            tau=NO_LIMIT if self.torque_limit_Nm is None else self.torque_limit_Nm,
            i=NO_LIMIT if self.current_limit_A is None else self.current_limit_A,
        )

    @property
    def speed_rate(self) -> float | None:
        """Greatest rate of the speed reference; None where there is none [rad/s^2]."""
        given = self.speed_rate_rpmps
        return None if given is None else to_si(given, "rpmps")
