"""Laws with a guide; and the predictive ones that follow its flux, with one free number."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator

from reluctance.base.units import to_si
from reluctance.drive.laws.flux_guide import TORQUE_ERROR, FluxGuide
from reluctance.drive.tables.control import Control
from reluctance.drive.tables.known import Known

if TYPE_CHECKING:
    from reluctance.machine import optimum

CURRENT_POINTS = 180  # angles of a current guide, over one electrical period
# Greatest torque of the guide over the greatest reference, where feedback holds the mean [1]:
# 1 + held_part of the laws.
ROOM = 1.1
# The same where more can be lacking than those laws add: sampled currents fall short of their
# profile, or a machine has less flux than a law that learns believes. On a drawn machine with 43
# samples a period at three times base speed (random_2026 of studies/quadrants.py) 1.1 leaves 3 % of
# the mean open [1].
MORE_TORQUE = 1.4
# A drawn machine at three times base speed then takes 0.30 of the current without ripple at 3.9 %
# rms; at 30 0.27 at 7.7 %, at 300 0.33 at 1.9 % (docs/control/ripple_weight.csv) [1].
RIPPLE_WEIGHT = 100.0
FLUX_POINTS = 360  # of a flux guide: the volt-seconds of a sample are its differences

Made = TypeVar("Made")


# The profiles of motoring serve for braking without ripple at the working torque, and up to this
# rms current relative to the profiles of braking [1].
MORE_CURRENT = 1.15
# A machine with more flux than believed has, in the units of a law that learns, less voltage: as at
# a higher speed, by this factor [1].
MORE_FLUX = 1.2


def with_room(known: Known, made: Callable[[Known], Made], room: float = ROOM) -> Made:
    """What is made for torques up to room times the greatest reference, or up to that reference
    where no profile is found above it."""
    try:
        return made(replace(known, tau_max=room * known.tau_max))
    except RuntimeError:
        return made(known)


class Guided(Control):
    """A law that follows least-copper profiles without ripple."""

    guide_levels: ClassVar[int] = 19  # torques in a guide, zero included

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
        Unsolved
            If no profile is found.
        """
        if not known.brakes:
            return self.made(known, 1, n_points)
        brakes = self.made(known, -1, n_points)
        try:
            motors = self.made(known, 1, n_points)
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

    def room(self, known: Known, least: float = ROOM) -> float:
        """The greatest torque of the guide over the greatest reference, `least` or more [1]. Where
        phases couple, a level of the guide lies at the greatest reference, since those above it
        often have ripple, which a torque between two levels would share."""
        if known.pairs is None:
            return least
        last = self.guide_levels - 1
        return float((last / int(last / least**0.5)) ** 2)

    def made(self, known: Known, sense: int, n_points: int) -> list[optimum.Table]:
        """Profiles of motoring, 1, or of braking, -1, for each speed of the guide."""
        from reluctance.machine import optimum  # a tenth of the start-up time

        return [
            optimum.profile_table(
                known.at(sense * omega_m),
                known.tau_max,
                n_levels=self.guide_levels,
                n_points=n_points,
                ripple_weight=self.ripple_weight,
            )
            for omega_m in self.guide_speeds(known)
        ]

    def guide_speeds(self, known: Known) -> list[float]:
        """Speeds of the guide, rising [rad/s]."""
        if self.guide_speed_rpm is not None:
            return [to_si(rpm, "rpm") for rpm in self.guide_speed_rpm]
        if self.learns and known.omega_m > 0:
            return [known.omega_m, MORE_FLUX * known.omega_m]
        return [known.omega_m]


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
            pairs=known.pairs,
        )
