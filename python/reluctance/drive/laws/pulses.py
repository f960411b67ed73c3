"""Current pulses at one speed, run by the core: mean torque and rms current of a law whose current
is fixed.

The law runs with exact sensors and orders on a shaft that is held, from zero current. Currents that
do not return to zero settle first; means are over whole electrical periods.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from reluctance import _core
from reluctance.base.arrays import FloatArray
from reluctance.base.units import from_si
from reluctance.drive.tables.known import Known
from reluctance.drive.tables.load import Load
from reluctance.drive.tables.over_time import course
from reluctance.drive.tables.sections import Converter, Sensing
from reluctance.drive.tables.source import Source
from reluctance.machine.models import Magnetics

STEPS = 72  # of the solver in a period: 360 move the mean torque by less than 1e-4
SETTLED = 1  # periods before the mean; pulses of up to half a period leave no current ...
SETTLES = 10  # ... and those of wider windows repeat themselves to 0.1 %
PERIODS = 2  # of the mean: a pulse can have one chopping fewer every second period
SAMPLES = 36  # of a law that does nothing at a sample, in a period
# A band that the voltage crosses in less than this part of a period has so many choppings that
# one more does not move the mean torque by 0.1 %. It is then made as wide as that, up to a part of
# its current whose saw teeth have a mean square 0.2 % above that of the current.
CHOPPINGS = 1000
BAND_WIDEST = 0.07
WITHIN = _core.Within(omega_m=np.inf, i=np.inf, u_dc=np.inf, steps=np.inf, judged=np.inf)


@dataclass(frozen=True)
class FixedLaw:
    """A law whose current does not follow the torque, on a drive at its working speed."""

    known: Known
    brakes: bool  # torque against the motion
    controller: Callable[[Known, _core.Conduction, float], _core.Controller]  # of a current [A]
    periods: int = PERIODS  # of the mean
    smooth: bool = True  # the mean torque is a smooth function of current and angles


@dataclass(frozen=True)
class Pulses:
    """Means over electrical periods, of the shape of the arguments."""

    tau: FloatArray  # of all phases, in the direction that is asked for [N m]
    i_rms: FloatArray  # of one phase [A]


def pulses(law: FixedLaw, theta_on: ArrayLike, theta_off: ArrayLike, i_ref: ArrayLike) -> Pulses:
    """What windows (electrical) and currents give, which broadcast [rad, A]. Motion is forward:
    braking, a window lies past alignment, at pi."""
    on, off, i = np.broadcast_arrays(*(np.asarray(v, float) for v in (theta_on, theta_off, i_ref)))
    found = np.zeros((2, i.size))
    known, sign = _exact(law.known), -1.0 if law.brakes else 1.0
    plant = _plant(known, sign)
    runs = _core.Runs(len(os.sched_getaffinity(0)))
    settles: dict[int, int] = {}

    def take() -> None:
        n, _, _, values = runs.take()
        rows = dict(zip(_core.period_columns(known.n_phases), np.asarray(values).T, strict=True))
        turned = rows["theta_m"] * known.N_r / (2 * np.pi)
        ends = [int(np.argmin(np.abs(turned - m))) for m in (settles[n], settles[n] + law.periods)]
        t, tau, squared = (np.diff(rows[key][ends])[0] for key in ("t", "tau", "i_squared_0"))
        found[:, n] = sign * tau / t, np.sqrt(squared / t)

    try:
        for n, (a, b, current) in enumerate(zip(on.flat, off.flat, i.flat, strict=True)):
            settles[n] = SETTLED if b - a <= np.pi else SETTLES
            window = _core.Conduction(
                theta_on=a,
                theta_off=b,
                brake_on=2 * np.pi - b,  # in the frame of positive torque
                brake_off=2 * np.pi - a,
                omega_start=0.0,
            )
            loop = _core.Simulation(law.controller(known, window, float(current)), plant)
            runs.add(n, loop, (settles[n] + law.periods + 0.01) * period(known), WITHIN)
        while runs.unfinished:
            take()
    finally:
        runs.close()
    return Pulses(*found.reshape(2, *i.shape))


def period(known: Known) -> float:
    """Electrical, at the working speed [s]."""
    return 2 * np.pi / (known.N_r * known.omega_m)


def full_flux_speed(known: Known) -> float:
    """At which the flux linkage of i_max, aligned, takes half a period to build up [rad/s]."""
    i, theta = np.array([known.i_max]), np.array([np.pi])
    psi = float(_core.magnetics(known.magnetics, i, theta)[0, 0])
    return float(np.pi) * known.u_dc / (known.N_r * psi)


def double_precision(known: Known) -> tuple[Magnetics, int, bool]:
    """What the core needs of every law."""
    return known.magnetics, known.n_phases, False


def chopped(known: Known, half: float, *, brakes: bool, hard: bool) -> FixedLaw:
    """Pulses whose current a comparator holds in a band of this half width [A], with a control that
    does nothing at a sample. Braking always chops hard."""
    coarse = _crossed(known)
    above = _core.Leg.demagnetize if hard or brakes else _core.Leg.freewheel

    def controller(known: Known, conduction: _core.Conduction, i: float) -> _core.Controller:
        law = _core.angles(
            *double_precision(known),
            conduction=conduction,
            reference=_core.MeanTorque.constant(i),
            i_band=max(half, min(coarse, BAND_WIDEST * i)),
            chop=above,
            watch=_core.AngleWatch.compare,
            table=_core.PulseTable(),
        )
        return _core.Controller(law, _core.Frame(delay=known.delay))

    still = replace(_exact(known), T_s=period(known) / SAMPLES, delay=0)
    smooth = half < coarse
    return FixedLaw(still, brakes, controller, 1 if smooth else PERIODS, smooth)


def _crossed(known: Known) -> float:
    """Half width of a band that is crossed in a part 1/CHOPPINGS of a period [A]."""
    middle = _core.magnetics(known.magnetics, np.array([known.i_max]), np.array([np.pi / 2]))
    return known.i_max * known.u_dc * period(known) / CHOPPINGS / float(middle[0, 0]) / 2


def _exact(known: Known) -> Known:
    """The drive with a torque reference of +-1, whose sensors and orders are exact."""
    return replace(
        known,
        reference="torque",
        tau_max=1.0,
        tau_working=1.0,
        brakes=False,
        t_dead=0.0,
        angle_step=0.0,
        i_step=0.0,
        i_noise=0.0,
        tracker_bandwidth=None,
    )


def _plant(known: Known, tau: float) -> _core.SimulationParts:
    """What a controller believes in, held at the working speed with this torque reference."""
    held = Load(kind="locked", speed_rpm=from_si(known.omega_m, "rpm"))
    sensing = Sensing(delay_samples=known.delay)
    return _core.SimulationParts(
        machine=known.magnetics,
        R=known.R,
        source=Source().core(known.u_dc),
        bridge=Converter(u_dc_V=known.u_dc).core(),
        shaft=held.core(J=known.J, B=0.0),
        t_dead=0.0,
        sampling=sensing.core(T_s=known.T_s, N_r=known.N_r),
        reference=course(([0.0], [tau])),
        theta_m=0.0,
        resolution=_core.Resolution(
            dt_max=period(known) / STEPS,
            scale=_core.Scale(i=known.i_max, u_dc=known.u_dc),
            record_every=-1.0,
        ),
    )
