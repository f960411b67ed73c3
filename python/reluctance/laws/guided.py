"""What the predictive laws share: the guide; and those that follow its flux, one free number."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import Field, field_validator

from reluctance import limit
from reluctance.drive.control import Control
from reluctance.laws.flux_guide import FluxGuide

if TYPE_CHECKING:
    from reluctance.drive import Drive

LEVELS = 19  # torques in a guide, zero included
CURRENT_POINTS = 180  # angles of a current guide, over one electrical period
FLUX_POINTS = 360  # of a flux guide: the volt-seconds of a sample are its differences


class Guided(Control):
    """A predictive law that follows least-copper profiles without ripple."""

    # One or several speeds; by default the speed of the reference.
    guide_speed_rpm: list[Annotated[float, Field(ge=0)]] | None = Field(None, min_length=1)

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

    def tables(self, drive: Drive, n_points: int = CURRENT_POINTS) -> list[limit.Table]:
        """Profiles over torque and angle, a table for each speed of the guide.

        Parameters
        ----------
        drive : Drive
        n_points : int
            Angles of an electrical period, a multiple of the phase count.

        Raises
        ------
        ParameterError
            If a speed or the drive's numbers are out of range.
        RuntimeError
            If no profile is found.
        """
        speeds = self.guide_speed_rpm
        omega = [drive.omega_nominal] if speeds is None else [rpm * np.pi / 30 for rpm in speeds]
        return [
            limit.profile_table(
                drive.control_machine.magnetics,
                n_phases=drive.control_machine.n_phases,
                R=drive.control_machine.R,
                tau_max=drive.tau_max,
                omega_m=omega_m,
                u_dc=drive.converter.u_dc_V,
                i_max=drive.control_machine.i_max_A,
                n_levels=LEVELS,
                n_points=n_points,
            )
            for omega_m in omega
        ]


class FluxGuided(Guided):
    """A predictive law that follows the flux of the least-copper profile. Every weight is made of
    the wanted switching frequency, the machine and the dc-link voltage (docs/control/best_mpc.md).
    """

    f_switch_kHz: float = Field(16.0, gt=0, le=1e4)  # wanted, per switch, at the lowest guide speed

    @property
    def f_switch(self) -> float:
        """Wanted turn-ons per switch and second [Hz]."""
        return self.f_switch_kHz * 1e3

    def flux_guide(self, drive: Drive) -> FluxGuide:
        """The guide at the greatest torque reference."""
        asked = drive.reference.course[1] if drive.reference.kind == "torque" else []
        return FluxGuide(
            tables=tuple(self.tables(drive, FLUX_POINTS)),
            machine=drive.control_machine.magnetics,
            R=drive.control_machine.R,
            i_max=drive.control_machine.i_max_A,
            tau_ref=max((abs(tau) for tau in asked), default=0.0) or drive.tau_max,
            f_switch=self.f_switch,
        )
