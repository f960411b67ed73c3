"""The limit at a drive's operating point: what the machine could do there under any controller."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from reluctance.base.arrays import FloatArray
from reluctance.base.errors import Note
from reluctance.base.units import from_si
from reluctance.drive.drive import Drive, check_drive
from reluctance.drive.plausible import corner_speed
from reluctance.explore.limits.point import check_point, operating_point
from reluctance.machine.optimum.envelope import Envelope, torque_speed_envelope
from reluctance.machine.optimum.profile import Profile, best_profile
from reluctance.machine.optimum.programme import FEASIBLE
from reluctance.machine.optimum.ripple import RippleFloor, ripple_floor
from reluctance.machine.optimum.torque_step import TorqueStep, fastest_torque_step

POINTS_PER_PHASE = 60  # grid points of a period for each phase
FLOOR_SMOOTHING = 1e-3  # of the profile whose voltages the ripple floor needs [rad^2]
GRID_MATTERS = 0.02  # of the greatest ripple-free torque, by twice the points
SPEEDS = 13  # points of an envelope, standstill included


@dataclass(frozen=True, repr=False)
class Limit:
    """The best profile at a drive's operating point, and what bounds it."""

    drive: Drive
    least_copper: Profile  # least greatest torque error, then least copper
    tau_max: float  # greatest ripple-free torque at this speed, of the reference's sign [N m]
    floor: RippleFloor | None  # at the switching frequency asked for
    step: (
        TorqueStep | None
    )  # from no current to the torque; None where it is zero, or phases couple

    def __repr__(self) -> str:
        best = self.least_copper
        return (
            f"Limit({self.drive.name}: {best.tau_ref:g} N m at {from_si(best.omega_m, 'rpm'):.5g} "
            f"rpm, {best.i_rms:.4g} A rms, at most {self.tau_max:.4g} N m without ripple)"
        )

    @property
    def ripple_free(self) -> bool:
        """True where the profile holds the torque at every grid point."""
        best = self.least_copper
        return best.tau_error_max <= 10 * FEASIBLE * max(abs(best.tau_ref), 1e-9)

    def with_units(self) -> dict[str, float | bool | None]:
        """Key figures under their border names."""
        best, floor = self.least_copper, self.floor
        figures: dict[str, float | bool | None] = {
            "speed_rpm": from_si(best.omega_m, "rpm"),
            "tau_ref_Nm": best.tau_ref,
            "u_dc_V": best.u_dc,
            "i_max_A": self.drive.machine.i_max_A,
            "ripple_free": self.ripple_free,
            "tau_error_max_Nm": best.tau_error_max,
            "tau_error_rms_Nm": best.tau_error_rms,
            "i_rms_A": best.i_rms,
            "i_peak_A": best.i_peak,
            "p_cu_W": best.p_cu,
            "tau_max_ripple_free_Nm": self.tau_max,
        }
        if self.step is not None:
            figures |= {
                "torque_step_mean_ms": _known_ms(self.step.mean),
                "torque_step_longest_ms": _known_ms(self.step.longest),
            }
        if floor is not None:
            figures |= {
                "switching_frequency_Hz": floor.switching_frequency,
                "ripple_bound_rms_Nm": floor.bound_rms,
                "ripple_bound_pp_Nm": floor.bound_pp,
                "ripple_returning_flux_rms_Nm": floor.returning_rms,
                "ripple_on_profile_rms_Nm": floor.on_profile_rms,
                "ripple_pulse_width_rms_Nm": floor.pulse_width_rms,
            }
        return figures


def _known_ms(time: float) -> float | None:
    """None where it is infinite: longer than was looked at."""
    return time * 1e3 if np.isfinite(time) else None


def limit(
    drive: Drive,
    *,
    tau_ref: float | None = None,
    omega_m: float | None = None,
    switching_frequency: float | None = None,
) -> Limit:
    """The limit at the operating point of a drive.

    Parameters
    ----------
    drive : Drive
    tau_ref : torque [N m]; by default see `operating_point`.
    omega_m : speed [rad/s]; likewise.
    switching_frequency : of one switch, mean over all [Hz]; None leaves the ripple floor out.

    Raises
    ------
    ParameterError : the drive asks for no torque and none is given, or what is asked cannot be
        meant; see `check_point`.

    Notes
    -----
    A Note tells where twice the grid points give another greatest ripple-free torque.
    """
    check_drive(drive, "limit")
    tau_ref, omega_m = operating_point(drive, tau_ref=tau_ref, omega_m=omega_m)
    check_point(drive, tau_ref=tau_ref, omega_m=omega_m, switching_frequency=switching_frequency)
    tau_max, finer = (
        float(_envelope(drive, np.array([omega_m]), tau_ref, finer=n).tau_max[0]) for n in (1, 2)
    )
    if abs(finer - tau_max) > GRID_MATTERS * abs(tau_max):
        warnings.warn(
            f"the greatest ripple-free torque depends on the grid: {tau_max:.4g} N m at "
            f"{_points(drive)} angles, {finer:.4g} N m at {2 * _points(drive)}; the flux map has a "
            "kink over the angle, or the speed leaves little torque: take neither as exact",
            Note,
            stacklevel=2,
        )
    F = switching_frequency
    return Limit(
        drive=drive,
        least_copper=best_profile(drive.at(omega_m), tau_ref, n_points=_points(drive)),
        tau_max=tau_max,
        floor=None
        if F is None
        else floor_of(drive, tau_ref=tau_ref, omega_m=omega_m, switching_frequency=F),
        step=None
        if tau_ref == 0 or drive.machine.coupled
        else step_of(drive, tau_ref=tau_ref, omega_m=omega_m),
    )


def step_of(
    drive: Drive, *, tau_ref: float, omega_m: float, start: Profile | None = None
) -> TorqueStep:
    """The least time of a torque step to tau_ref [N m] at a speed [rad/s], from the currents of a
    profile; by default from none. Phases that couple have none that is proven."""
    return fastest_torque_step(drive.at(omega_m), tau_ref, start=start)


def floor_of(
    drive: Drive, *, tau_ref: float, omega_m: float, switching_frequency: float
) -> RippleFloor:
    """The least ripple at a mean switching frequency [Hz], torque [N m] and speed [rad/s]."""
    point = drive.at(omega_m)
    smooth = best_profile(
        point, tau_ref, n_points=_points(drive), norm="rms", smoothing=FLOOR_SMOOTHING
    )
    return ripple_floor(point, smooth, switching_frequency=switching_frequency)


def envelope_of(
    limit: Limit,
    *,
    omega_max: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> Envelope:
    """The ripple-free torque-speed envelope around an operating point.

    Parameters
    ----------
    limit : Limit
    omega_max : greatest speed [rad/s]; by default twice the operating speed, at standstill twice
        the speed at which the full flux of i_max takes u_dc over half a period.
    progress : is told the share done [1].
    """
    best = limit.least_copper
    if omega_max is None:
        omega_max = 2 * best.omega_m or 2 * corner_speed(
            limit.drive.machine, limit.drive.converter.u_dc_V
        )
    speeds = np.linspace(0.0, omega_max, SPEEDS)
    return _envelope(limit.drive, speeds, best.tau_ref, progress)


def _envelope(
    drive: Drive,
    speeds: FloatArray,
    tau_ref: float,
    progress: Callable[[float], None] | None = None,
    *,
    finer: int = 1,
) -> Envelope:
    return torque_speed_envelope(
        drive.at(0.0),
        speeds,
        n_points=finer * _points(drive),
        direction=-1 if tau_ref < 0 else 1,
        progress=progress,
    )


def _points(drive: Drive) -> int:
    return POINTS_PER_PHASE * drive.machine.n_phases
