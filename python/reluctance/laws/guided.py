"""What the predictive laws share: the guide; and those that follow its flux, one free number."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator

from reluctance.laws.flux_guide import TORQUE_ERROR, FluxGuide
from reluctance.tables.control import Control
from reluctance.tables.known import Known
from reluctance.units import to_si

if TYPE_CHECKING:
    from reluctance import optimum

LEVELS = 19  # torques in a guide, zero included
CURRENT_POINTS = 180  # angles of a current guide, over one electrical period
# Greatest torque of the guide over the greatest reference, where feedback holds the mean [1]:
# 1 + held_part of the laws.
ROOM = 1.1
# A drawn machine at three times base speed then takes 0.30 of the current without ripple at 3.9 %
# rms; at 30 0.27 at 7.7 %, at 300 0.33 at 1.9 % (docs/control/ripple_weight.csv) [1].
RIPPLE_WEIGHT = 100.0
FLUX_POINTS = 360  # of a flux guide: the volt-seconds of a sample are its differences


# The profiles of motoring serve for braking without ripple at the working torque, and up to this
# rms current relative to the profiles of braking [1].
MORE_CURRENT = 1.15


class Guided(Control):
    """A predictive law that follows least-copper profiles without ripple."""

    # One or several speeds; by default the speed of the reference.
    guide_speed_rpm: list[Annotated[float, Field(ge=0)]] | None = Field(None, min_length=1)
    # Where torque without ripple takes a current that never ends: what (rms ripple/torque)^2 counts
    # against the logarithm of the mean squared current (optimum/programme.py).
    ripple_weight: float = Field(RIPPLE_WEIGHT, gt=0)

    @field_validator("guide_speed_rpm", mode="before")
    @classmethod
    def one_speed_is_a_list_of_one(cls, value: object) -> object:
        return [value] if isinstance(value, int | float) else value

    @field_validator("guide_speed_rpm")
    @classmethod
    def speeds_rise(cls, speeds: list[float] | None) -> list[float] | None:
        if any(b <= a for a, b in pairwise(speeds or [])):
            raise ValueError(f"guide_speed_rpm = {speeds}, need rising speeds")
        return speeds

    def tables(self, known: Known, n_points: int = CURRENT_POINTS) -> list[optimum.Table]:
        """Profiles over torque and angle, a table for each speed of the guide.

        They are for positive torque, the frame in which the laws work. The profiles of motoring
        serve for braking too. Where every reference brakes, and these cannot hold the working
        torque or take much more current than the profiles of braking, it is those.

        Parameters
        ----------
        known : Known
        n_points : int
            Angles of an electrical period, a multiple of the phase count.

        Raises
        ------
        ParameterError
            If a speed or the drive's numbers are out of range.
        RuntimeError
            If no profile is found.
        """
        from reluctance import optimum  # a tenth of the start-up time

        def made(sense: int) -> list[optimum.Table]:
            return [
                optimum.profile_table(
                    known.at(sense * omega_m),
                    known.tau_max,
                    n_levels=LEVELS,
                    n_points=n_points,
                    ripple_weight=self.ripple_weight,
                )
                for omega_m in self.guide_speeds(known)
            ]

        if not known.brakes:
            return made(1)
        brakes = made(-1)
        try:
            motors = made(1)
        except RuntimeError:
            return brakes

        def level(table: optimum.Table, of: NDArray[np.float64]) -> float:
            return float(np.interp(known.tau_working, table.tau_ref, of))

        serve = all(
            level(m, m.tau_error_rms) <= TORQUE_ERROR * known.tau_working
            and level(m, m.i_rms) <= MORE_CURRENT * level(b, b.i_rms)
            for m, b in zip(motors, brakes, strict=True)
        )
        return motors if serve else brakes

    def guide_speeds(self, known: Known) -> list[float]:
        """Speeds of the guide, rising [rad/s]."""
        speeds = self.guide_speed_rpm
        return [known.omega_m] if speeds is None else [to_si(rpm, "rpm") for rpm in speeds]


class FluxGuided(Guided):
    """A predictive law that follows the flux of the least-copper profile. Every weight is made of
    the wanted switching frequency, the machine and the dc-link voltage (docs/control/best_mpc.md).
    """

    f_switch_kHz: float = Field(16.0, gt=0, le=1e4)  # wanted, per switch, at the lowest guide speed

    @property
    def f_switch(self) -> float:
        """Wanted turn-ons per switch per second [Hz]."""
        return self.f_switch_kHz * 1e3

    def flux_guide(self, known: Known) -> FluxGuide:
        """The guide at the greatest torque reference."""
        return FluxGuide(
            tables=tuple(self.tables(known, FLUX_POINTS)),
            point=known.at(known.omega_m),
            tau_ref=known.tau_working,
            f_switch=self.f_switch,
        )
