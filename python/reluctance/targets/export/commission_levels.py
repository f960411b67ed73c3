"""Currents, voltages and times of the commissioning routines (control/commission), from a drive.

The machine of the drive file is what is believed before anything was measured: its inductances only
say how fast a current may rise, and may be wrong by a factor of two.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reluctance import _core
from reluctance.drive.drive import Drive
from reluctance.drive.guard.trip_levels import current_error, protection

DETECT = 0.05  # of i_max: a current that is one
ABOVE_ERROR = 4.0  # of the greatest error of a reading: a third of it must be above the error too
HOLD = 0.4  # of i_max: holds a rotor aligned
LOW = 0.3  # of the holding current, while the rotor swings back: the least
FALL = 0.125  # of a quarter of the swing: the most that the current may take to fall to that
R_CURRENTS = (0.1, 0.3)  # of i_max: the two of the resistance
STEP = 0.05  # of i_max: the most that a pulse may add in a sample
REACH = 1.5  # of R i_max: the least mean voltage of a pulse
BESIDE = 0.85  # of it beside a held phase: tables of pairs end at i_max, and a pulse passes its top
END = 0.02  # of the top current: a pulse has ended
PI_GAIN = 0.25  # of the least inductance over the period: stable with a sample of delay
PI_ZERO = 0.25  # of the slowest bandwidth
DUTY_MAX = 0.5  # of a held current
HELD = 0.36  # of the current that this duty drives through R: a swinging rotor needs the rest [1]
SLACK_STEPS = 1.25  # of the encoder: noise of a standing rotor is one
SLACK_DEG = 0.3  # electrical; with an ideal sensor
REST_TIME, WAIT_TIME = 0.5, 10.0  # at rest; longest wait for it [s]
SETTLE_TIME, MEAN_TIME = 0.3, 0.5  # of the resistance [s]
BEFORE = 32  # samples at rest before a pulse: their mean is the offset of the sensor
LONGEST_PULSE = 10.0  # of the time that the flux linkage takes without resistance
MOST_TIME = 300.0  # of a routine [s]


@dataclass(frozen=True)
class Levels:
    """What the routines are set to, SI units; change one with `dataclasses.replace`."""

    duty: float  # of pulses [1]
    i_detect: float  # a current that is one [A]
    i_hold: float  # [A]
    i_low: float  # while the rotor swings back [A]
    i_1: float  # of the resistance [A]
    i_2: float
    i_top: float  # of the pulses [A]
    i_beside: float  # of pulses beside a held phase [A]
    slack: float  # electrical [rad]
    t_rest: float  # [s]
    t_wait: float
    t_settle: float  # of a held current
    t_mean: float
    t_pulse: float  # longest rise or fall
    t_max: float  # of a routine


def levels(drive: Drive) -> Levels:
    """The default levels of a drive."""
    machine, u_dc, T_s = drive.machine, drive.converter.u_dc_V, drive.control.T_s
    i_max = machine.i_max_A
    L_min, _, psi_max = _extremes(drive, i_max)
    i_top = min(i_max, u_dc / (REACH * machine.R))  # more does not flow
    duty = max(STEP * i_max * L_min / (u_dc * T_s), REACH * machine.R * i_top / u_dc)
    duty = min(duty, 1.0)
    most = HELD * DUTY_MAX * u_dc / machine.R
    i_hold, i_2 = min(HOLD * i_max, most), min(R_CURRENTS[1] * i_max, most)
    step = 0.0
    if drive.sensing.counted_angle:
        step = drive.sensing.angle_step(machine.n_phases, machine.N_r) * machine.N_r
    return Levels(
        duty=duty,
        i_detect=max(DETECT * i_max, ABOVE_ERROR * current_error(drive)),
        i_hold=i_hold,
        i_low=max(LOW * i_hold, _low(drive, i_hold)),
        i_1=R_CURRENTS[0] / R_CURRENTS[1] * i_2,
        i_2=i_2,
        i_top=i_top,
        i_beside=BESIDE * i_top,
        slack=max(SLACK_STEPS * step, float(np.radians(SLACK_DEG))),
        t_rest=REST_TIME,
        t_wait=WAIT_TIME,
        t_settle=SETTLE_TIME,
        t_mean=MEAN_TIME,
        t_pulse=LONGEST_PULSE * psi_max / (duty * u_dc),
        t_max=MOST_TIME,
    )


def commission(drive: Drive, at: Levels | None = None) -> _core.Commission:
    """The commissioning routines of a drive."""
    at = at or levels(drive)
    T_s, trip = drive.control.T_s, protection(drive).levels
    devices = drive.converter.si
    L_min, L_max, _ = _extremes(drive, 1.2 * max(at.i_hold, at.i_2))
    K_p = PI_GAIN * L_min / T_s
    hold = _core.CurrentHold(
        pi=_core.LimitedPi(K_p=K_p, K_iT=K_p * T_s * PI_ZERO * K_p / L_max), duty_max=DUTY_MAX
    )

    def samples(t: float) -> int:
        return int(np.ceil(t / T_s))

    return _core.Commission(
        T_s=T_s,
        t_dead=drive.converter.t_dead,
        i_trip=trip.i_trip,
        u_dc_min=trip.u_dc_min,
        u_dc_max=trip.u_dc_max,
        t_max=at.t_max,
        wiring=_core.Wiring(
            duty=at.duty, i_detect=at.i_detect, n_pulse=samples(at.t_pulse), n_rest=BEFORE
        ),
        resistance=_core.Resistance(
            hold=hold,
            i_1=at.i_1,
            i_2=at.i_2,
            n_settle=samples(at.t_settle),
            n_mean=samples(at.t_mean),
        ),
        alignment=_core.Alignment(
            hold=hold,
            i_hold=at.i_hold,
            i_low=at.i_low,
            slack=at.slack,
            n_rest=samples(at.t_rest),
            n_wait=samples(at.t_wait),
        ),
        pulses=_core.FluxPulses(
            duty=at.duty,
            i_top=at.i_top,
            i_beside=at.i_beside,
            i_end=END * at.i_top,
            slack=4 * at.slack,
            v_switch=devices["v_switch"],
            v_diode=devices["v_diode"],
            n_rest=BEFORE,
            n_pulse=samples(at.t_pulse),
            delay=drive.sensing.delay_samples,
            hold=hold,
            duty_dead=drive.converter.t_dead / T_s,
            n_settle=samples(at.t_settle),
        ),
    )


def _low(drive: Drive, i_hold: float) -> float:
    """The current that one of `i_hold` falls to in FALL of a quarter of the free swing about
    alignment [A]: a later fall would take no energy out of the swing."""
    machine = drive.machine
    away = np.linspace(0.05, 0.6, 12)  # electrical [rad]
    tau = _core.magnetics(machine.magnetics, np.full(12, i_hold), np.pi - away)[:, 2]
    stiffness = machine.N_r * float((tau / away).max())  # [N m/rad]
    if stiffness <= 0:  # flat so far around alignment: nothing swings
        return 0.0
    quarter = np.pi / 2 * np.sqrt(machine.J_kgm2 / stiffness)
    i = np.linspace(0, i_hold, 41)
    psi = _core.magnetics(machine.magnetics, i, np.full(41, np.pi))[:, 0]
    left = psi[-1] - FALL * quarter * DUTY_MAX * drive.converter.u_dc_V
    return float(np.interp(left, psi, i))


def _extremes(drive: Drive, i_max: float) -> tuple[float, float, float]:
    """Least and greatest incremental inductance up to a current [H], greatest flux linkage [Wb]."""
    i, theta_e = np.meshgrid(np.linspace(0, i_max, 41), np.linspace(0, np.pi, 31))
    found = _core.magnetics(drive.machine.magnetics, i.ravel(), theta_e.ravel())
    L = found[:, 3]
    return float(L.min()), float(L.max()), float(found[:, 0].max())
